"""How latency, noise and range of perception wear on a sweep's measures."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from experiments.comparison.robustness import AXES, MEASURES, DegradationCurve
from experiments.errors import ConfigError
from experiments.report.figures import palette
from experiments.report.figures.sweep_metric import DASHES, GRID, MARKERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN: Final = ("arrived [%]", "collided [%]", "min clearance [m]", "RMS jerk [m/s³]")
WIDTH, HEIGHT = 2.3, 1.35  # of one small plot [in]
LEGEND = 0.5  # room above the plots [in]


def draw_degradation(curves: Sequence[DegradationCurve]) -> "Figure":
    """Draw one small plot for each measure (down) and axis (across).

    Raises:
        ConfigError: If there are no curves.
    """
    if not curves:
        raise ConfigError(
            "--figure: the sweeps have no numeric axis with three values or more; "
            "allowed: a sweep such as perception"
        )
    from matplotlib.figure import Figure

    axes = list(dict.fromkeys(curve.axis for curve in curves))
    groups = list(dict.fromkeys((curve.scenario, curve.planner) for curve in curves))
    size = (WIDTH * len(axes), HEIGHT * len(SHOWN) + LEGEND)
    figure = Figure(figsize=size, layout="constrained")
    plots = figure.subplots(
        len(SHOWN), len(axes), sharex="col", sharey="row", squeeze=False
    )
    names = list(MEASURES)
    for curve in curves:
        column = axes.index(curve.axis)
        style = groups.index((curve.scenario, curve.planner))
        for line, measure in enumerate(SHOWN):
            place = names.index(measure)
            plots[line][column].plot(
                curve.values,
                [
                    float("nan") if row[place] is None else float(row[place])
                    for row in curve.measures
                ],
                MARKERS[style % len(MARKERS)],
                linestyle=DASHES[style % len(DASHES)],
                color=palette.MOMENTS[style % len(palette.MOMENTS)],
                lw=palette.MEDIUM,
                ms=3.0,
                label=f"{curve.scenario}, {curve.planner}",
            )
    for line, measure in enumerate(SHOWN):
        plots[line][0].set_ylabel(measure)
        if measure.endswith("[%]"):  # a rate of 0 or 100 in all is no scale
            low, high = plots[line][0].get_ylim()
            plots[line][0].set_ylim(
                max(-2.0, min(low, 80.0)), min(102.0, max(high, 20.0))
            )
        for plot in plots[line]:
            plot.grid(color=GRID, lw=0.4)
            plot.set_axisbelow(True)
    for column, axis in enumerate(axes):
        plots[-1][column].set_xlabel(AXES[axis])
    handles, labels = plots[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False)
    return figure
