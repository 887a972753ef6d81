"""What a search has found, for the page of its folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.storage.json_files import read_json
from experiments.sweep.search.files import (
    ASKED,
    FOUND,
    PROBABILITY,
    probability_words,
    shown,
)


@dataclass(frozen=True, slots=True)
class FoundGroup:
    """One group of failures."""

    kind: str  # with the choices that its members share
    failures: int
    cases: tuple[tuple[str, str, str], ...]  # worst and mildest: values, command


@dataclass(frozen=True, slots=True)
class SearchPart:
    """The part of the page about the search."""

    method: str
    finished: bool
    summary: str = ""
    probability: str = ""
    groups: tuple[FoundGroup, ...] = ()


def search_part(folder: Path) -> SearchPart | None:
    """Read what a search has found; None if the folder is of a plain sweep.

    Raises:
        ResultsError: If a file is damaged.
    """
    if not (folder / ASKED).is_file():
        return None
    method = str(read_json(folder / ASKED).get("method"))
    if not (folder / FOUND).is_file():
        return SearchPart(method, finished=False)
    found = read_json(folder / FOUND)
    first = found["first_failure"]
    told = len(found["trials"]) - found["invalid"]
    words = f"{found['failures']} of {told} trials failed"
    words += "" if first is None else f", first trial {first}"
    words += f"; {found['coverage']['share']:.0%} of the cells of two keys seen"
    against = found.get("against")
    if against is not None:
        words += (
            f"; at random {against['failures']} of {against['trials']} failed, first "
            f"trial {against['first_failure'] or 'none'}"
        )
    groups = tuple(_group(one) for one in found["clusters"])
    return SearchPart(
        method,
        finished=True,
        summary=words,
        probability=_probability(found),
        groups=groups,
    )


def _group(one: dict[str, Any]) -> FoundGroup:
    """Return one group of failures."""
    choices = shown(one.get("choices") or {})
    kind = f"{one['kind']}, {choices}" if choices else str(one["kind"])
    cases = [
        (name, shown(case["point"]), str(case["command"]))
        for name, case in (("worst", one["worst"]), ("mildest", one["mildest"]))
        if case is not None
    ]
    return FoundGroup(kind, int(one["failures"]), tuple(cases))


def _probability(found: dict[str, Any]) -> str:
    """Say how probable a failure is, if that was estimated."""
    value = found.get(PROBABILITY)
    if value is None:
        return ""
    return probability_words(value["probability"], value["low"], value["high"])
