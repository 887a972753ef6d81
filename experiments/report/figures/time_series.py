"""The curves below the top view: speed, acceleration, offset, clearance."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from experiments.report.figures import palette
from experiments.report.run_reader import RunRecord, numbers
from planner.interface import PlanStatus
from planner.states import BoolArray, FloatArray

MAX_SHOWN_CLEARANCE = 15.0  # farther bodies do not matter to the ego [m]


def draw_over_time(panels: Sequence[Axes], run: RunRecord) -> None:
    """Draw the four curves, each into its own axes.

    Args:
        panels: Four axes.
        run: What.
    """
    draw: tuple[Callable[[Axes, RunRecord], None], ...] = (
        _speed,
        _acceleration,
        _offset,
        _clearance,
    )
    for axes, panel in zip(panels, draw, strict=True):
        _shade_waiting(axes, run)
        panel(axes, run)
        for step, colour in zip(run.moments, palette.MOMENTS, strict=False):
            axes.axvline(run.time[step], color=colour, lw=palette.MEDIUM, zorder=1)
        axes.set_xlim(0.0, max(float(run.time[-1]), 1e-3))
        axes.grid(visible=True, color="#E4E4E4", lw=0.4)
        axes.set_axisbelow(True)


def _speed(axes: Axes, run: RunRecord) -> None:
    """Draw speed, target speed, and the cycles without a fresh plan."""
    speed = numbers(run.trace.steps["speed_mps"])
    target = run.trace.fact("target_speed_mps")
    axes.axhline(target, color=palette.LIMIT, lw=palette.THIN, ls="--")
    _curve(axes, run, speed)
    late = fallback_steps(run)
    axes.plot(
        run.time[late],
        np.zeros(int(late.sum())),
        ls="none",
        marker="^",
        ms=4.0,
        color=palette.CURVE,
        clip_on=False,
        zorder=4,
    )
    axes.set_ylim(0.0, 1.12 * max(float(speed.max()), target))
    axes.set_ylabel("speed [m/s]")


def fallback_steps(run: RunRecord) -> BoolArray:
    """Mark the steps without a fresh plan."""
    status = run.trace.steps["plan_status"]
    planned = ~np.ma.getmaskarray(status)
    fresh = np.ma.getdata(status) == str(PlanStatus.OK)
    return np.asarray(planned & ~fresh)


def _acceleration(axes: Axes, run: RunRecord) -> None:
    """Draw the tangential and the lateral acceleration."""
    steps = run.trace.steps
    lateral = numbers(steps["curvature_1pm"]) * numbers(steps["speed_mps"]) ** 2
    _curve(axes, run, lateral, palette.SECOND_CURVE, "lateral")
    _curve(axes, run, numbers(steps["acceleration_mps2"]), label="along the way")
    axes.set_ylabel("acceleration [m/s²]")
    axes.legend(
        loc="lower right", frameon=True, framealpha=0.8, edgecolor="none", ncols=2
    )
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.25 * (high - low), high)


def _offset(axes: Axes, run: RunRecord) -> None:
    """Draw the lateral offset between the edges of the road."""
    steps, road = run.trace.steps, run.trace.road
    s = numbers(steps["s_m"])
    for key in ("left_m", "right_m"):
        edge = np.interp(s, numbers(road["s_m"]), numbers(road[key]))
        _curve(axes, run, edge, palette.ROAD_EDGE, width=palette.MEDIUM)
    axes.axhline(0.0, color=palette.REFERENCE, lw=palette.THIN, ls=":")
    _curve(axes, run, numbers(steps["l_m"]))
    axes.set_ylabel("lateral offset [m]")


def _clearance(axes: Axes, run: RunRecord) -> None:
    """Draw the distance to the nearest body."""
    clearance = numbers(run.trace.steps["clearance_m"])
    _curve(axes, run, clearance)
    top = MAX_SHOWN_CLEARANCE
    if np.isfinite(clearance).any():
        _mark_least(axes, run, clearance)
        top = min(max(float(np.nanmax(clearance)), 1.0), MAX_SHOWN_CLEARANCE)
    axes.set_ylim(0.0, 1.05 * top)
    axes.set_ylabel("clearance [m]")


def _mark_least(axes: Axes, run: RunRecord, values: FloatArray) -> None:
    """Mark the minimum and label it inside the panel."""
    step = int(np.nanargmin(values))
    time = run.time[step]
    late = time > run.time[-1] / 2.0
    axes.plot(time, values[step], "o", ms=3.0, color=palette.CURVE, zorder=5)
    axes.annotate(
        f"{values[step]:.2f} m",
        (time, values[step]),
        xytext=(-5.0 if late else 5.0, 2.0),
        textcoords="offset points",
        ha="right" if late else "left",
        zorder=5,
        bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 0.6},
    )


def _curve(
    axes: Axes,
    run: RunRecord,
    values: FloatArray,
    colour: str = palette.CURVE,
    label: str | None = None,
    width: float = 1.2,
) -> None:
    """Draw one value over time."""
    axes.plot(run.time, values, color=colour, lw=width, label=label, zorder=3)


def waiting_steps(run: RunRecord) -> BoolArray:
    """Mark the steps in which a stop line ahead was closed."""
    return np.isfinite(numbers(run.trace.steps["stop_line_m"]))


def _shade_waiting(axes: Axes, run: RunRecord) -> None:
    """Shade the time in which a stop line is closed."""
    closed = waiting_steps(run)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], closed, [0]))))
    for begin, end in edges.reshape(-1, 2):
        last = run.time[min(end, run.time.size - 1)]
        axes.axvspan(run.time[begin], last, color=palette.WAITING, lw=0.0, zorder=0)
