"""The picture: one panel a pair of speeds, what cannot be prevented and a planner.

Grey cells are those that the careful human cannot prevent; the lines are the borders
of what the other drivers cannot prevent. Dots show what a planner did in each cell.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from experiments.errors import ResultsError
from experiments.evidence.r157.drivers import CAREFUL_HUMAN, TITLES
from experiments.evidence.r157.grids import ConflictKind
from experiments.evidence.r157.study import PlannerPanel
from experiments.evidence.r157.unpreventable import PanelResult
from experiments.report.figures import palette
from planner.states import BoolArray, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS: Final = 5
PANEL_SIZE: Final = (1.75, 1.45)  # [in]
SINGLE: Final = 2.6  # times as large is a panel that stands alone
NARROW: Final = 6.0  # [in]
RESOLUTION: Final = 150  # [1/in]
AXES: Final = {
    ConflictKind.CUT_IN: ("gap at the cut-in dx0 [m]", "lateral speed Vy [m/s]"),
    ConflictKind.CUT_OUT: (
        "gap from the leader to the standing vehicle dx0_f [m]",
        "lateral speed Vy [m/s]",
    ),
    ConflictKind.BRAKING: ("speed [km/h]", "deceleration of the leader [g]"),
}
DOTS: Final[dict[str, tuple[str, str, float]]] = {
    "kept its lane": (".", palette.MOMENTS[0], 1.2),
    "braked > 6 m/s²": ("v", palette.SECOND_CURVE, 1.8),
    "left its lane": ("+", palette.MOMENTS[2], 2.4),
    "collided or failed": ("x", palette.MOMENTS[1], 3.2),
}
UNPREVENTABLE: Final = "#BDBDBD"
LINES: Final[dict[str, tuple[str, Literal["-", "--", ":"]]]] = {
    "regulation_157": (palette.CURVE, "-"),
    "rss": (palette.MOMENTS[3], "--"),
    "fuzzy_safety": (palette.CURVE, ":"),
}


def draw_panels(
    results: Sequence[PanelResult], runs: Sequence[PlannerPanel] = ()
) -> "Figure":
    """Draw panels of one kind, in the given order.

    Args:
        results: Of the reference drivers.
        runs: Of one planner in the same panels; empty without one.
    """
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(results))
    rows = -(-len(results) // columns)
    scale = 1.0 if columns > 1 else SINGLE
    figure = Figure(
        figsize=(columns * PANEL_SIZE[0] * scale, rows * PANEL_SIZE[1] * scale + 0.6),
        layout="constrained",
    )
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for k, (axis, result) in enumerate(zip(axes, results, strict=False)):
        _draw_panel(axis, result)
        if runs:
            _draw_dots(axis, runs[k])
    for axis in axes[len(results) :]:
        axis.set_axis_off()
    x, y = AXES[results[0].panel.kind]
    figure.supxlabel(x, fontsize=palette.FONT_SIZE)
    figure.supylabel(y, fontsize=palette.FONT_SIZE)
    _draw_legend(figure, results[0], runs[0].planner if runs else None)
    return figure


def save_panels(figure: "Figure", file: Path) -> None:
    """Save a picture; the same data give the same bytes.

    Raises:
        ResultsError: If the disk refuses.
    """
    from matplotlib import rc_context

    aside = file.with_name(f".{os.getpid()}.{file.name}")
    try:
        with rc_context(palette.STYLE):
            figure.savefig(aside, dpi=RESOLUTION, metadata={"Software": None})
        aside.replace(file)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise ResultsError(f"{file}: cannot be written: {error.strerror}") from error


def _draw_panel(axis: "Axes", result: PanelResult) -> None:
    """Draw what the reference drivers cannot prevent in one panel."""
    from matplotlib.colors import ListedColormap

    panel = result.panel
    x, y = _edges(panel.x), _edges(panel.y)
    human = result.collided[CAREFUL_HUMAN]
    shown = np.where(human.T, 1.0, np.nan)
    axis.pcolormesh(x, y, shown, cmap=ListedColormap([UNPREVENTABLE]), vmin=0, vmax=1)
    for name, (colour, style) in LINES.items():
        if name in result.collided and result.collided[name].any():
            for line in _borders(result.collided[name], x, y):
                axis.plot(*line, color=colour, linestyle=style, linewidth=palette.EDGE)
    axis.set_xlim(x[0], x[-1])
    axis.set_ylim(y[0], y[-1])
    axis.set_title(panel.title, fontsize=palette.FONT_SIZE)
    axis.tick_params(labelsize=palette.FONT_SIZE - 1.0)


def _draw_dots(axis: "Axes", run: PlannerPanel) -> None:
    """Draw what a planner did in each cell; it may both leave its lane and brake."""
    hit = run.collided | run.failed
    left = run.left_lane & ~hit
    hard = run.braked_hard & ~hit
    shown = {
        "kept its lane": ~(hit | left | hard),
        "braked > 6 m/s²": hard,
        "left its lane": left,
        "collided or failed": hit,
    }
    for name, cells in shown.items():
        marker, colour, size = DOTS[name]
        at = np.argwhere(cells)
        axis.plot(
            run.panel.x[at[:, 0]],
            run.panel.y[at[:, 1]],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=size,
            markeredgewidth=0.6,
        )


def _edges(centres: FloatArray) -> FloatArray:
    """Return the borders of equally wide cells around `centres`."""
    half = 0.5 * (centres[1] - centres[0])
    return np.append(centres - half, centres[-1] + half)


def _borders(
    inside: BoolArray, x: FloatArray, y: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Return the border between cells inside and outside, along the cells' edges.

    Two polylines: edges that run along x and edges that run along y, nan between them.
    """
    padded = np.pad(inside, 1)
    across = np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])  # (x edge, y cell)
    along = np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])  # (x cell, y edge)
    gap = np.full(len(across), np.nan)
    upright = (
        np.column_stack([x[across[:, 0]], x[across[:, 0]], gap]).ravel(),
        np.column_stack([y[across[:, 1]], y[across[:, 1] + 1], gap]).ravel(),
    )
    gap = np.full(len(along), np.nan)
    level = (
        np.column_stack([x[along[:, 0]], x[along[:, 0] + 1], gap]).ravel(),
        np.column_stack([y[along[:, 1]], y[along[:, 1]], gap]).ravel(),
    )
    return [upright, level]


def _draw_legend(figure: "Figure", result: PanelResult, planner: str | None) -> None:
    """Name areas, lines and dots above the panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Patch | Line2D] = [Patch(color=UNPREVENTABLE)]
    labels = [f"{TITLES[CAREFUL_HUMAN]} collides"]
    for name, (colour, style) in LINES.items():
        if name in result.collided:
            entries.append(Line2D([], [], color=colour, linestyle=style))
            labels.append(f"{TITLES[name]} collides inside")
    for name, (marker, colour, size) in DOTS.items() if planner else ():
        dot = Line2D([], [], ls="none", marker=marker, color=colour, ms=size + 1.0)
        entries.append(dot)
        labels.append(f"{planner}: {name}")
    figure.legend(
        entries,
        labels,
        loc="outside upper center",
        ncols=4 if figure.get_figwidth() > NARROW else 2,
        frameon=False,
        fontsize=palette.FONT_SIZE,
    )
