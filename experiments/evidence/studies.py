"""The published figures that need no sweep: simulated statistics, obstacle layouts."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np

from experiments.comparison import calibration
from experiments.sweep.processes.parallel import Work
from experiments.thesis.dense.layouts import HALF_WIDTH, LENGTH, random_layout
from experiments.thesis.dense.methods import (
    METHODS,
    SIDES,
    SIDES_PRINTED,
    Measured,
    measured,
    share_better,
)
from planner.dense.field import straight_field

Data = dict[str, Any]
LAYOUTS: Final = 400  # random ones a row
QUICK_LAYOUTS: Final = 3
QUICK_REPETITIONS: Final = 20
CLAIMS: Final[Mapping[str, tuple[str, ...]]] = {
    "normal, skewed, tied and zero-inflated": calibration.CLAIMED,
    "skewed only": ("skewed",),
    "zero-inflated and skewed only": ("zero-inflated and skewed",),
}
PLANNERS_OF_CLAIM: Final = 3  # simulated
CELLS_OF_CLAIM: Final = 6


def statistics(work: Work, *, quick: bool) -> Data:
    """Simulate coverage and error of the procedures that the tables are made with."""
    repetitions = QUICK_REPETITIONS if quick else calibration.REPETITIONS
    asked = [(name, n) for name in calibration.SHAPES for n in calibration.PAIRS]
    covered = work.map("coverage", partial(_coverage, repetitions=repetitions), asked)
    claims = [(shapes, n) for shapes in CLAIMS.values() for n in calibration.PAIRS]
    simulated = work.map(
        "error of a claim", partial(_claim_error, repetitions=repetitions), claims
    )
    errors = dict(zip(claims, simulated, strict=True))
    found = {(one.shape, one.pairs): one for one in covered}
    return {
        "repetitions": repetitions,
        "planners": PLANNERS_OF_CLAIM,
        "cells": CELLS_OF_CLAIM,
        "level": calibration.LEVEL,
        "event_rate": calibration.EVENT_RATE,
        "tables": [
            {
                "title": "Coverage of the 95 % interval of a mean difference [%]",
                "header": ["differences", *(f"{n} pairs" for n in calibration.PAIRS)],
                "rows": [
                    [
                        f"{name}: {shape.words}",
                        *(
                            f"{100.0 * found[name, n].covered:.1f}"
                            for n in calibration.PAIRS
                        ),
                    ]
                    for name, shape in calibration.SHAPES.items()
                ],
            },
            {
                "title": "Claims with a finding though there is no difference [%]",
                "header": ["metrics", *(f"{n} pairs" for n in calibration.PAIRS)],
                "rows": [
                    [
                        name,
                        *(
                            f"{100.0 * errors[shapes, n]:.1f}"
                            for n in calibration.PAIRS
                        ),
                    ]
                    for name, shapes in CLAIMS.items()
                ],
            },
        ],
    }


def _coverage(asked: tuple[str, int], repetitions: int) -> calibration.Coverage:
    """Simulate one cell of the table, in a worker process."""
    return calibration.coverage(*asked, repetitions=repetitions)


def _claim_error(asked: tuple[Sequence[str], int], repetitions: int) -> float:
    """Simulate claims of one kind and size, in a worker process."""
    shapes, pairs = asked
    return calibration.claim_error(
        pairs, shapes, PLANNERS_OF_CLAIM, CELLS_OF_CLAIM, repetitions
    )


def obstacle_layouts(work: Work, *, quick: bool) -> Data:
    """Compare the methods of `dense` on random layouts."""
    count = QUICK_LAYOUTS if quick else LAYOUTS
    asked = [(n, same) for n in range(1, 5) for same in (True, False)]
    rows = work.map("layouts", partial(_layouts, count=count), asked)
    named = {
        f"{n} {'same' if same else 'different'}": found
        for (n, same), found in zip(asked, rows, strict=True)
    }
    return {
        "layouts": count,
        "in_all": count * len(asked),
        "tables": [
            _paths_table(named),
            _lattices_table(named),
        ],
    }


def _layouts(asked: tuple[int, bool], count: int) -> dict[str, list[Measured]]:
    """Measure the layouts of one row, untimed, in a worker process."""
    n, same_size = asked
    found: dict[str, list[Measured]] = {name: [] for name in METHODS}
    for seed in range(count):
        obstacles = random_layout(n, seed=seed, same_size=same_size)
        field = straight_field(obstacles, HALF_WIDTH, LENGTH)
        for name, method in METHODS.items():
            found[name].append(measured(name, method(field), math.nan))
    return found


def _paths_table(named: Mapping[str, Mapping[str, Sequence[Measured]]]) -> Data:
    """Tabulate who finds a path, and whose is better."""
    rows, total = [], np.zeros(8, dtype=int)
    for name, found in named.items():
        sides, printed, adaptive = (
            found[method] for method in (SIDES, SIDES_PRINTED, "adaptive")
        )
        better, both = share_better(
            sides, adaptive, ("length", "max_heading", "mean_l2")
        )
        cheaper, also = share_better(printed, adaptive, ("thesis_cost",))
        lost = sum(
            not one.solved and any(found[m][k].solved for m in ("uniform", "adaptive"))
            for k, one in enumerate(sides)
        )
        solved = [sum(r.solved for r in found[m]) for m in (SIDES, *LATTICES)]
        numbers = [*solved, better, both, cheaper, also, lost]
        total += numbers
        rows.append([name, *_path_cells(numbers)])
    rows.append(["all", *_path_cells([int(number) for number in total])])
    return {
        "title": "Side sequences against the lattices",
        "header": [
            "n, sizes",
            "finds a path: sides",
            *LATTICES,
            "shorter, lower heading and less offset than adaptive at once",
            "lower cost of the thesis than adaptive, printed weights",
            "only a lattice finds a path",
        ],
        "rows": rows,
    }


LATTICES: Final = ("adaptive", "uniform")


def _path_cells(numbers: Sequence[int]) -> list[str]:
    """Format the counts of one row."""
    *solved, better, both, cheaper, also, lost = numbers
    shares = (f"{better} of {both}", f"{cheaper} of {also}")
    return [*map(str, solved), *shares, str(lost)]


def _lattices_table(named: Mapping[str, Mapping[str, Sequence[Measured]]]) -> Data:
    """Tabulate the effectiveness of both lattices."""
    rows = []
    for name, found in named.items():
        better, both = share_better(
            found["adaptive"], found["uniform"], ("length", "max_heading")
        )
        shares = [[row.effectiveness for row in found[m]] for m in LATTICES]
        rows.append(
            [
                name,
                *(f"{np.median(s):.2f} / {np.mean(s):.2f}" for s in shares),
                f"{better} of {both}",
            ]
        )
    return {
        "title": "Adaptive and uniform lattice",
        "header": [
            "n, sizes",
            "edges free of collisions, median / mean: adaptive",
            "uniform",
            "adaptive shorter and with lower heading",
        ],
        "rows": rows,
    }
