"""The failures of a sweep, grouped by reason."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from experiments.comparison.results import FAILURE, LABEL, REASON, RUN_ID, Row
from experiments.metrics import columns

LISTED = 40  # runs of one kind of failure that are listed by name

# A number by itself, not one in a name such as car.7 or t_3.
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\w)")
MOST_SAID = 5  # kinds of failures that a terminal gets to read

# status -> what to look for in the reason, and the sentence made of it
_SENTENCES = {
    "collision": (r"(touched .*)", r"The ego \1."),
    "timeout": (
        r"s = (.*?) m of (.*?) m at t = (.*?) s\b(.*)",
        r"The ego was at s = \1 m of \2 m when time was up at t = \3 s\4.",
    ),
    "blocked": (r"(stood .*)", r"The ego \1."),
    "off road": (r"(.*)", r"The ego left the road: \1."),
    "planner failed": (r"(.*)", r"The planner failed: \1."),
    "simulator failed": (r"(.*)", r"SUMO failed: \1."),
    "no room": (r"(.*)", r"The ego found no gap to enter: \1."),
}
_NAME = re.compile(r"\S*\d\S*")  # a word with digits in it


@dataclass(frozen=True, slots=True)
class FailedRun:
    """One failed run."""

    run_id: str
    where: str  # scenario, planner, axes, seed
    reason: str
    place: str  # of its page or folder, relative to the sweep's

    @property
    def has_page(self) -> bool:
        """Whether the place is a page."""
        return self.place.endswith(".html")


@dataclass(frozen=True, slots=True)
class FailureKind:
    """Runs whose failure reasons differ only in their numbers."""

    status: str
    words: str  # of the reason, with the range of each number
    count: int
    by_planner: str  # how many of which
    runs: tuple[FailedRun, ...]  # the first of them
    verdicts: str = ""  # how often whose fault; empty where nothing was judged

    @property
    def sentence(self) -> str:
        """What happened, as a person would write it."""
        pattern, sentence = _SENTENCES.get(self.status, (r"(.+)", r"\1."))
        found = re.fullmatch(pattern, self.words, re.DOTALL) if self.words else None
        words = f"{self.words or self.status}."
        if found is not None:
            words = found.expand(sentence).replace("..", ".")
        return f"{words} Verdict: {self.verdicts}." if self.verdicts else words


def failure_kinds(
    rows: Sequence[Row], axes: Sequence[str], places: Sequence[str]
) -> list[FailureKind]:
    """Group the runs that did not arrive, the most frequent kind first.

    Args:
        rows: Of the results.
        axes: Names of the sweep's axes.
        places: Of each row, what is to be opened.

    Returns:
        Kinds of failures.
    """
    kinds: dict[tuple[str, str], list[tuple[Row, str]]] = {}
    for row, place in zip(rows, places, strict=True):
        if not row[columns.ARRIVED]:
            kinds.setdefault(_kind(row), []).append((row, place))
    found = [_gathered(kind, failed, axes) for kind, failed in kinds.items()]
    return sorted(found, key=lambda kind: (-kind.count, kind.status, kind.words))


def failure_lines(kinds: Sequence[FailureKind], command: str) -> list[str]:
    """Write the most frequent failures for a terminal, with how to look at one.

    Args:
        kinds: Of the failures, the most frequent first.
        command: That repeats a run with its page; its id follows.
    """
    lines = [
        f"{kind.count} {kind.status} ({kind.by_planner}): {kind.sentence} "
        f"Look: {command} {kind.runs[0].run_id}"
        for kind in kinds[:MOST_SAID]
    ]
    more = sum(kind.count for kind in kinds[MOST_SAID:])
    return [*lines, f"{more} other failures: see the page"] if more else lines


def _kind(row: Row) -> tuple[str, str]:
    """Return status and generalised reason of a failed run."""
    status = str(row.get(FAILURE) or row[columns.STATUS]).replace("_", " ")
    return status, _NAME.sub("#", _reason(row, status))


def _reason(row: Row, status: str) -> str:
    """Return the reason of a failed run without its status."""
    return str(row.get(REASON) or "").removeprefix(status).strip(" :")


def _common_words(reasons: Sequence[str]) -> str:
    """Write reasons that differ only in words with digits as one.

    Numbers become their range (`t = 1.5 to 5.5 s`); of several names, one is given.
    """
    words = [_NAME.findall(reason) for reason in reasons]
    shared = iter([_one_word(found) for found in zip(*words, strict=True)])
    return _NAME.sub(lambda _: next(shared), reasons[0])


def _one_word(found: Sequence[str]) -> str:
    """Write what stands in one place of several reasons."""
    if len(set(found)) == 1:
        return found[0]
    places = [place for word in found if (place := _NUMBER.search(word))]
    if len(places) == len(found):
        values = sorted((place[0] for place in places), key=float)
        before, behind = found[0][: places[0].start()], found[0][places[0].end() :]
        return f"{before}{values[0]} to {values[-1]}{behind}"
    return f"{found[0]} or another"


def _gathered(
    kind: tuple[str, str], failed: Sequence[tuple[Row, str]], axes: Sequence[str]
) -> FailureKind:
    """Build one kind from its runs."""
    counts: dict[str, int] = {}
    for row, _ in failed:
        label = str(row[LABEL] or row[columns.PLANNER])
        counts[label] = counts.get(label, 0) + 1
    runs = tuple(_failed(row, place, axes) for row, place in failed[:LISTED])
    by_planner = ", ".join(
        f"{count} {label}" for label, count in sorted(counts.items())
    )
    status = kind[0]
    words = _common_words([_reason(row, status) for row, _ in failed])
    verdicts = _verdicts([row for row, _ in failed])
    return FailureKind(status, words, len(failed), by_planner, runs, verdicts)


def _verdicts(failed: Sequence[Row]) -> str:
    """Count whose fault the contacts of some runs are, the most frequent first."""
    found = [row.get(columns.VERDICT) for row in failed]
    counts = Counter(str(fault) for fault in found if fault)
    return ", ".join(f"{count} {fault}" for fault, count in counts.most_common())


def _failed(row: Row, place: str, axes: Sequence[str]) -> FailedRun:
    """Describe one failed run."""
    return FailedRun(
        str(row[RUN_ID]), where_of(row, axes), str(row.get(REASON) or ""), place
    )


def where_of(row: Row, axes: Sequence[str]) -> str:
    """Describe the run of a row: scenario, planner, axes, seed."""
    label = row[LABEL] or row[columns.PLANNER]
    point = [f"{name} = {_short(row[name])}" for name in axes]
    parts = [row[columns.SCENARIO], label, *point, f"seed {row[columns.SEED]}"]
    return ", ".join(map(str, parts))


def _short(value: Any) -> str:
    """Format a value on an axis."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
