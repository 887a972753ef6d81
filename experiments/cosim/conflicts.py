"""Cut-in, cut-out and braking leader: the other vehicle's motion in many conflicts.

The parameterisation of [Mattas2022]: straight lanes 3.5 m wide, vehicles 4.3 m by
1.9 m in the middle of their lanes, steps of 0.1 s, everything constant but what the
conflict is about. The regulation's own text leaves vehicle sizes open.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from experiments.errors import ConfigError
from planner.states import BoolArray, FloatArray, IntArray

STEP_S = 0.1
LATERAL_ACCELERATION = 1.5  # until the lateral speed is reached [m/s²]
RAMP_STEP = LATERAL_ACCELERATION / (1.0 / STEP_S)  # 0.15 to the last bit [m/s]
QUINTIC_PEAK = 1.875  # greatest over mean speed of a quintic of least jerk
AFTERWARDS_S = 25.0  # to brake from 130 km/h after the last change of the other [s]


class LateralProfile(StrEnum):
    """How the other vehicle moves sideways in a cut-in."""

    LINEAR = "linear"  # the regulation's: at constant lateral speed
    QUINTIC = "quintic"  # least jerk from lane to lane; Vy is the greatest speed


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of both vehicles and of a lane.

    Raises:
        ConfigError: If a size is not positive or a vehicle is wider than its lane.
    """

    ego_length: float = 4.3  # [m]
    ego_width: float = 1.9  # [m]
    other_length: float = 4.3  # [m]
    other_width: float = 1.9  # [m]
    lane_width: float = 3.5  # [m]

    def __post_init__(self) -> None:
        """Check that both vehicles fit into their lanes."""
        if not min(self.ego_length, self.other_length) > 0.0:
            raise ConfigError("lengths of vehicles must be greater than 0 m")
        for name in ("ego_width", "other_width"):
            width = getattr(self, name)
            if not 0.0 < width < self.lane_width:
                raise ConfigError(
                    f"{name} {width} m must lie between 0 m and the lane's width "
                    f"{self.lane_width} m"
                )

    @property
    def lateral_clearance(self) -> float:
        """Lateral gap between vehicles in the middle of neighbouring lanes [m]."""
        return self.lane_width - 0.5 * self.ego_width - 0.5 * self.other_width


@dataclass(frozen=True, slots=True, eq=False)
class Conflicts:
    """Many conflicts with one other vehicle each, step by step.

    Columns are conflicts, rows are steps of `STEP_S`; all arrays are float64 but
    `visible`. Row `start[i]` is the moment at which conflict i has the parameters
    that it is named after; rows before it are the way there.
    """

    sizes: Sizes
    ego_speed: FloatArray  # before the ego reacts, (n,) [m/s]
    gap: FloatArray  # between the bumpers in the first row, (n,) [m]
    other_speed: FloatArray  # during the step, (n_steps, n) [m/s]
    lateral_gap: FloatArray  # (n_steps, n) [m]
    lateral_speed: FloatArray  # towards the ego, (n_steps, n) [m/s]
    visible: BoolArray  # whether the driver can see the other vehicle, (n_steps, n)
    start: IntArray  # (n,)

    @property
    def size(self) -> int:
        """Number of conflicts."""
        return self.gap.size


def cut_in(
    ego_speed: float,
    other_speed: float,
    gap: FloatArray,
    lateral_speed: FloatArray,
    sizes: Sizes | None = None,
    profile: LateralProfile = LateralProfile.LINEAR,
) -> Conflicts:
    """Build cut-ins of a vehicle from the neighbouring lane.

    Args:
        ego_speed: [m/s].
        other_speed: Along the lane [m/s].
        gap: Between the bumpers when the lateral speed is reached, (n,) [m]; with the
            quintic profile when the vehicle begins to move sideways.
        lateral_speed: (n,) [m/s]; at 0 the vehicle stays in its lane.
        sizes: Of vehicles and lane.
        profile: Of the lateral motion.

    Raises:
        ConfigError: If a speed is negative, or a cut-in begins with the vehicles
            beside each other.
    """
    sizes = sizes or Sizes()
    _check_speeds(ego_speed, other_speed, float(np.min(lateral_speed)))
    if np.min(gap) <= 0.0:
        raise ConfigError(
            f"dx0 {np.min(gap):g} m must be greater than 0 m: a cut-in must not "
            "begin with the vehicles beside each other"
        )
    n = gap.size
    linear = profile is LateralProfile.LINEAR
    ramp = np.ceil(lateral_speed / RAMP_STEP)
    start = ramp.astype(np.int64) if linear else np.zeros(n, dtype=np.int64)
    slowest = np.min(lateral_speed, initial=math.inf, where=lateral_speed > 0.0)
    crossing = sizes.lateral_clearance / slowest  # 0 if no vehicle changes lane
    if not linear:
        crossing = QUINTIC_PEAK * sizes.lane_width / slowest
    n_steps = int(start.max(initial=0) + (crossing + AFTERWARDS_S) / STEP_S) + 1
    lateral_gap = np.empty((n_steps, n))
    speed = np.empty((n_steps, n))
    for v in np.unique(lateral_speed):
        same = lateral_speed == v
        if linear:
            gaps, speeds = _lateral_motion(float(v), sizes, n_steps)
        else:
            gaps, speeds = _quintic_motion(float(v), sizes, n_steps)
        lateral_gap[:, same] = gaps[:, np.newaxis]
        speed[:, same] = speeds[:, np.newaxis]
    return Conflicts(
        sizes,
        np.full(n, ego_speed),
        gap + (ego_speed - other_speed) * start * STEP_S,
        np.full((n_steps, n), other_speed),
        lateral_gap,
        speed,
        np.ones((n_steps, n), dtype=np.bool_),
        start,
    )


def cut_out(
    ego_speed: float,
    following_gap: float,
    front_gap: FloatArray,
    lateral_speed: FloatArray,
    sizes: Sizes | None = None,
) -> Conflicts:
    """Build cut-outs: the leader leaves the lane and uncovers a standing vehicle.

    Leader and ego drive at one speed until then. The driver sees the standing vehicle
    once no part of the leader is in front of the ego.

    Args:
        ego_speed: Of ego and leader [m/s].
        following_gap: Between ego and leader [m].
        front_gap: From the leader's front to the standing vehicle when the leader
            begins to move sideways with its full lateral speed, (n,) [m].
        lateral_speed: Of the leader, (n,), greater than 0 [m/s].
        sizes: Of vehicles (leader and standing vehicle are alike) and lane.

    Raises:
        ConfigError: If a speed is negative or the leader does not move sideways.
    """
    sizes = sizes or Sizes()
    _check_speeds(ego_speed, following_gap, float(np.min(front_gap)))
    if np.min(lateral_speed) <= 0.0:
        raise ConfigError("the lateral speed of a cut-out must be greater than 0 m/s")
    n = front_gap.size
    width = 0.5 * (sizes.ego_width + sizes.other_width)
    uncovered = width / lateral_speed  # [s]
    n_steps = int((float(uncovered.max()) + AFTERWARDS_S) / STEP_S) + 1
    clock = _clock(n_steps)[:, np.newaxis]
    return Conflicts(
        sizes,
        np.full(n, ego_speed),
        following_gap + sizes.other_length + front_gap,
        np.zeros((n_steps, n)),
        np.full((n_steps, n), -width),
        np.zeros((n_steps, n)),
        clock >= uncovered,
        np.zeros(n, dtype=np.int64),
    )


def braking_leader(
    speed: FloatArray,
    deceleration: FloatArray,
    following_gap: FloatArray,
    sizes: Sizes | None = None,
) -> Conflicts:
    """Build leaders that brake to a stop from the ego's own speed.

    Args:
        speed: Of both vehicles, (n,) [m/s].
        deceleration: Of the leader, from the first step on, (n,), > 0 [m/s²].
        following_gap: Between the bumpers, (n,) [m].
        sizes: Of vehicles and lane.

    Raises:
        ConfigError: If a speed or gap is negative, or a leader does not brake.
    """
    sizes = sizes or Sizes()
    _check_speeds(float(np.min(speed)), float(np.min(following_gap)))
    if np.min(deceleration) <= 0.0:
        raise ConfigError("the deceleration of a leader must be greater than 0 m/s²")
    n = speed.size
    stopping = float(np.max(speed / deceleration))
    n_steps = int((stopping + AFTERWARDS_S) / STEP_S) + 1
    clock = _clock(n_steps)[:, np.newaxis]
    width = 0.5 * (sizes.ego_width + sizes.other_width)
    return Conflicts(
        sizes,
        speed,
        following_gap,
        np.maximum(speed - deceleration * clock, 0.0),
        np.full((n_steps, n), -width),
        np.zeros((n_steps, n)),
        np.ones((n_steps, n), dtype=np.bool_),
        np.zeros(n, dtype=np.int64),
    )


def _lateral_motion(
    lateral_speed: float, sizes: Sizes, n_steps: int
) -> tuple[FloatArray, FloatArray]:
    """Return lateral gap and speed, (n_steps,), of one cut-in.

    The lateral speed is reached in the middle of the other lane. Several lateral
    speeds of the grids reach the ego's side exactly at a step, and at some the ramp is
    a step longer than their quotient (0.6 over 0.15): both follow from rounding, so
    the sums are made as in the published implementation.
    """
    rate = 1.0 / STEP_S
    ramp = np.arange(0.0, lateral_speed, RAMP_STEP)
    speeds = np.full(n_steps, lateral_speed)
    speeds[: ramp.size] = ramp
    before = np.cumsum(ramp[::-1] / rate)[::-1]
    after = -np.cumsum(speeds[ramp.size + 1 :]) / rate
    place = np.concatenate([before, [0.0], after]) + sizes.lane_width
    return place - 0.5 * sizes.ego_width - 0.5 * sizes.other_width, speeds


def _quintic_motion(
    lateral_speed: float, sizes: Sizes, n_steps: int
) -> tuple[FloatArray, FloatArray]:
    """Return lateral gap and speed, (n_steps,), of a quintic from lane to lane."""
    if lateral_speed == 0.0:
        return np.full(n_steps, sizes.lateral_clearance), np.zeros(n_steps)
    duration = QUINTIC_PEAK * sizes.lane_width / lateral_speed
    u = np.minimum(_clock(n_steps) / duration, 1.0)
    moved = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
    rate = 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration
    return sizes.lateral_clearance - sizes.lane_width * moved, sizes.lane_width * rate


def _clock(n_steps: int) -> FloatArray:
    """Return the times of the steps [s], each one step after the one before."""
    ticks = np.full(n_steps, STEP_S)
    ticks[0] = 0.0
    return np.cumsum(ticks)


def _check_speeds(*values: float) -> None:
    """Refuse negative speeds and distances."""
    if not min(values) >= 0.0:
        raise ConfigError(
            f"speeds and distances must be at least 0, got {min(values):g}"
        )
