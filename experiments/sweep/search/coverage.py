"""How much of its space a search has seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray

CELLS = 8  # of a key with more values than that


@dataclass(frozen=True, slots=True)
class SpaceCoverage:
    """Which part of the space was seen.

    `pairs` is the share of the cells hit in the planes of every two keys, each cut
    into `CELLS` parts (fewer for fewer values); of one key alone, of its own cells.
    `discrepancy` is the centred one of the points: 0 is perfectly even.
    """

    cells: int  # of all planes
    hit: int
    discrepancy: float | None  # None of fewer than two points

    @property
    def pairs(self) -> float:
        """Share of the cells that are hit."""
        return self.hit / self.cells


def space_coverage(space: SearchSpace, points: Sequence[FloatArray]) -> SpaceCoverage:
    """Return how much of the space points have covered, each (n_keys,)."""
    from scipy.stats import qmc  # takes half a second to load

    counts = [min(count or CELLS, CELLS) for count in space.counts]
    at = np.clip(np.array(points).reshape(-1, len(counts)), 0.0, 1.0)
    cell = np.minimum((at * counts).astype(int), np.array(counts) - 1)
    every = range(len(counts))
    planes: list[tuple[int, ...]] = [*combinations(every, 2)] or [(0,)]
    cells = hit = 0
    for plane in planes:
        cells += int(np.prod([counts[key] for key in plane]))
        hit += len({tuple(row) for row in cell[:, list(plane)].tolist()})
    even = float(qmc.discrepancy(at)) if len(at) > 1 else None
    return SpaceCoverage(cells, hit, even)
