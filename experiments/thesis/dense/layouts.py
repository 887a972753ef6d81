"""Layouts of [Thesis] ch. 5 and their published results.

Obstacles are (s, l, r_ob) [m] in the frame of a straight road. The two layouts are
picked among random ones so that the outcome lies near that of [Thesis] fig. 5.9 and
5.10, whose layouts are not given: they are examples, not evidence. Evidence is the
share of random layouts in which a claim holds.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from planner.states import FloatArray

HALF_WIDTH: Final = 5.0  # l_rw of table 5.1 [m]
LENGTH: Final = 60.0  # of the road [m]
EGO_RADIUS: Final = 2.66  # r_ev of table 5.1 [m]

# Table 5.4: length, width, r_ob [m]
SIZES: Final = (
    (4.0, 3.0, 2.5),
    (2.69, 1.66, 1.58),
    (5.02, 1.96, 2.7),
    (1.0, 1.0, 0.71),
)
SAME_RADIUS: Final = SIZES[1][2]


@dataclass(frozen=True, slots=True)
class PublishedResult:
    """One row of [Thesis] table 5.3 or 5.5."""

    length: float  # [m]
    max_heading: float  # [rad]
    run_time: float  # [ms]


@dataclass(frozen=True, slots=True)
class PublishedLayout:
    """Obstacles and published results by method."""

    name: str
    obstacles: tuple[tuple[float, float, float], ...]
    published: dict[str, PublishedResult]

    def array(self) -> FloatArray:
        """Return the obstacles in rows, (n, 3) [m]."""
        return np.array(self.obstacles)


SAME_SIZE: Final = PublishedLayout(
    "same_size",
    ((9.3, -2.6, 1.58), (20.7, 0.6, 1.58), (25.6, 0.7, 1.58), (42.2, 2.1, 1.58)),
    {
        "uniform": PublishedResult(65.75, 0.91, 231.43),
        "adaptive": PublishedResult(62.27, 0.74, 238.27),
    },
)
DIFFERENT_SIZES: Final = PublishedLayout(
    "different_sizes",
    ((10.2, -4.4, 2.5), (19.8, 1.2, 1.58), (28.1, 3.5, 2.7), (47.8, -1.1, 0.71)),
    {
        "uniform": PublishedResult(66.65, 0.96, 231.91),
        "adaptive": PublishedResult(61.04, 0.67, 242.12),
    },
)

# Table 5.2: collision paths and effectiveness [%] for 1 to 4 obstacles
EFFECTIVENESS: Final = {
    "uniform": ((196, 85.64), (345, 74.73), (455, 66.67), (626, 54.14)),
    "adaptive": ((0, 100.0), (2, 99.85), (6, 99.62), (10, 99.61)),
}

FIRST_S, LAST_S = 8.0, 52.0  # of random obstacles [m]
LEAST_SPACING = 4.0  # along s [m]


def random_layout(n: int, *, seed: int, same_size: bool) -> FloatArray:
    """Draw n obstacles on the road of the chapter.

    l is uniform on the road. The places along s are uniform among all that lie in
    8 ... 52 m and keep 4 m between neighbours; the published layouts have 4.9 m. Sizes
    are those of table 5.4, without repetition up to four obstacles.

    Args:
        n: Number of obstacles, 1 ... 12.
        seed: Same seed, same layout.
        same_size: Whether all are of size 2.

    Returns:
        (s, l, r_ob) in rows, (n, 3) [m].
    """
    random = np.random.default_rng([seed, n, int(same_size)])
    room = LAST_S - FIRST_S - LEAST_SPACING * (n - 1)
    s = FIRST_S + np.sort(random.uniform(0.0, room, n)) + LEAST_SPACING * np.arange(n)
    l = random.uniform(-HALF_WIDTH, HALF_WIDTH, n)
    order = [random.permutation(len(SIZES)) for _ in range(math.ceil(n / len(SIZES)))]
    sizes = np.array([size[2] for size in SIZES])[np.concatenate(order)[:n]]
    radius = np.full(n, SAME_RADIUS) if same_size else sizes
    return np.column_stack([s, l, radius])
