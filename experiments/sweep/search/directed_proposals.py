"""Proposals that begin at the ends of all ranges and go on around what was worst.

Defects often show at the ends of ranges, and where two or three of them meet (boundary
values and covering arrays: Kuhn, Wallace and Gallo, IEEE TSE 30 (2004) 418). So the
first points are ends, every three of them in each combination. After them the worst
points found so far, far from each other, are changed in one key or some, mostly a
little and sometimes a lot, rather in keys that have turned out to matter. Where a
change was for the worse, it goes on that way (pattern moves: Hooke and Jeeves, J. ACM 8
(1961) 212). Several points live side by side: a valley of the objective that leads
nowhere does not keep the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray

RANDOM_SHARE = 5  # one point in so many is random, wherever the others are
PARENTS = 6  # that live side by side
RANKS = 1.5  # mean rank of those that are changed, of an exponential distribution
APART = 0.15  # root mean square of coordinate differences between two of them
SHORTEST_STEP, LONGEST_STEP = 0.004, 0.4  # of a change; its logarithm is uniform
ONE_KEY = 0.5  # chance that a change is of one key
SHARE_OF_KEYS = 0.5  # else: chance of each key to be changed
GO_ON = 2.0  # times the last change, where it was for the worse
MATTERS = 0.01  # of the spread of all values, from which on a change of a key does
TO_AN_END = 0.1  # chance that a changed key goes to an end of its range


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """A point and its value."""

    at: FloatArray
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """A point that was asked for, and the one that it was made from."""

    at: FloatArray
    parent: _Known | None = None


class DirectedProposer:
    """Ends of the ranges first, then changes of the worst points; it minimises.

    Args:
        space: Where to propose.
        seed: Of everything that is drawn.
        mild: Coordinates of the mild point, (n_keys,): the first point is the end of
            every range that is farthest from it.
    """

    def __init__(self, space: SearchSpace, seed: int, mild: FloatArray) -> None:
        self._choices = [
            count if choice else None
            for choice, count in zip(space.is_choice, space.counts, strict=True)
        ]
        self._generator = np.random.default_rng(seed)
        self._ends = self._designed(mild)
        self._asked: list[_Asked] = []
        self._known: list[_Known] = []
        self._moves: list[_Asked] = []  # to go on with
        self._mattered = np.ones(mild.size)  # how often a change of each key did
        self._count = 0

    def ask(self, count: int) -> list[FloatArray]:
        """Return the next points."""
        parents = self._parents()
        self._asked = [self._next(parents) for _ in range(count)]
        return [one.at for one in self._asked]

    def tell(self, values: Sequence[float | None]) -> None:
        """Learn from the values of the points asked for last."""
        self._moves = []
        for asked, value in zip(self._asked, values, strict=True):
            if value is None:
                continue
            known = _Known(asked.at, value)
            self._known.append(known)
            if asked.parent is not None:
                self._compare(asked.parent, known)

    def _compare(self, parent: _Known, child: _Known) -> None:
        """Learn from a change: which keys matter, and where to go on."""
        told = [one.value for one in self._known]
        changed = child.at != parent.at
        apart = abs(child.value - parent.value)
        if changed.sum() == 1 and apart > MATTERS * (max(told) - min(told)):
            self._mattered[changed] += 1.0
        if child.value < parent.value:
            at = np.clip(child.at + GO_ON * (child.at - parent.at), 0.0, 1.0)
            choices = np.array([count is not None for count in self._choices])
            at[choices] = child.at[choices]
            if (at != child.at).any():
                self._moves.append(_Asked(at, child))

    def _next(self, parents: Sequence[_Known]) -> _Asked:
        """Return one point."""
        if self._ends:
            return _Asked(self._ends.pop())
        if self._moves:
            return self._moves.pop(0)
        self._count += 1
        if not parents or self._count % RANDOM_SHARE == 0:
            return _Asked(self._generator.random(len(self._choices)))
        rank = min(int(self._generator.exponential(RANKS)), len(parents) - 1)
        return _Asked(self._changed(parents[rank].at), parents[rank])

    def _designed(self, mild: FloatArray) -> list[FloatArray]:
        """Return the ends to begin with, the last one first.

        Without choices they are an orthogonal array of two levels and strength 3.
        """
        is_low = np.round(mild) == 0.0
        rows = [np.where(row, is_low, ~is_low) for row in ends_design(mild.size)]
        first, *others = rows
        order = self._generator.permutation(len(others))
        points = [first, *(others[k] for k in order)]
        found = [point.astype(float) for point in points]
        for key, count in enumerate(self._choices):
            if count is not None:  # every value in its turn
                values = self._generator.permutation(count)
                for row, at in enumerate(found):
                    at[key] = (values[row % count] + 0.5) / count
        return found[::-1]

    def _any_choice(self, count: int) -> float:
        """Draw a value of a choice, as a coordinate."""
        return (int(self._generator.integers(count)) + 0.5) / count

    def _parents(self) -> list[_Known]:
        """Return the worst points that are far from each other, the worst first."""
        found: list[_Known] = []
        for one in sorted(self._known, key=lambda known: known.value):
            squares = (float(((one.at - other.at) ** 2).mean()) for other in found)
            if all(square > APART**2 for square in squares):
                found.append(one)
            if len(found) == PARENTS:
                break
        return found

    def _changed(self, parent: FloatArray) -> FloatArray:
        """Return a point near another one, or far in one of its keys."""
        draw = self._generator
        changed = draw.random(parent.size) < SHARE_OF_KEYS
        if draw.random() < ONE_KEY or not changed.any():
            key = draw.choice(parent.size, p=self._mattered / self._mattered.sum())
            changed = np.arange(parent.size) == key
        at = parent.copy()
        for key in np.flatnonzero(changed).tolist():
            count = self._choices[key]
            if count is not None:
                at[key] = self._any_choice(count)
            elif draw.random() < TO_AN_END:
                at[key] = float(draw.integers(2))
            else:
                share = draw.random()
                step = SHORTEST_STEP * (LONGEST_STEP / SHORTEST_STEP) ** share
                moved = at[key] + step * draw.choice((-1.0, 1.0))
                at[key] = np.abs(moved) if moved < 1.0 else 2.0 - moved  # reflected
        return at


def ends_design(n_keys: int) -> "list[np.ndarray[tuple[int], np.dtype[np.bool_]]]":
    """Return rows of two levels in which every three keys have all combinations.

    A Hadamard matrix over its negative (Hedayat, Sloane and Stufken, Orthogonal Arrays,
    1999, theorem 7.5); the first row is true throughout.
    """
    from scipy.linalg import hadamard  # takes time to load

    order = 1 << max(n_keys - 1, 0).bit_length()
    square = hadamard(order)[:, :n_keys] > 0
    return [*square, *~square]
