"""Chapter 5 recomputed: Figures 5.1 and 5.7-5.10, Tables 5.2, 5.3 and 5.5."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import product

import numpy as np

from experiments.thesis.claims import (
    Chapter,
    Number,
    Picture,
    ResultTable,
    Series,
    shown,
)
from experiments.thesis.dense import (
    COST_ROUNDING,
    METHODS,
    PRINTED,
    REPETITIONS,
    SIDES,
    SIDES_PRINTED,
    Measured,
    measured,
    timed,
)
from experiments.thesis.dense_claims import (
    comparison_claims,
    effectiveness_claims,
    sampling_claims,
    sensitivity_claims,
    time_claims,
)
from experiments.thesis.dense_layouts import (
    DIFFERENT_SIZES,
    HALF_WIDTH,
    LENGTH,
    SAME_SIZE,
)
from experiments.thesis.dense_layouts import Layout as PickedLayout
from experiments.thesis.dense_study import (
    FEWER,
    MORE,
    Layout,
    Studied,
    lattice_with,
    study,
)
from experiments.thesis.effort import Effort, Work
from planner.dense.field import straight_field
from planner.dense.path import FrenetPath

COUNTS = (1, 2, 3, 4)  # of obstacles
PICKED = {"5.3": SAME_SIZE, "5.5": DIFFERENT_SIZES}
FIGURES = {"5.3": "5.9", "5.5": "5.10"}
Groups = Mapping[tuple[int, bool], Sequence[Studied]]


def dense_chapter(effort: Effort, work: Work) -> Chapter:
    """Recompute chapter 5."""
    groups = _groups(effort, work)
    picked = {table: _picked(layout) for table, layout in PICKED.items()}
    rows = {t: {name: row for name, (row, _) in p.items()} for t, p in picked.items()}
    return Chapter(
        "dense",
        5,
        "Dense obstacles",
        {"random layouts for each number of obstacles": 2 * effort.dense_layouts},
        (
            *sensitivity_claims(groups),
            *sampling_claims(groups),
            *effectiveness_claims(groups),
            *comparison_claims(rows, groups),
        ),
        (
            *(_picked_table(table, row) for table, row in rows.items()),
            _sampling_table(groups),
            _paths_table(groups),
        ),
        (_sides_table(groups),),
        time_claims(rows),
        (_time_table(rows, groups),),
        pictures=(*_sampling_pictures(groups), *_paths(picked), *_example(groups)),
    )


def _groups(effort: Effort, work: Work) -> Groups:
    """Study the random layouts, by number and kind."""
    groups = {}
    for same, n in product((True, False), COUNTS):
        kind = "one size" if same else "different sizes"
        layouts = [Layout(n, seed, same) for seed in range(effort.dense_layouts)]
        groups[n, same] = work.map(f"{n} obstacles, {kind}", study, layouts)
    return groups


def _picked(layout: PickedLayout) -> dict[str, tuple[Measured, FrenetPath | None]]:
    """Run all methods on a picked layout."""
    field = straight_field(layout.array(), HALF_WIDTH, LENGTH)
    found = {}
    for name, method in {**METHODS, **PRINTED}.items():
        result, took = timed(method, field, REPETITIONS)
        found[name] = measured(name, result, took), result.path
    return found


def _picked_table(table: str, rows: Mapping[str, Measured]) -> ResultTable:
    """Lay out Table 5.3 or 5.5 with all methods."""
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


def _sampling_table(groups: Groups) -> ResultTable:
    """Lay out Table 5.2 over random layouts."""
    rows = []
    for (n, same), group in groups.items():
        for name in ("uniform", "adaptive"):
            found = [one.methods[name] for one in group]
            effect = [100.0 * one.effectiveness for one in found]
            rows.append(
                (
                    n,
                    _kind(same),
                    name,
                    _median(one.waypoints[name] for one in group),
                    _median(one.edges for one in found),
                    _median(one.collision_edges for one in found),
                    _median(effect),
                    _mean(effect),
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


def _paths_table(groups: Groups) -> ResultTable:
    """Lay out the paths on the random layouts that all methods solve."""
    rows = []
    for (n, same), group in groups.items():
        common = [g for g in group if all(row.solved for row in g.methods.values())]
        for name in METHODS:
            found = [g.methods[name] for g in common]
            cells = [
                _median(getattr(row, field) for row in found)
                for field in ("length", "max_heading", "mean_l2", "thesis_cost")
            ]
            solved = sum(g.methods[name].solved for g in group)
            rows.append((n, _kind(same), name, len(group), solved, *cells))
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


def _sides_table(groups: Groups) -> ResultTable:
    """Say what the side sequences hold of the 100 % that 7.1.1 asks for."""
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
                _kind(same),
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
        "Every program that is solved gives a path that is free of collisions, so "
        "nothing is thrown away; the clearance is measured on each path apart from "
        "the planner. Nothing is sampled, so there is no number to be sensitive to.",
    )


def _time_table(
    picked: Mapping[str, Mapping[str, Measured]], groups: Groups
) -> ResultTable:
    """Lay out run times."""
    rows: list[tuple[str | Number, ...]] = [
        (f"picked, Table {table}", name, shown(row.run_time))
        for table, methods in picked.items()
        for name, row in methods.items()
    ]
    for name in METHODS:
        times = [one.methods[name].run_time for one in groups[COUNTS[-1], False]]
        words = f"{COUNTS[-1]} obstacles, different sizes, median of random layouts"
        rows.append((words, name, _median(times)))
    return ResultTable(
        "dense_times", "Run time of chapter 5", ("layout", "method", "ms"), tuple(rows)
    )


def _sampling_pictures(groups: Groups) -> Iterable[Picture]:
    """Make Figures 5.7 and 5.8: medians of random layouts of one size."""
    measures: dict[str, tuple[str, Callable[[Studied, str], float]]] = {
        "5.7": ("waypoints", lambda one, name: one.waypoints[name]),
        "5.8": ("paths", lambda one, name: one.methods[name].edges),
    }
    for figure, (words, measure) in measures.items():
        series = []
        for name in ("uniform", "adaptive"):
            y = [
                float(np.median([measure(one, name) for one in groups[n, True]]))
                for n in COUNTS
            ]
            series.append(Series(name, tuple(map(float, COUNTS)), tuple(y)))
        title = f"Fig. {figure}: {words}, medians of random layouts"
        yield Picture(f"fig_{figure}", title, "obstacles", words, tuple(series))


def _paths(
    picked: Mapping[str, Mapping[str, tuple[Measured, FrenetPath | None]]],
) -> Iterable[Picture]:
    """Make Figures 5.9 and 5.10 with the side sequences as a third line."""
    for table, methods in picked.items():
        lines = {
            name: path
            for name, (_, path) in methods.items()
            if path is not None and name in ("uniform", "adaptive", SIDES)
        }
        title = f"Fig. {FIGURES[table]}, picked layout: optimal paths"
        yield _drawn(f"fig_{FIGURES[table]}", title, lines, PICKED[table].obstacles)


def _example(groups: Groups) -> Iterable[Picture]:
    """Make Figure 5.1 on the first random layout whose sides change."""
    for one in groups[COUNTS[-1], True]:
        if one.changed["uniform"]:
            obstacles = one.layout.obstacles()
            field = straight_field(obstacles, HALF_WIDTH, LENGTH)
            paths = {
                f"{points} waypoints a layer": lattice_with("uniform", points)(
                    field
                ).path
                for points in (FEWER, MORE)
            }
            there = {name: path for name, path in paths.items() if path is not None}
            title = f"Fig. 5.1, random layout {one.layout.seed}: uniform sampling"
            discs = tuple((float(s), float(l), float(r)) for s, l, r in obstacles)
            yield _drawn("fig_5.1", title, there, discs)
            return


def _drawn(
    name: str,
    title: str,
    paths: Mapping[str, FrenetPath],
    discs: tuple[tuple[float, float, float], ...],
) -> Picture:
    """Draw paths among obstacles."""
    series = tuple(
        Series(
            words,
            tuple(map(shown, path.s.tolist())),
            tuple(map(shown, path.l.tolist())),
        )
        for words, path in paths.items()
    )
    return Picture(name, title, "s m", "l m", series, discs)


def _kind(same: bool) -> str:  # noqa: FBT001 - a key of the groups
    """Name the kind of a group."""
    return "one size" if same else "different"


def _median(values: Iterable[float]) -> Number | str:
    """Median, a dash of nothing."""
    found = list(values)
    return shown(float(np.median(found))) if found else "-"


def _mean(values: Sequence[float]) -> Number:
    """Mean."""
    return shown(float(np.mean(values)))
