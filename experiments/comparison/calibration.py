"""How often the printed intervals cover, and the printed claims err, when simulated.

Coverage is that of 95 % intervals of a mean paired difference, by shape and number of
pairs. The error of a claim is the chance that any of its corrected p values is at most
0.05 although no planner differs from the baseline.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from experiments.comparison import inference as st
from experiments.comparison import location
from planner.states import FloatArray

PAIRS: Final = (10, 20, 30, 100)
REPETITIONS = 2000
RESAMPLES = 1999  # of the bootstrap, in simulations of coverage
LEVEL = 0.05
EVENT_RATE = 0.1  # of the event of a simulated rate, for all planners
HALF = 0.5
_CHUNK = 500  # rows resampled at a time

Draw = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]


@dataclass(frozen=True, slots=True)
class Shape:
    """A distribution of differences."""

    draw: Draw
    mean: float
    words: str


def _half_zero(draw: Draw) -> Draw:
    """Mix a distribution with as many zeros."""

    def mixed(rng: np.random.Generator, size: tuple[int, ...]) -> FloatArray:
        return np.where(rng.random(size) < HALF, 0.0, draw(rng, size))

    return mixed


def _exponential(rng: np.random.Generator, size: tuple[int, ...]) -> FloatArray:
    return rng.exponential(1.0, size)


def _normal(rng: np.random.Generator, size: tuple[int, ...]) -> FloatArray:
    return rng.standard_normal(size)


SHAPES: Final[Mapping[str, Shape]] = {
    "normal": Shape(_normal, 0.0, "standard normal"),
    "skewed": Shape(_exponential, 1.0, "exponential, skewness 2"),
    "tied": Shape(
        lambda rng, size: np.round(_normal(rng, size)), 0.0, "normal, in whole steps"
    ),
    "zero-inflated": Shape(_half_zero(_normal), 0.0, "half zeros, half normal"),
    "zero-inflated and skewed": Shape(
        _half_zero(_exponential), 0.5, "half zeros, half exponential"
    ),
    "heavily skewed": Shape(
        lambda rng, size: rng.lognormal(0.0, 1.0, size),
        float(np.exp(0.5)),
        "lognormal, skewness 6.2",
    ),
}
# Of these the claims are made whose error is simulated: what planners' differences
# look like, each centred on 0.
CLAIMED: Final = ("normal", "skewed", "tied", "zero-inflated")


@dataclass(frozen=True, slots=True)
class Coverage:
    """Coverage of the interval of a mean."""

    shape: str
    pairs: int
    covered: float  # share of the intervals
    printed: float  # share of the samples that have an interval


def coverage(shape: str, pairs: int, repetitions: int = REPETITIONS) -> Coverage:
    """Simulate the interval of `location.mean`."""
    rng = np.random.default_rng([pairs, *shape.encode()])
    values = SHAPES[shape].draw(rng, (repetitions, pairs))
    values = values[np.ptp(values, axis=1) > 0.0]  # equal ones have no interval
    covered = 0
    for start in range(0, len(values), _CHUNK):
        rows = location.studentise(values[start : start + _CHUNK], RESAMPLES)
        low, high = location.mean_ends(rows, pairs)
        covered += int(
            np.sum((low <= SHAPES[shape].mean) & (SHAPES[shape].mean <= high))
        )
    return Coverage(shape, pairs, covered / len(values), len(values) / repetitions)


def claim_error(
    pairs: int,
    shapes: Sequence[str],
    planners: int,
    cells: int,
    repetitions: int = REPETITIONS,
) -> float:
    """Simulate the chance that a claim without any difference has a finding.

    Args:
        pairs: Seeds.
        shapes: Of the differences; a claim has one metric of each, and one rate.
        planners: Beside the baseline, whose runs they share.
        cells: Scenarios times points of the axes.
        repetitions: Simulated claims.

    Returns:
        The share of claims with a corrected p of at most `LEVEL`. Holm's first step
        is Bonferroni's, so without differences a claim errs where its least p is at
        most `LEVEL` over its size.
    """
    rng = np.random.default_rng([pairs, planners, cells, len(shapes)])
    tests = planners * cells * (len(shapes) + 1)
    size = (planners, cells, pairs)
    wrong = sum(
        _least_p(rng, shapes, size, LEVEL / tests) * tests <= LEVEL
        for _ in range(repetitions)
    )
    return wrong / repetitions


def _least_p(
    rng: np.random.Generator,
    shapes: Sequence[str],
    size: tuple[int, int, int],
    level: float,
) -> float:
    """Draw one claim and return its least p value, exact where it is below a level."""
    planners, cells, pairs = size
    found = [1.0]
    for name in shapes:
        shape = SHAPES[name]
        own = shape.draw(rng, size) - shape.mean
        common = 0.5 * (shape.draw(rng, (1, cells, pairs)) - shape.mean)
        common *= rng.choice([-1.0, 1.0], common.shape)  # of the baseline
        apart = (own - common).reshape(-1, pairs)
        apart = apart[np.ptp(apart, axis=1) > 0.0]
        error = apart.std(axis=1, ddof=1) / np.sqrt(pairs)
        student = location.student_p(apart.mean(axis=1) / error, pairs)
        # p is at least that of t: rows that t clears need no bootstrap
        bold = apart[student <= level]
        found += [float(location.mean(row).p_value or 0.0) for row in bold]
    happened = rng.random((planners + 1, cells, pairs)) < EVENT_RATE
    gained = np.sum(happened[1:] & ~happened[0], axis=-1).ravel()
    lost = np.sum(~happened[1:] & happened[0], axis=-1).ravel()
    pairs_of_counts = {(int(a), int(b)) for a, b in zip(lost, gained, strict=True)}
    found += [st.rates_p(*counts) for counts in pairs_of_counts if any(counts)]
    return min(found)
