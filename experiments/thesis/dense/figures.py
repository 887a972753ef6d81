"""Figures 5.1, 5.5 and 5.7 to 5.10."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from experiments.thesis.claims import (
    Picture,
    Series,
    shown,
)
from experiments.thesis.dense.layouts import (
    DIFFERENT_SIZES,
    HALF_WIDTH,
    LENGTH,
    SAME_SIZE,
)
from experiments.thesis.dense.methods import (
    COVER,
    SIDES,
    START,
    Measured,
)
from experiments.thesis.dense.study import (
    FEWER,
    MORE,
    Studied,
    lattice_with,
)
from experiments.thesis.dense.tables import COUNTS, Groups
from planner.dense.field import straight_field
from planner.dense.frenet_path import FrenetPath
from planner.dense.lattice.waypoints import adaptive_waypoints
from planner.dense.settings import LatticeSettings

PICKED = {"5.3": SAME_SIZE, "5.5": DIFFERENT_SIZES}


FIGURES = {"5.3": "5.9", "5.5": "5.10"}


def sampling_pictures(groups: Groups) -> Iterable[Picture]:
    """Build Figures 5.7 and 5.8: medians of random layouts of one size."""
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


def waypoints_picture() -> Picture:
    """Build Figure 5.5: where the adaptive method samples, on a picked layout."""
    field = straight_field(DIFFERENT_SIZES.array(), HALF_WIDTH, LENGTH)
    settings = LatticeSettings()
    spread = adaptive_waypoints(field, COVER, START[:2], LENGTH, settings)
    points = tuple(
        (shown(float(s)), shown(float(l)))
        for s, row, n in zip(spread.s, spread.l, spread.count.tolist(), strict=True)
        for l in row[:n]
    )
    title = "Fig. 5.5, picked layout: waypoints of the adaptive method"
    discs = DIFFERENT_SIZES.obstacles
    return Picture("fig_5.5", title, "s m", "l m", (), discs, points)


def path_pictures(
    picked: Mapping[str, Mapping[str, tuple[Measured, FrenetPath | None]]],
) -> Iterable[Picture]:
    """Build Figures 5.9 and 5.10 with the side sequences as a third line."""
    for table, methods in picked.items():
        lines = {
            name: path
            for name, (_, path) in methods.items()
            if path is not None and name in ("uniform", "adaptive", SIDES)
        }
        title = f"Fig. {FIGURES[table]}, picked layout: optimal paths"
        yield drawn(f"fig_{FIGURES[table]}", title, lines, PICKED[table].obstacles)


def example_picture(groups: Groups) -> Iterable[Picture]:
    """Build Figure 5.1 on the first random layout whose sides change."""
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
            yield drawn("fig_5.1", title, there, discs)
            return


def drawn(
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
