"""The claims of [Thesis] 4.7.2 about the course of the drives."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from experiments.thesis.claims import Claim, Number, Share, numbers, printed
from experiments.thesis.cruise.drives import (
    CONVENTIONAL,
    PROPOSED,
    Driven,
)
from experiments.thesis.published import published
from planner.states import FloatArray

BACK = 0.5  # nearer to the centre line than one lateral sample [m]
ALIKE = 0.1  # means that differ by less than this share are alike
BEGINS = 0.1  # lateral offset from which the ego has begun to avoid [m]

Test = Callable[[Driven, Driven], bool]


@dataclass(frozen=True, slots=True)
class RoadDrives:
    """All drives on one road, by method; random ones in the order of their seeds."""

    road: str
    picked: Mapping[str, Driven]
    random: Mapping[str, Sequence[Driven]]

    def pairs(
        self, first: str = PROPOSED, second: str = CONVENTIONAL
    ) -> list[tuple[Driven, Driven]]:
        """Return the random layouts on which both methods arrived."""
        both = zip(self.random[first], self.random[second], strict=True)
        return [(a, b) for a, b in both if a.arrived and b.arrived]


class DriveClaim(NamedTuple):
    """A claim about the course of one drive."""

    id: str
    road: str
    place: str
    words: str
    published: Mapping[str, Number]
    measured: Callable[[Driven, Driven], Mapping[str, Number]]
    test: Test
    reason: str


def drive_claims(roads: Sequence[RoadDrives]) -> Iterator[Claim]:
    """Check what 4.7.2 says of each drive."""
    yield _safe(roads)
    yield _returns(roads, PROPOSED, back=True)
    yield _returns(roads, CONVENTIONAL, back=False)
    by_road = {one.road: one for one in roads}
    for claim in _drive_claims():
        drives = by_road[claim.road]
        pair = drives.picked[PROPOSED], drives.picked[CONVENTIONAL]
        yield Claim(
            f"4.7.2_{claim.id}",
            claim.place,
            claim.words,
            claim.published,
            claim.measured(*pair),
            claim.test(*pair),
            Share.count(
                (claim.test(a, b) for a, b in drives.pairs()),
                f"random layouts on road {claim.road} that both drive",
            ),
            claim.reason,
        )


def _safe(roads: Sequence[RoadDrives]) -> Claim:
    """Check that both methods reach their goals safely."""
    methods = (PROPOSED, CONVENTIONAL)
    picked = [road.picked[name] for road in roads for name in methods]
    random = [one for road in roads for name in methods for one in road.random[name]]
    car = sum(one.car_clearance > 0.0 for one in random if one.arrived)
    return Claim(
        "4.7.2_safe",
        "4.7.2",
        "both methods avoid the obstacles and reach their goals safely",
        {},
        numbers(
            least_clearance_of_the_disc_m=min(one.clearance for one in picked),
            least_clearance_of_a_car_m=min(one.car_clearance for one in picked),
            random_drives_that_arrived=sum(one.arrived for one in random),
            of_these_a_car_would_have_touched_nothing_in=car,
        ),
        all(one.arrived for one in picked),
        Share.count((one.arrived for one in random), "random drives of both methods"),
        "safe for the disc of 1 m only, which does not enclose a car; and with one "
        "target speed and 3 m/s² there is not always a candidate left",
    )


def _returns(roads: Sequence[RoadDrives], method: str, *, back: bool) -> Claim:
    """Check whether a method comes back to the centre line after each obstacle."""
    picked = [road.picked[method].farthest_return for road in roads]
    random = [
        one.farthest_return
        for road in roads
        for one in road.random[method]
        if one.arrived
    ]
    verb = "comes back" if back else "does not come back"
    return Claim(
        f"4.7.2_returns_{method}",
        "4.7.2, 4.8",
        f"the {method} method {verb} to the centre line after obstacles",
        {},
        {
            f"{road.road} comes back to m": value
            for road, one in zip(roads, picked, strict=True)
            for value in numbers(x=one).values()
        },
        all((one < BACK) is back for one in picked),
        Share.count(((one < BACK) is back for one in random), "random drives"),
        "back is nearer than one lateral sample (0.5 m) between each obstacle and the "
        "next one; the next obstacle often comes first",
        "all four picked layouts",
    )


def _mean(values: FloatArray, first: int, last: int) -> float:
    """Mean over some planning cycles; nan if there are none."""
    part = values[first:last]
    return float(part.mean()) if part.size else float("nan")


def _begins(one: Driven) -> float:
    """Return where the ego leaves the centre line [m]."""
    aside = np.flatnonzero(np.abs(one.l) > BEGINS)
    return float(one.s[aside[0]]) if aside.size else float(one.s[-1])


def _window_means(
    field: str, first: int, last: int
) -> Callable[[Driven, Driven], Mapping[str, Number]]:
    """Build a measure: the mean of both methods over some cycles."""

    def measure(ours: Driven, theirs: Driven) -> Mapping[str, Number]:
        return numbers(
            proposed=_mean(getattr(ours, field), first, last),
            conventional=_mean(getattr(theirs, field), first, last),
        )

    return measure


def _compared(
    field: str, first: int, last: int, judge: Callable[[float, float], bool]
) -> Test:
    """Build a test of the same means."""

    def test(ours: Driven, theirs: Driven) -> bool:
        return judge(
            _mean(getattr(ours, field), first, last),
            _mean(getattr(theirs, field), first, last),
        )

    return test


def _more(ours: float, theirs: float) -> bool:
    return ours > theirs


def _less(ours: float, theirs: float) -> bool:
    return ours < theirs


def _alike(ours: float, theirs: float) -> bool:
    return abs(ours - theirs) <= ALIKE * max(ours, theirs)


class _Window(NamedTuple):
    """A claim about the means of a cost over some planning cycles."""

    road: str
    key: str  # of the last cycle in `published.yaml`
    field: str  # of the drives
    judge: Callable[[float, float], bool]
    words: str
    first_key: str | None = None  # of the first cycle; None: the first of all


_WINDOWS = (
    _Window(
        "straight",
        "straight_first_cycles",
        "jerk",
        _more,
        "in the first cycles the proposed J_jerk is slightly higher",
    ),
    _Window(
        "curved",
        "curved_offset_to",
        "offset",
        _more,
        "between two cycles the proposed J_offset is larger",
        "curved_offset_from",
    ),
    _Window(
        "intersection",
        "intersection_alike_to",
        "offset",
        _alike,
        "until a cycle both methods deviate alike",
    ),
    _Window(
        "u_shaped",
        "u_shaped_alike_to",
        "jerk",
        _alike,
        "in the first cycles there is little difference in jerk",
    ),
    _Window(
        "u_shaped",
        "u_shaped_better_to",
        "jerk",
        _less,
        "after them the proposed jerk is lower",
        "u_shaped_alike_to",
    ),
)
_REASON = "it is a property of the layout that the thesis drew, which is not given"


def _drive_claims() -> tuple[DriveClaim, ...]:
    """List what 4.7.2 says about the figures; its seconds are planning cycles."""
    return (*map(_window_claim, _WINDOWS), _begins_claim())


def _window_claim(window: _Window) -> DriveClaim:
    """Build the claim about one window of planning cycles."""
    text = published().text
    first = 0 if window.first_key is None else int(text[window.first_key].value)
    last = int(text[window.key].value)
    return DriveClaim(
        window.key,
        window.road,
        text[window.key].place,
        f"{window.road}: {window.words}",
        printed(from_cycle=first, to_cycle=last),
        _window_means(window.field, first, last),
        _compared(window.field, first, last, window.judge),
        _REASON,
    )


def _begins_claim() -> DriveClaim:
    """Build the claim about where the first avoidance begins."""
    begins = published().text["curved_begins_proposed"]
    return DriveClaim(
        "curved_begins",
        "curved",
        begins.place,
        "curved: the proposed method begins to avoid earlier",
        printed(
            proposed_m=begins.value,
            conventional_m=published().text["curved_begins_conventional"].value,
        ),
        lambda a, b: numbers(proposed_m=_begins(a), conventional_m=_begins(b)),
        lambda a, b: _begins(a) < _begins(b),
        "both see the first obstacle in the same cycle, and begin there",
    )
