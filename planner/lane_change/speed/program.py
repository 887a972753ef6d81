"""The speed program of one passing order; [Thesis] eq. 6.19, 6.20 corrected.

The task, its bounds over time, and the record that general solvers take. Tables that
depend on the settings alone are made once.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.lane_change.settings import SpeedSettings
from planner.lane_change.speed.passing_orders import Order
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.piecewise_jerk.objective import free_motion, objective_value
from planner.piecewise_jerk.problem import JerkProgram, PiecewiseJerkProblem
from planner.states import FloatArray, Path, freeze
from planner.vehicle import Vehicle

ROUNDING = 1e-9  # by which bounds of the distance give way [m]
# constant accelerations whose places the bounds of speed in bends are taken from
DRIVES = (-1.5, 0.0, 1.0, 2.5)  # [m/s²]
JERK_TIME = 1.5  # in which an acceleration has surely turned into braking [s]


@dataclass(frozen=True, slots=True, eq=False)
class SpeedTask:
    """Start, target speed and end of a speed plan."""

    speed: float  # now [m/s]
    acceleration: float  # now [m/s²]
    target_speed: float  # [m/s]
    end: float = math.inf  # not to be passed by the rear axle [m]
    # distance and speed to follow at the knots, (2, n_knots); None: the target speed
    wished: FloatArray | None = None


class StartState(NamedTuple):
    """Where a speed plan begins."""

    s: float  # [m]
    speed: float  # [m/s]
    acceleration: float  # [m/s²]


@dataclass(frozen=True, slots=True, eq=False)
class SpeedTables:
    """Arrays that depend on the settings alone; read only."""

    times: FloatArray  # (n,) [s]
    step: FloatArray  # (n - 1,) [s]
    weight: FloatArray  # (n, 3)
    row: FloatArray  # (n, 1, 3): s + tau v
    no_lower: FloatArray  # of s, v, a and the row, (n, 4)
    no_upper: FloatArray


def speed_tables(settings: SpeedSettings) -> SpeedTables:
    """Return the tables of one setting."""
    weights = (
        settings.distance_weight,
        settings.speed_weight,
        settings.acceleration_weight,
    )
    # a few numbers are looked up faster than the whole setting
    return _tables(settings.duration, settings.step, settings.front_headway, weights)


@lru_cache(maxsize=16)
def _tables(
    duration: float, step: float, headway: float, weights: tuple[float, float, float]
) -> SpeedTables:
    """Make the tables of one setting."""
    n = round(duration / step) + 1
    row = np.zeros((n, 1, 3))
    row[:, 0] = 1.0, headway, 0.0
    return SpeedTables(
        freeze(step * np.arange(n, dtype=np.float64)),
        freeze(np.full(n - 1, step)),
        freeze(np.tile(weights, (n, 1))),
        freeze(row),
        freeze(np.full((n, 4), -np.inf)),
        freeze(np.full((n, 4), np.inf)),
    )


def knot_times(settings: SpeedSettings) -> FloatArray:
    """Return the times of the knots [s]."""
    return speed_tables(settings).times


def start_state(
    task: SpeedTask, vehicle: Vehicle, settings: SpeedSettings
) -> StartState:
    """Return the state at the start, such that the limits can be kept from there.

    Emergency braking may have been harder than the program allows, and a vehicle that
    has just stopped still decelerates: what the jerk bound could not take back is left
    out.
    """
    speed = max(task.speed, 0.0)
    limits = vehicle.limits
    lowest = max(-limits.max_deceleration, -math.sqrt(2.0 * settings.max_jerk * speed))
    acceleration = min(max(task.acceleration, lowest), limits.max_acceleration)
    return StartState(0.0, speed, acceleration)


def speed_caps(
    path: Path,
    vehicle: Vehicle,
    task: SpeedTask,
    times: FloatArray,
    comfort: float = math.inf,
) -> FloatArray:
    """Bound the speed at each knot by the curvature there, (n_knots,) [m/s].

    The bound depends on the place, the program knows times: the places are those of
    drives that brake, go on or accelerate from the speed now (`DRIVES`), and of one at
    the wished speed.

    Args:
        path: Of the ego's rear axle.
        vehicle: Its limits.
        task: Speed now and target speed.
        times: Of the knots [s].
        comfort: Lateral acceleration that is kept where the vehicle could do more
            [m/s²].
    """
    limits = vehicle.limits
    return _caps(
        path.distance,
        path.curvature,
        min(limits.max_lateral_acceleration, comfort),
        limits.max_speed,
        max(task.target_speed, task.speed),
        task.speed,
        limits.max_deceleration,
        times,
    )


@compiled
def _caps(
    distance: FloatArray,
    curvature: FloatArray,
    lateral: float,
    fastest: float,
    wish: float,
    speed: float,
    braking: float,
    times: FloatArray,
) -> FloatArray:
    """Compute the bounds of `speed_caps`."""
    local = np.empty(curvature.size)
    for i in range(curvature.size):
        bend = max(abs(curvature[i]), 1e-6)
        local[i] = min(math.sqrt(lateral / bend), fastest)
    if local.min() >= fastest:
        return np.full(times.size, fastest)
    caps = interpolated(wish * times, distance, local)
    place = np.empty(times.size)
    for rate in DRIVES:
        end = 0.0 if rate < 0.0 else wish
        until = abs(end - speed) / abs(rate) if rate != 0.0 else np.inf
        for k in range(times.size):
            t = min(times[k], until)
            place[k] = speed * t + 0.5 * rate * t * t
            if times[k] > until:
                place[k] += end * (times[k] - until)
        caps = np.minimum(caps, interpolated(place, distance, local))
    for k in range(times.size):
        # braking builds up: from the present speed down to the bound
        possible = speed - 0.8 * braking * max(times[k] - 1.0, 0.0)
        caps[k] = max(caps[k], possible, 0.0)
    return caps


def program(
    order: Order,
    start: StartState,
    caps: FloatArray,
    task: SpeedTask,
    vehicle: Vehicle,
    settings: SpeedSettings,
) -> PiecewiseJerkProblem:
    """Write one order as a program."""
    tables = speed_tables(settings)
    lower, upper = limit_tables(start, caps, vehicle, settings)
    lower[:, 0] = order.lower - ROUNDING
    upper[:, 0] = order.upper
    return PiecewiseJerkProblem(
        tables.step,
        np.array(start),
        tables.weight,
        reference_motion(task, settings),
        settings.jerk_weight,
        lower[:, :3],
        upper[:, :3],
        -settings.max_jerk,
        settings.max_jerk,
        tables.row,
        np.full((tables.times.size, 1), -np.inf),
        order.headway[:, None],
    )


def reference_motion(task: SpeedTask, settings: SpeedSettings) -> FloatArray:
    """Return the reference of (s, v, a), (n_knots, 3), read only.

    Eq. 6.20 as printed has none: standing still is its best.
    """
    if task.wished is None:
        speed = 0.0 if settings.printed.objective else task.target_speed
        return _at_one_speed(speed, settings.duration, settings.step)
    reference = np.zeros((knot_times(settings).size, 3))
    reference[:, :2] = task.wished.T
    reference.setflags(write=False)
    return reference


@lru_cache(maxsize=16)
def _at_one_speed(speed: float, duration: float, step: float) -> FloatArray:
    """Return the reference of a drive at one speed, read only."""
    times = _tables(duration, step, 0.0, (0.0, 0.0, 0.0)).times
    reference = np.zeros((times.size, 3))
    reference[:, 0] = speed * times
    reference[:, 1] = speed
    reference.setflags(write=False)
    return reference


def limit_tables(
    start: StartState,
    caps: FloatArray,
    vehicle: Vehicle,
    settings: SpeedSettings,
) -> tuple[FloatArray, FloatArray]:
    """Bound s, v, a and the headway row by what holds in every order, (n_knots, 4).

    Distance and headway are still without bounds.
    """
    limits = vehicle.limits
    # a speed beyond the limit comes down as fast as the jerk bound lets it
    over = start.speed + max(start.acceleration, 0.0) ** 2 / (2.0 * settings.max_jerk)
    tables: tuple[FloatArray, FloatArray] = _limit_tables(
        knot_times(settings),
        caps,
        over,
        limits.max_deceleration,
        limits.max_acceleration,
    )
    return tables


@compiled
def _limit_tables(
    times: FloatArray,
    caps: FloatArray,
    over: float,
    deceleration: float,
    acceleration: float,
) -> tuple[FloatArray, FloatArray]:
    """Fill the tables of `limit_tables`; `over` is the speed that comes down."""
    lower = np.full((times.size, 4), -np.inf)
    upper = np.full((times.size, 4), np.inf)
    for k in range(times.size):
        falling = 0.5 * deceleration * max(times[k] - JERK_TIME, 0.0)
        lower[k, 1], upper[k, 1] = 0.0, max(caps[k], 0.0, over - falling)
        lower[k, 2], upper[k, 2] = -deceleration, acceleration
    return lower, upper


def free_program(
    start: StartState, task: SpeedTask, settings: SpeedSettings
) -> JerkProgram:
    """Write the program without any bounds of the state, as compiled solvers take it.

    Args:
        start: Of the ego.
        task: Gives the reference.
        settings: Weights and steps.
    """
    tables = speed_tables(settings)
    lower, upper = tables.no_lower.copy(), tables.no_upper.copy()
    return bounded_program(start, task, settings, lower, upper)


def bounded_program(
    start: StartState,
    task: SpeedTask,
    settings: SpeedSettings,
    lower: FloatArray,
    upper: FloatArray,
) -> JerkProgram:
    """Write a program as compiled solvers take it, with bounds, (n_knots, 4) each."""
    tables = speed_tables(settings)
    return JerkProgram(
        tables.step,
        freeze(start),
        tables.weight,
        reference_motion(task, settings),
        settings.jerk_weight,
        lower,
        upper,
        tables.row,
        -settings.max_jerk,
        settings.max_jerk,
    )


def free_cost(task: SpeedTask, vehicle: Vehicle, settings: SpeedSettings) -> float:
    """Return the cost of the motion that nothing bounds: no plan is cheaper."""
    free = free_motion(
        free_program(start_state(task, vehicle, settings), task, settings)
    )
    return objective_value(free.objective, free.table)
