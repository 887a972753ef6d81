"""Pictures of the page, drawn by matplotlib: lines and discs over labelled axes."""

import base64
import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from experiments.report.figures import palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Data = Mapping[str, Any]
SIZE = (4.6, 2.7)  # [in]
COLOURS = (*palette.MOMENTS, palette.SECOND_CURVE, palette.LIMIT)
DASHES = ("-", "--", ":", "-.")
_NO_DATE = {"Date": None, "Creator": None}


def svg(picture: Data) -> str:
    """Draw a picture as SVG; the same data give the same text."""
    from matplotlib import rc_context  # takes half a second to load
    from matplotlib.figure import Figure

    with rc_context(palette.STYLE):
        figure = Figure(figsize=SIZE, layout="constrained")
        axes = figure.subplots()
        _draw(axes, picture)
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata=_NO_DATE)
    return file.getvalue()


def data_uri(picture: Data) -> str:
    """Draw a picture for the `src` of an image."""
    encoded = base64.b64encode(svg(picture).encode()).decode("ascii")
    return f"data:image/svg+xml;base64,{encoded}"


def _draw(axes: "Axes", picture: Data) -> None:
    """Draw discs, points and lines with their legend."""
    from matplotlib.patches import Circle

    for s, l, radius in picture["discs"]:
        axes.add_patch(Circle((s, l), radius, color=palette.OBSTACLE, alpha=0.45, lw=0))
    for x, y in picture["points"]:
        axes.plot(x, y, ".", color=palette.CURVE, markersize=3.0)
    for k, line in enumerate(picture["series"]):
        axes.plot(
            line["x"],
            line["y"],
            DASHES[k % len(DASHES)],
            color=COLOURS[k % len(COLOURS)],
            linewidth=palette.EDGE,
            label=line["name"],
        )
    axes.autoscale_view()
    axes.grid(color=palette.KERB, linewidth=0.3)
    axes.set_xlabel(picture["x"], parse_math=False)
    axes.set_ylabel(picture["y"], parse_math=False)
    if len(picture["series"]) > 1:
        axes.legend(frameon=False)
