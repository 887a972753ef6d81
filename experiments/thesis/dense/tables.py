"""The tables of chapter 5."""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from experiments.thesis.claims import (
    Number,
    ResultTable,
    shown,
)
from experiments.thesis.dense.methods import (
    COST_ROUNDING,
    METHODS,
    SIDES,
    SIDES_PRINTED,
    Measured,
)
from experiments.thesis.dense.study import (
    Studied,
)

TO_MM = 1e3  # from metres
COUNTS = (1, 2, 3, 4)  # of obstacles


Groups = Mapping[tuple[int, bool], Sequence[Studied]]


def picked_table(table: str, rows: Mapping[str, Measured]) -> ResultTable:
    """Tabulate Table 5.3 or 5.5 with all methods."""
    return ResultTable(
        f"table_{table}_measured",
        f"Table {table} on the picked layout",
        (
            "method",
            "length m",
            "largest heading rad",
            "largest curvature 1/m",
            "mean l² m²",
            "cost of eq. 5.27",
            "paths",
            "collision paths",
        ),
        tuple(
            (
                name,
                *map(shown, (row.length, row.max_heading, row.max_curvature)),
                shown(row.mean_l2),
                shown(row.thesis_cost),
                row.edges,
                row.collision_edges,
            )
            for name, row in rows.items()
        ),
        "Sides: the side sequences of this project, which have no paths to throw away. "
        "The cost is that of the thesis without its first term.",
    )


def sampling_table(groups: Groups) -> ResultTable:
    """Tabulate Table 5.2 over random layouts."""
    rows = []
    for (n, same), group in groups.items():
        for name in ("uniform", "adaptive"):
            found = [one.methods[name] for one in group]
            effect = [100.0 * one.effectiveness for one in found]
            rows.append(
                (
                    n,
                    kind(same),
                    name,
                    median(one.waypoints[name] for one in group),
                    median(one.edges for one in found),
                    median(one.collision_edges for one in found),
                    median(effect),
                    mean(effect),
                )
            )
    return ResultTable(
        "table_5_2_measured",
        "Table 5.2 and Figures 5.7, 5.8 on random layouts",
        (
            "obstacles",
            "sizes",
            "method",
            "waypoints, median",
            "paths, median",
            "collision paths, median",
            "effectiveness %, median",
            "effectiveness %, mean",
        ),
        tuple(rows),
    )


def paths_table(groups: Groups) -> ResultTable:
    """Tabulate the paths on the random layouts that all methods solve."""
    rows = []
    for (n, same), group in groups.items():
        common = [g for g in group if all(row.solved for row in g.methods.values())]
        for name in METHODS:
            found = [g.methods[name] for g in common]
            cells = [
                median(getattr(row, field) for row in found)
                for field in ("length", "max_heading", "mean_l2", "thesis_cost")
            ]
            solved = sum(g.methods[name].solved for g in group)
            rows.append((n, kind(same), name, len(group), solved, *cells))
    return ResultTable(
        "dense_paths",
        "Paths on random layouts, medians where all methods have one",
        (
            "obstacles",
            "sizes",
            "method",
            "layouts",
            "solved",
            "length m",
            "largest heading rad",
            "mean l² m²",
            "cost of eq. 5.27",
        ),
        tuple(rows),
    )


def sides_table(groups: Groups) -> ResultTable:
    """Compare the side sequences with the 100 % that 7.1.1 asks for."""
    rows = []
    for (n, same), group in groups.items():
        methods = [one.methods for one in group]
        solved = [m[SIDES].solved for m in methods]
        lattice = [m["uniform"].solved or m["adaptive"].solved for m in methods]
        both = [m for m in methods if m[SIDES].solved and m["adaptive"].solved]
        columns = ("length", "max_heading", "mean_l2")
        better = sum(
            all(getattr(m[SIDES], c) < getattr(m["adaptive"], c) for c in columns)
            for m in both
        )
        priced = [
            m for m in methods if m[SIDES_PRINTED].solved and m["adaptive"].solved
        ]
        cheaper = sum(
            m[SIDES_PRINTED].thesis_cost
            <= m["adaptive"].thesis_cost * (1.0 + COST_ROUNDING)
            for m in priced
        )
        least = min(g.clearance for g in group if not math.isnan(g.clearance))
        rows.append(
            (
                n,
                kind(same),
                len(group),
                sum(m["uniform"].solved for m in methods),
                sum(m["adaptive"].solved for m in methods),
                sum(solved),
                sum(b and not a for a, b in zip(solved, lattice, strict=True)),
                shown(round(least, 6) + 0.0),
                f"{cheaper} of {len(priced)}",
                f"{better} of {len(both)}",
            )
        )
    return ResultTable(
        "beyond_sides",
        "Effectiveness of 100 % by side sequences (chapter 5)",
        (
            "obstacles",
            "sizes",
            "layouts",
            "solved, uniform",
            "solved, adaptive",
            "solved, sides",
            "solved by a lattice only",
            "least clearance of sides m",
            "no dearer than adaptive, printed weights",
            "shorter, lower heading, less offset at once",
        ),
        tuple(rows),
        "Every program that is solved gives a path, so nothing is thrown away, and "
        "nothing is sampled, so there is no number to be sensitive to. The clearance "
        "is measured on each path apart from the planner, at finer points; "
        f"{_negative(groups)}.",
    )


def _negative(groups: Groups) -> str:
    """Count the paths whose discs overlap between the planner's points."""
    clearances = [
        one.clearance
        for group in groups.values()
        for one in group
        if not math.isnan(one.clearance)
    ]
    below = [c for c in clearances if c < 0.0]
    if not below:
        return f"it is nowhere negative in {len(clearances)} paths"
    worst = shown(-TO_MM * min(below))
    return (
        f"it is negative in {len(below)} of {len(clearances)} paths, by {worst} mm at "
        "most"
    )


def time_table(
    picked: Mapping[str, Mapping[str, Measured]], groups: Groups
) -> ResultTable:
    """Tabulate run times."""
    rows: list[tuple[str | Number, ...]] = [
        (f"picked, Table {table}", name, shown(row.run_time))
        for table, methods in picked.items()
        for name, row in methods.items()
    ]
    for name in METHODS:
        times = [one.methods[name].run_time for one in groups[COUNTS[-1], False]]
        words = f"{COUNTS[-1]} obstacles, different sizes, median of random layouts"
        rows.append((words, name, median(times)))
    return ResultTable(
        "dense_times", "Run time of chapter 5", ("layout", "method", "ms"), tuple(rows)
    )


def kind(same: bool) -> str:  # noqa: FBT001 - a key of the groups
    """Describe the kind of a group."""
    return "one size" if same else "different"


def median(values: Iterable[float]) -> Number | str:
    """Return the median, or a dash without values."""
    found = list(values)
    return shown(float(np.median(found))) if found else "-"


def mean(values: Sequence[float]) -> Number:
    """Mean."""
    return shown(float(np.mean(values)))
