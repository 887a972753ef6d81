"""The s-T picture of the cases: regions, plan, and its speed, acceleration, jerk."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from experiments.report.figures import palette
from experiments.thesis.lane_change.published_cases import EGO, PATH_LENGTH, SpeedCase
from planner.lane_change.speed.program import knot_times

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN_LENGTH = 160.0  # of the s axis [m]
REGION_A, REGION_B = palette.MOMENTS[0], palette.MOMENTS[2]


def save_cases(cases: Sequence[SpeedCase], file: Path) -> None:
    """Draw the cases side by side.

    Args:
        cases: In columns, from the left.
        file: Its suffix says the format.
    """
    with rc_context(palette.STYLE):
        figure = Figure(figsize=(3.5 * len(cases), 6.4), layout="constrained")
        axes = figure.subplots(
            4, len(cases), sharex=True, squeeze=False, height_ratios=(3, 1, 1, 1)
        )
        for number, (case, column) in enumerate(zip(cases, axes.T, strict=True), 1):
            draw_graph(column[0], case)
            column[0].set_title(
                f"case {number}: v$_0$ = {case.start_speed:g} m/s, region {case.region}"
            )
            draw_courses(column[1:], case)
            column[-1].set_xlabel("t [s]")
        metadata = {"Date": None} if file.suffix == ".svg" else None
        figure.savefig(file, metadata=metadata, dpi=200)


def draw_graph(axes: "Axes", case: SpeedCase) -> None:
    """Draw the s-T graph: the car, both regions as solved and as printed, the plan."""
    times = knot_times(case.settings)
    graph, profile = case.plan.graph, case.plan.profile
    on, low, high = graph.hit[0], graph.lower[0], graph.upper[0]
    least, greatest = extremes(case)
    bottom = np.maximum(least, np.where(on, high, least))
    top = np.minimum(greatest, np.where(on, low, greatest))
    for edge, other, colour, name in (
        (np.minimum(greatest, PATH_LENGTH), bottom, REGION_A, "A: ahead of the car"),
        (top, least, REGION_B, "B: behind the car"),
    ):
        axes.fill_between(
            times,
            other,
            edge,
            where=(edge >= other).tolist(),
            color=colour,
            alpha=0.18,
            linewidth=0.0,
            label=name,
        )
    axes.fill_between(
        times[on], low[on], high[on], color=palette.OBSTACLE, linewidth=0.0, label="car"
    )
    first = int(np.argmax(on))
    before = times[: first + 1]
    for place, colour, name in (
        (high[first], REGION_A, "eq. 6.14"),
        (low[first], REGION_B, "eq. 6.17"),
    ):
        t0, v0 = before[-1], case.start_speed
        parabola = v0 * before + (place - v0 * t0) / t0**2 * before**2
        axes.plot(before, parabola, "--", color=colour, label=name)
    if profile is not None:
        axes.plot(profile.t, profile.distance, color=palette.CURVE, label="plan")
    axes.set_ylim(0.0, SHOWN_LENGTH)
    axes.set_ylabel("s [m]")
    axes.legend(loc="upper left", frameon=False)


def draw_courses(rows: Sequence["Axes"], case: SpeedCase) -> None:
    """Draw speed, acceleration and jerk with their limits."""
    profile, limits = case.plan.profile, EGO.limits
    if profile is None:
        return
    jerk = case.settings.max_jerk
    for axes, values, bounds, label in zip(
        rows,
        (profile.speed, profile.acceleration, profile.jerk),
        (
            (0.0, limits.max_speed),
            (-limits.max_deceleration, limits.max_acceleration),
            (-jerk, jerk),
        ),
        ("v [m/s]", "a [m/s²]", "jerk [m/s³]"),
        strict=True,
    ):
        axes.plot(profile.t, values, color=palette.CURVE, linewidth=palette.MEDIUM)
        for bound in bounds:
            axes.axhline(bound, color=palette.LIMIT, linewidth=palette.THIN, ls=":")
        axes.set_ylabel(label)


def extremes(case: SpeedCase) -> tuple[np.ndarray, np.ndarray]:
    """Return the extreme distances at uniform acceleration, eq. 6.13, 6.16."""
    times = knot_times(case.settings)
    limits, v0 = EGO.limits, case.start_speed

    def driven(acceleration: float, last_speed: float) -> np.ndarray:
        until = np.minimum(times, (last_speed - v0) / acceleration)
        way = v0 * until + 0.5 * acceleration * until**2
        return np.asarray(way + last_speed * (times - until))

    return (
        driven(-limits.max_deceleration, 0.0),
        driven(limits.max_acceleration, limits.max_speed),
    )
