"""Figures of one metric of a sweep in the width of a column, with their data.

Planners keep order, colour, marker and dash in all of them; each could be told apart
by marker or dash alone.
"""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from experiments.comparison.location import Interval, mean
from experiments.comparison.results import Row, axis_columns
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.report.figures import palette
from experiments.report.figures.swept_metric import SweptMetric, label_of
from planner.states import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN = 3.5  # width of a column of a journal [in]
ROW, MARGIN = 0.22, 0.62  # of a group of means; of axis and its name [in]
SQUARE = 2.3  # height of the other figures [in]
GRID: Final = "#E4E4E4"
MARKERS: Final = "osD^vPX*"
DASHES: Final = ("-", "--", ":", "-.")
MOST_CELLS = 12  # of a heat map along one axis


class FigureKind(StrEnum):
    """What is drawn of a metric."""

    MEANS = "means"  # with intervals, by scenario and planner
    PAIRS = "pairs"  # differences from the first planner on common seeds
    ECDF = "ecdf"  # cumulative distribution
    HEAT = "heat"  # mean over two axes


@dataclass(slots=True)
class MetricFigure:
    """A figure and the numbers in it."""

    figure: "Figure"
    names: tuple[str, ...]  # of the columns of the data
    data: list[tuple[Any, ...]] = field(default_factory=list)

    def as_csv(self) -> str:
        """Write the numbers as CSV."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.names)
        writer.writerows(self.data)
        return text.getvalue()


def draw_metric(metric: SweptMetric, kind: FigureKind) -> MetricFigure:
    """Draw a metric of a sweep.

    Raises:
        ConfigError: If the sweep has not what the kind needs: two planners, an axis.
    """
    return _DRAWINGS[kind](metric)


def _means(metric: SweptMetric) -> MetricFigure:
    """Draw means or shares with intervals, by scenario and planner."""
    groups = _by_scenario(metric)
    figure = _figure(MARGIN + ROW * len(groups))
    axes = figure.subplots()
    found = MetricFigure(figure, ("scenario", "planner", "runs", "mean", "low", "high"))
    for number, ((scenario, planner), own) in enumerate(groups.items()):
        there = [row for row in own if metric.value(row) is not None]
        ends: tuple[float | str, ...] = ("", "", "")
        if there:
            mean = metric.estimate(metric.values(there))
            _draw_interval(axes, mean, number, metric.planners.index(planner))
            ends = (mean.value, *_finite(mean))
        found.data.append((scenario, planner, len(there), *ends))
    _name_rows(axes, list(groups))
    axes.set_xlabel(f"{metric.label}, 95 % interval")
    return found


def _pairs(metric: SweptMetric) -> MetricFigure:
    """Draw the difference of each pair from the first planner, mean and interval."""
    baseline, *others = metric.planners
    pairs = _paired(metric, baseline, others)
    if not pairs:
        raise ConfigError(
            f"--kind pairs: no run of another planner has a pair of {baseline}; "
            f"allowed: {', '.join(FigureKind)}"
        )
    figure = _figure(MARGIN + 0.1 + 1.6 * ROW * len(pairs))
    axes = figure.subplots()
    names = ("scenario", "planner", "baseline", "seed", "point", "difference")
    found = MetricFigure(figure, names)
    for number, ((scenario, planner), own) in enumerate(pairs.items()):
        values = np.array([value for _, _, value in own])
        style = metric.planners.index(planner)
        spread = 0.28 * np.sin(37.0 * np.arange(values.size))  # apart, the same again
        axes.plot(
            values, number + spread, ".", ms=2.5, alpha=0.5, color=_colour(style), mew=0
        )
        _draw_interval(axes, mean(values).interval, number, style)
        found.data += [
            (scenario, planner, baseline, seed, point, value)
            for seed, point, value in own
        ]
    axes.axvline(0.0, color=palette.LIMIT, lw=palette.THIN)
    _name_rows(axes, list(pairs))
    axes.set_xlabel(f"{metric.label}: minus {baseline}, 95 % interval")
    return found


def _ecdf(metric: SweptMetric) -> MetricFigure:
    """Draw cumulative distributions; runs without a value are counted in the legend."""
    figure = _figure(SQUARE)
    axes = figure.subplots()
    found = MetricFigure(figure, ("planner", "value", "share"))
    for number, planner in enumerate(metric.planners):
        values = np.sort(metric.values(metric.of(planner)))
        if values.size == 0:
            continue
        runs = sum(1 for row in metric.rows if label_of(row) == planner)
        share = np.arange(1, values.size + 1) / runs
        lacking = runs - values.size
        words = f"{planner} ({lacking} without a value)" if lacking else planner
        axes.step(
            np.concatenate((values[:1], values)),
            np.concatenate(([0.0], share)),
            where="post",
            color=_colour(number),
            ls=DASHES[number % len(DASHES)],
            lw=palette.MEDIUM,
            label=_plain(words),
        )
        found.data += [
            (planner, float(v), float(s)) for v, s in zip(values, share, strict=True)
        ]
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel(metric.label)
    axes.set_ylabel("share of runs at most")
    axes.grid(color=GRID, lw=0.4)
    axes.legend(frameon=False, fontsize=palette.FONT_SIZE - 1.0, loc="lower right")
    return found


def _heat(metric: SweptMetric) -> MetricFigure:
    """Draw the mean over two axes of the sweep: the first that vary, or planner."""
    names = [columns.SCENARIO, *axis_columns(list(metric.rows[0]))]
    varied = [n for n in names if len({str(row[n]) for row in metric.rows}) > 1]
    if not varied:
        raise ConfigError(
            "--kind heat: the sweep has no axis; allowed: "
            f"{FigureKind.MEANS}, {FigureKind.PAIRS}, {FigureKind.ECDF}"
        )
    across = varied[-1]
    down = varied[0] if len(varied) > 1 else "planner"
    cells = [(_key(row, down), _key(row, across), row) for row in metric.rows]
    x = _ordered({b for _, b, _ in cells})
    y = (
        list(metric.planners)
        if down == "planner"
        else _ordered({a for a, _, _ in cells})
    )
    if max(len(x), len(y)) > MOST_CELLS:
        raise ConfigError(
            f"--kind heat: {across} has {len(x)} values, {down} {len(y)}; allowed: "
            f"{MOST_CELLS} each; --where chooses among the runs"
        )
    figure = _figure(MARGIN + 0.28 * len(y) + 0.3)
    axes = figure.subplots()
    found = MetricFigure(figure, (down, across, "runs", "mean"))
    means = np.full((len(y), len(x)), np.nan)
    for i, a in enumerate(y):
        for j, b in enumerate(x):
            own = [
                value
                for one, other, row in cells
                if (one, other) == (a, b) and (value := metric.value(row)) is not None
            ]
            means[i, j] = np.mean(own) if own else np.nan
            found.data.append((a, b, len(own), means[i, j] if own else ""))
    _fill(axes, means, metric)
    axes.set_xticks(range(len(x)), [_short(b) for b in x])
    axes.set_yticks(range(len(y)), [_plain(_short(a)) for a in y])
    axes.set_xlabel(_plain(across))
    axes.set_title(f"mean {metric.label}", fontsize=palette.FONT_SIZE)
    axes.set_ylabel(_plain(down))
    return found


_DRAWINGS: Final[Mapping[FigureKind, Callable[[SweptMetric], MetricFigure]]] = {
    FigureKind.MEANS: _means,
    FigureKind.PAIRS: _pairs,
    FigureKind.ECDF: _ecdf,
    FigureKind.HEAT: _heat,
}


def _by_scenario(metric: SweptMetric) -> dict[tuple[str, str], list[Row]]:
    """Group the runs by scenario and planner."""
    scenarios = dict.fromkeys(str(row[columns.SCENARIO]) for row in metric.rows)
    groups: dict[tuple[str, str], list[Row]] = {
        (scenario, planner): [] for scenario in scenarios for planner in metric.planners
    }
    for row in metric.rows:
        groups[str(row[columns.SCENARIO]), label_of(row)].append(row)
    return {key: own for key, own in groups.items() if own}


def _paired(
    metric: SweptMetric, baseline: str, others: Sequence[str]
) -> dict[tuple[str, str], list[tuple[int, str, float]]]:
    """Return (seed, point, difference) of each pair, by scenario and planner."""
    axes = axis_columns(list(metric.rows[0]))

    def key(row: Row) -> tuple[str, ...]:
        return tuple(str(row[k]) for k in (columns.SCENARIO, columns.SEED, *axes))

    first = {key(row): row for row in metric.of(baseline)}
    found: dict[tuple[str, str], list[tuple[int, str, float]]] = {}
    for planner in others:
        for row in metric.of(planner):
            own, other = metric.value(row), first.get(key(row))
            base = None if other is None else metric.value(other)
            if own is None or base is None:
                continue
            point = ", ".join(f"{name} = {_short(row[name])}" for name in axes)
            pair = int(row[columns.SEED]), point, own - base
            found.setdefault((str(row[columns.SCENARIO]), planner), []).append(pair)
    order = dict.fromkeys(scenario for scenario, _ in found)
    return {
        (scenario, planner): found[scenario, planner]
        for scenario in order
        for planner in others
        if (scenario, planner) in found
    }


def _figure(height: float) -> "Figure":
    """Create a figure as wide as a column."""
    from matplotlib.figure import Figure

    return Figure(figsize=(COLUMN, height), layout="constrained")


def _draw_interval(axes: "Axes", found: Interval, y: float, style: int) -> None:
    """Draw an estimate and its interval."""
    colour = _colour(style)
    low, high = (v if np.isfinite(v) else found.value for v in (found.low, found.high))
    axes.plot([low, high], [y, y], color=colour, lw=palette.EDGE, solid_capstyle="butt")
    marker = MARKERS[style % len(MARKERS)]
    axes.plot(found.value, y, marker, ms=4.0, color=colour, mec="black", mew=0.4)


def _name_rows(axes: "Axes", groups: Sequence[tuple[str, str]]) -> None:
    """Write scenario and planner beside the rows, the first one on top."""
    several = len({scenario for scenario, _ in groups}) > 1
    names = [
        _plain(f"{scenario}, {planner}" if several else planner)
        for scenario, planner in groups
    ]
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(axis="x", color=GRID, lw=0.4)
    axes.set_axisbelow(True)


def _fill(axes: "Axes", means: FloatArray, metric: SweptMetric) -> None:
    """Fill the cells of a heat map and write the numbers into them."""
    image = axes.imshow(means, cmap="cividis", aspect="auto")
    digits = 0 if metric.rate else METRICS[metric.name].digits
    for i, j in np.ndindex(means.shape):
        if np.isnan(means[i, j]):
            continue
        red, green, blue, _ = image.cmap(image.norm(means[i, j]))
        light = 0.299 * red + 0.587 * green + 0.114 * blue > 0.46  # noqa: PLR2004
        axes.text(
            j,
            i,
            f"{means[i, j]:.{digits}f}",
            ha="center",
            va="center",
            color="black" if light else "white",
            fontsize=palette.FONT_SIZE - 1.0,
        )


def _colour(style: int) -> str:
    """Return the colour of a planner by its number."""
    return palette.MOMENTS[style % len(palette.MOMENTS)]


def _finite(interval: Interval) -> tuple[float | str, float | str]:
    """Return the ends of an interval, nothing where they are unknown."""
    low, high = (v if np.isfinite(v) else "" for v in (interval.low, interval.high))
    return low, high


def _key(row: Row, name: str) -> Any:
    """Return the place of a run on an axis."""
    return label_of(row) if name == "planner" else row[name]


def _ordered(values: set[Any]) -> list[Any]:
    """Sort numbers as numbers and all else as text."""
    if all(isinstance(value, int | float) for value in values):
        return sorted(values)
    return sorted(values, key=str)


def _short(value: Any) -> str:
    """Format a value on an axis."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _plain(text: str) -> str:
    """Keep a dollar sign from beginning a formula."""
    return text.replace("$", r"\$")
