"""Makes a failure milder: toward the base values as far as it still fails.

First every key by itself to its mild value (delta debugging, Zeller and Hildebrandt,
IEEE TSE 28 (2002) 183), then all that are left together by bisection, then each alone.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.config.axes import Point
from experiments.sweep.search.exploration import RunPoints, SearchTrial, Tried
from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray

HALVINGS = 5  # of all keys together: to 1/32 of the way
HALVINGS_OF_KEY = 3
CLOSE = 1e-9  # coordinates that differ by less are the same

Probing = Generator[FloatArray, Tried, None]


@dataclass(slots=True)
class Reduced:
    """The mildest failure found so far."""

    point: Point
    coordinates: FloatArray
    run_id: str | None
    robustness: float | None
    runs: int = 0  # that it took

    def take(self, space: SearchSpace, at: FloatArray, tried: Tried) -> None:
        """Go on from a milder point that fails as well."""
        self.point, self.coordinates = space.point(at), at
        self.run_id, self.robustness = tried.run_id, tried.judgement.robustness


def reduce_failures(
    worst: Sequence[SearchTrial],
    mild: Point,
    space: SearchSpace,
    run: RunPoints,
    most_runs: int,
) -> list[Reduced]:
    """Make failures milder, all of them side by side.

    Args:
        worst: The failures.
        mild: Values toward which they are made milder.
        space: Of the search.
        run: Runs points.
        most_runs: For each failure.

    Returns:
        For each failure the mildest point found that fails in the same way.
    """
    found = [
        Reduced(one.point, one.coordinates.copy(), one.run_id, one.judgement.robustness)
        for one in worst
    ]
    goal = space.coordinates(mild)
    probes = [
        _Probe(space, one, reduced, goal)
        for one, reduced in zip(worst, found, strict=True)
    ]
    while True:
        active = [
            p for p in probes if p.wanted is not None and p.reduced.runs < most_runs
        ]
        if not active:
            return found
        answers = run([space.point(p.wanted) for p in active if p.wanted is not None])
        for probe, answer in zip(active, answers, strict=True):
            probe.reduced.runs += 1
            probe.answer(answer)


class _Probe:
    """The way of one failure to milder ones."""

    def __init__(
        self, space: SearchSpace, trial: SearchTrial, reduced: Reduced, goal: FloatArray
    ) -> None:
        self.reduced = reduced
        self._steps = _probing(space, trial.judgement.kind, reduced, goal)
        self.wanted: FloatArray | None = next(self._steps, None)

    def answer(self, tried: Tried) -> None:
        """Take the result of the wanted point, and want the next one."""
        try:
            self.wanted = self._steps.send(tried)
        except StopIteration:
            self.wanted = None


def _probing(space: SearchSpace, kind: str, best: Reduced, goal: FloatArray) -> Probing:
    """Yield the coordinates to try; the answers move `best`."""
    numbers = ~np.array(space.is_choice, dtype=bool)
    fixed = np.zeros(goal.size, dtype=bool)
    for key in range(goal.size):
        at = best.coordinates.copy()
        at[key] = goal[key]
        if _same(space, at, best):
            continue
        tried = yield at
        if tried.judgement.kind == kind:
            best.take(space, at, tried)
            fixed[key] = True
    left = numbers & ~fixed & (np.abs(best.coordinates - goal) > CLOSE)
    yield from _halve(space, kind, best, goal, left, HALVINGS)
    for key in np.flatnonzero(left).tolist():
        alone = np.arange(goal.size) == key
        yield from _halve(space, kind, best, goal, alone, HALVINGS_OF_KEY)


def _halve(
    space: SearchSpace,
    kind: str,
    best: Reduced,
    goal: FloatArray,
    moved: np.ndarray[tuple[int], np.dtype[np.bool_]],
    halvings: int,
) -> Probing:
    """Bisect between the failure and its mild values for some of the keys."""
    start = best.coordinates.copy()
    milder = np.where(moved, goal, start)
    passes, fails = 0.0, 1.0  # shares of the way from mild to the failure
    for _ in range(halvings if moved.any() else 0):
        share = 0.5 * (passes + fails)
        at = milder + share * (start - milder)
        if _same(space, at, best):
            return
        tried = yield at
        if tried.judgement.kind == kind:
            best.take(space, at, tried)
            fails = share
        else:
            passes = share


def _same(space: SearchSpace, at: FloatArray, best: Reduced) -> bool:
    """Check whether coordinates are of the point that is known already."""
    return space.point(at) == best.point
