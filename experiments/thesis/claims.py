"""Claims: what the thesis says, what was measured, and whether it holds.

A claim may be tried on the picked layouts, whose outcome lies near the published one
because they were picked for that, and on random ones, which is the evidence.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from experiments.comparison.inference import wilson

DIGITS = 4  # significant ones of every number that is reported
FEW = 0.1  # share of trials up to which a claim mostly does not hold
NOTHING = 1e-9  # what is smaller is rounding
Number = float | int


class ClaimVerdict(StrEnum):
    """Whether a claim holds."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    MOSTLY_FAILS = "mostly does not hold"
    FAILS = "does not hold"
    UNKNOWN = "not measured"


@dataclass(frozen=True, slots=True)
class Share:
    """Share of random trials in which a claim holds, with Wilson's 95 % interval."""

    holds: int
    of: int
    percent: float
    low: float
    high: float
    trials: str  # what a trial is, in words

    @classmethod
    def count(cls, outcomes: Iterable[bool], trials: str) -> "Share | None":
        """Count; None of nothing."""
        found = list(outcomes)
        if not found:
            return None
        holds = sum(found)
        rate = wilson(holds, len(found))
        value, low, high = (
            round(100.0 * end, 1) for end in (rate.value, rate.low, rate.high)
        )
        return cls(holds, len(found), value, low, high, trials)


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the thesis and its measured counterpart."""

    id: str
    place: str  # in the thesis
    words: str
    published: Mapping[str, Number]
    measured: Mapping[str, Number]
    picked: bool | None = (
        None  # whether it holds where it was measured; None: not tried
    )
    share: Share | None = None
    reason: str = ""
    on: str = "picked layout"  # where `measured` and `picked` are from

    def __post_init__(self) -> None:
        """Reject a claim that fails without a reason."""
        if self.verdict is not ClaimVerdict.HOLDS and not self.reason:
            raise ValueError(f"{self.id}: {self.verdict}, and no reason is given")

    @property
    def verdict(self) -> ClaimVerdict:
        """Verdict from the random trials; without them, from the picked layouts."""
        if self.share is None:
            if self.picked is None:
                return ClaimVerdict.UNKNOWN
            return ClaimVerdict.HOLDS if self.picked else ClaimVerdict.FAILS
        if self.share.holds == 0:
            return ClaimVerdict.FAILS
        if self.share.holds == self.share.of:
            return ClaimVerdict.HOLDS
        few = self.share.holds <= FEW * self.share.of
        return ClaimVerdict.MOSTLY_FAILS if few else ClaimVerdict.PARTLY


@dataclass(frozen=True, slots=True)
class ResultTable:
    """Measured numbers in rows."""

    id: str
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str | Number, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a picture."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Picture:
    """Content of a figure; `discs` are (x, y, radius), `points` are (x, y)."""

    id: str
    title: str
    x: str
    y: str
    series: tuple[Series, ...]
    discs: tuple[tuple[float, float, float], ...] = ()
    points: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Chapter:
    """All results of one chapter.

    What depends on the machine is in `timing` and `timing_claims` alone.
    """

    name: str
    number: int
    title: str
    effort: Mapping[str, int]  # numbers of layouts, scenes, seeds
    claims: tuple[Claim, ...]
    tables: tuple[ResultTable, ...]
    beyond: tuple[ResultTable, ...]
    timing_claims: tuple[Claim, ...] = ()
    timing: tuple[ResultTable, ...] = ()
    missing: tuple[str, ...] = ()  # what could not be measured here, and why
    pictures: tuple[Picture, ...] = field(default=())


def shown(value: Number) -> Number:
    """Round to the digits that are reported; whole numbers stay whole."""
    if isinstance(value, int):
        return value
    if not math.isfinite(value):
        return value
    if abs(value) < NOTHING:
        return 0
    digits = DIGITS - 1 - math.floor(math.log10(abs(value)))
    rounded = round(value, max(digits, 0))
    return int(rounded) if rounded == int(rounded) else rounded


def numbers(**values: float) -> dict[str, Number]:
    """Round named numbers; `_` in a name stands for a space."""
    return {name.replace("_", " "): shown(value) for name, value in values.items()}


def printed(**values: float) -> dict[str, Number]:
    """Collect published numbers, which stay as printed."""
    return {
        name.replace("_", " "): int(value) if value == int(value) else value
        for name, value in values.items()
    }


def decline(before: float, after: float) -> float:
    """Return by how many percent a quantity is lower."""
    return 100.0 * (before - after) / before
