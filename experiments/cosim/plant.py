"""From the planned trajectory to the ego's next state."""

import math
from typing import Protocol

from experiments.errors import ExperimentError
from planner.interface import PlanResult
from planner.numerics.angles import wrapped
from planner.numerics.compiled import compiled
from planner.states import CartesianState, FloatArray, Trajectory

START_TOLERANCE = 0.1  # from the ego to the trajectory's first point [m]
IMPOSSIBLE_SPEED = 150.0  # no road vehicle goes as fast [m/s]
TIME_TOLERANCE = 1e-9  # [s]
SPEED_TOLERANCE = 0.05  # a standing ego's speed may be rounded below zero [m/s]
BACKWARD_TOLERANCE = 0.2  # and its place along the road may waver [m]


class PlannerOutputError(ExperimentError):
    """A planner returned something that cannot be driven."""


class Plant(Protocol):
    """A model of how the ego follows a trajectory."""

    def step(
        self, ego: CartesianState, trajectory: Trajectory, step: float, at: float = 0.0
    ) -> CartesianState:
        """Return the ego's state one `step` [s] after `ego`.

        Args:
            ego: Now.
            trajectory: To follow.
            step: Of the loop [s].
            at: Now, on the trajectory [s].
        """
        ...


class PerfectTracking:
    """The ego is where the trajectory says."""

    def step(
        self,
        ego: CartesianState,  # noqa: ARG002, a vehicle model needs it
        trajectory: Trajectory,
        step: float,
        at: float = 0.0,
    ) -> CartesianState:
        """Return the trajectory's state `step` [s] after `at`, its heading wrapped.

        Raises:
            PlannerOutputError: If that state is not finite.
        """
        after = trajectory.at(at + step)
        numbers = (after.x, after.y, after.heading, after.curvature, after.speed)
        if not all(map(math.isfinite, (*numbers, after.acceleration))):
            raise PlannerOutputError(f"the trajectory leads to {after}")
        return CartesianState(
            after.x,
            after.y,
            wrapped(after.heading),
            after.curvature,
            after.speed,
            after.acceleration,
        )


def drivable_trajectory(
    plan: PlanResult,
    ego: CartesianState,
    step: float,
    tolerance: float = START_TOLERANCE,
) -> Trajectory:
    """Return the trajectory of a plan after checking that it can be driven.

    Args:
        plan: What the planner returned.
        ego: Where the trajectory has to start.
        step: How far in time it has to reach [s].
        tolerance: From `ego` to its first point [m].

    Returns:
        The trajectory.

    Raises:
        PlannerOutputError: If there is none, it holds numbers that are not finite,
            it does not start at the ego now, it is too short, or it leads against
            the direction of the road.
    """
    trajectory = plan.trajectory
    if trajectory is None:
        raise PlannerOutputError(
            f"no trajectory ({plan.status}): {plan.stats.reason or 'no reason given'}"
        )
    if not trajectory.is_finite():
        raise PlannerOutputError("the trajectory holds numbers that are not finite")
    if abs(trajectory.t[0]) > TIME_TOLERANCE:
        raise PlannerOutputError(f"the trajectory starts at t = {trajectory.t[0]:g} s")
    if trajectory.t[-1] < step - TIME_TOLERANCE:
        raise PlannerOutputError(
            f"the trajectory ends at {trajectory.t[-1]:g} s, before the step {step:g} s"
        )
    x, y = float(trajectory.x[0]), float(trajectory.y[0])
    gap = math.hypot(x - ego.x, y - ego.y)
    if gap > tolerance:
        raise PlannerOutputError(f"the trajectory starts {gap:.2f} m from the ego")
    _check_direction(trajectory)
    return trajectory


def _check_direction(trajectory: Trajectory) -> None:
    """Raise if a trajectory drives backwards, or against the road's direction."""
    slowest, worst, lost = _backwards(trajectory.speed, trajectory.s)
    speed = float(trajectory.speed[slowest])
    if speed < -SPEED_TOLERANCE:
        when = f"at t = {trajectory.t[slowest]:.2f} s"
        raise PlannerOutputError(
            f"the trajectory has a speed of {speed:.2f} m/s {when}; allowed: 0 or more"
        )
    if lost > BACKWARD_TOLERANCE:
        raise PlannerOutputError(
            f"the trajectory goes {lost:.2f} m against the road's direction "
            f"until t = {trajectory.t[worst]:.2f} s"
        )


@compiled
def _backwards(speed: FloatArray, s: FloatArray) -> tuple[int, int, float]:
    """Return the slowest point, the one that has lost the most way, and that way [m].

    Args:
        speed: (n,) [m/s].
        s: (n,) [m].
    """
    slowest, worst, lost, farthest = 0, 0, 0.0, s[0]
    for k in range(speed.size):
        if speed[k] < speed[slowest]:
            slowest = k
        farthest = max(farthest, s[k])
        if farthest - s[k] > lost:
            worst, lost = k, farthest - s[k]
    return slowest, worst, lost


def check_motion(before: CartesianState, after: CartesianState, step: float) -> None:
    """Raise if a step is longer than the ego's speeds allow.

    Args:
        before: The ego now.
        after: The ego one step on.
        step: Time between the two [s].

    Raises:
        PlannerOutputError: If the ego would jump.
    """
    moved = math.hypot(after.x - before.x, after.y - before.y)
    fastest = max(abs(before.speed), abs(after.speed))
    if fastest > IMPOSSIBLE_SPEED:
        raise PlannerOutputError(f"the trajectory has a speed of {fastest:.3g} m/s")
    if moved > fastest * step + START_TOLERANCE:
        raise PlannerOutputError(
            f"the trajectory jumps {moved:.2f} m in its first step at {fastest:.2f} m/s"
        )
