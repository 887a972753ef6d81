"""The picture of a sweep: `rearview figure SWEEP`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.comparison.inference import wilson
from experiments.comparison.results import LABEL, Row, rows
from experiments.errors import ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.report.figures import palette
from experiments.report.figures.page_layout import WIDTH
from planner.states import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = (
    columns.TRAVEL_TIME,
    columns.MIN_CLEARANCE,
    columns.RMS_JERK,
    columns.REAR_MAX_DECELERATION,
    columns.PLANNING_CPU_P99,
)
ROW = 0.17  # of a group in a panel [in]
MOST_GROUPS = 16  # with more, scenarios are merged

Groups = dict[str, list[Row]]


def draw_sweep(folder: Path) -> "Figure":
    """Draw the outcome and the usual metrics of a sweep, by scenario and planner.

    Args:
        folder: Of the sweep.

    Returns:
        Shares that arrived with Wilson's intervals, and a box plot for each metric:
        quartiles, median, whiskers over all runs.

    Raises:
        ResultsError: If there are no runs.
    """
    from matplotlib.figure import Figure

    found = rows(folder)
    if not found:
        raise ResultsError(f"{folder}: holds no runs yet")
    groups = _groups(found)
    shown = [name for name in SHOWN if any(row.get(name) is not None for row in found)]
    n_rows = (len(shown) + 2) // 2
    height = n_rows * (ROW * len(groups) + 0.62) + 0.1
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    panels = figure.subplots(n_rows, 2, sharey=True, squeeze=False).ravel()
    _draw_rates(panels[0], groups)
    for axes, metric in zip(panels[1:], shown, strict=False):
        _draw_boxes(axes, metric, groups)
    for axes in panels[len(shown) + 1 :]:
        axes.set_visible(False)
    panels[0].set_yticks(range(len(groups)), list(groups), parse_math=False)
    panels[0].set_ylim(len(groups) - 0.5, -0.5)
    return figure


def _groups(found: Sequence[Row]) -> Groups:
    """Sort the runs by scenario and planner, in the order of the results."""
    pairs = {(row[columns.SCENARIO], _label(row)) for row in found}
    scenarios = {scenario for scenario, _ in pairs}
    several = len(scenarios) > 1 and len(pairs) <= MOST_GROUPS
    groups: Groups = {}
    for row in found:
        label = _label(row)
        name = f"{row[columns.SCENARIO]} · {label}" if several else label
        groups.setdefault(name, []).append(row)
    return groups


def _label(row: Row) -> str:
    """Return the label of the planner of a row."""
    return str(row[LABEL] or row[columns.PLANNER])


def _draw_rates(axes: "Axes", groups: Groups) -> None:
    """Draw the share of runs that arrived."""
    for number, own in enumerate(groups.values()):
        rate = wilson(sum(bool(row[columns.ARRIVED]) for row in own), len(own))
        value, low, high = (100.0 * end for end in (rate.value, rate.low, rate.high))
        colour = _colours(groups)[number]
        axes.plot([low, high], [number, number], color=colour, lw=palette.EDGE)
        axes.plot(value, number, "o", ms=4.0, color=colour)
    axes.set_xlabel("arrived [%], 95 % interval")
    axes.grid(axis="x", color="#E4E4E4", lw=0.4)


def _draw_boxes(axes: "Axes", metric: str, groups: Groups) -> None:
    """Draw the distribution of one metric."""
    for number, own in enumerate(groups.values()):
        values = _values(own, metric)
        if values.size == 0:
            continue
        parts = axes.boxplot(
            values,
            positions=[number],
            widths=0.6,
            orientation="horizontal",
            whis=(0.0, 100.0),
            manage_ticks=False,
            medianprops={"color": "black", "lw": palette.EDGE},
            boxprops={"lw": palette.THIN},
            whiskerprops={"lw": palette.THIN},
            capprops={"lw": palette.THIN},
            patch_artist=True,
        )
        parts["boxes"][0].set_facecolor(_colours(groups)[number])
    axes.set_xlabel(METRICS[metric].label_with_unit)
    axes.grid(axis="x", color="#E4E4E4", lw=0.4)
    axes.set_axisbelow(True)


def _values(own: Sequence[Row], metric: str) -> FloatArray:
    """Collect a metric where it applies."""
    return np.array(
        [row[metric] for row in own if row.get(metric) is not None], dtype=np.float64
    )


def _colours(groups: Groups) -> list[str]:
    """Assign a colour to each planner, in addition to the names beside the rows."""
    labels = [_label(own[0]) for own in groups.values()]
    order = list(dict.fromkeys(labels))
    return [palette.MOMENTS[order.index(one) % len(palette.MOMENTS)] for one in labels]
