"""The picture: dx0 over Vy, one panel a pair of speeds, unpreventable cells.

Grey cells are those that the careful human cannot prevent; the lines are the borders
of what the other drivers cannot prevent.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from experiments.r157.drivers import CAREFUL_HUMAN, TITLES
from experiments.r157.unpreventable import PanelResult
from experiments.report.figures import palette
from planner.states import BoolArray, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS: Final = 5
PANEL_SIZE: Final = (1.75, 1.45)  # [in]
UNPREVENTABLE: Final = "#BDBDBD"
LINES: Final[dict[str, tuple[str, Literal["-", "--", ":"]]]] = {
    "regulation_157": (palette.MOMENTS[0], "-"),
    "rss": (palette.MOMENTS[1], "--"),
    "fuzzy_safety": (palette.MOMENTS[2], ":"),
}


def draw_cut_ins(results: Sequence[PanelResult]) -> "Figure":
    """Draw the panels of cut-ins, in the given order."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(results))
    rows = -(-len(results) // columns)
    figure = Figure(
        figsize=(columns * PANEL_SIZE[0], rows * PANEL_SIZE[1] + 0.45),
        layout="constrained",
    )
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, result in zip(axes, results, strict=False):
        _draw_panel(axis, result)
    for axis in axes[len(results) :]:
        axis.set_axis_off()
    figure.supxlabel("gap at the cut-in dx0 [m]", fontsize=palette.FONT_SIZE)
    figure.supylabel("lateral speed Vy [m/s]", fontsize=palette.FONT_SIZE)
    _draw_legend(figure)
    return figure


def _draw_panel(axis: "Axes", result: PanelResult) -> None:
    """Draw one pair of speeds."""
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


def _draw_legend(figure: "Figure") -> None:
    """Name areas and lines above the panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Patch | Line2D] = [Patch(color=UNPREVENTABLE)]
    labels = [f"{TITLES[CAREFUL_HUMAN]} collides"]
    for name, (colour, style) in LINES.items():
        entries.append(Line2D([], [], color=colour, linestyle=style))
        labels.append(f"{TITLES[name]} collides inside")
    figure.legend(
        entries,
        labels,
        loc="outside upper center",
        ncols=len(labels),
        frameon=False,
        fontsize=palette.FONT_SIZE,
    )
