import math
from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.plant import (
    PerfectTracking,
    PlannerOutputError,
    check_motion,
    drivable_trajectory,
)
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.states import CartesianState, Trajectory

EGO = CartesianState(0.0, 0.0, 0.0, 0.0, 10.0, 0.0)


def straight_on(**changes) -> Trajectory:
    t = np.arange(11) * 0.1
    zero = np.zeros(11)
    columns = {
        "t": t,
        "x": 10.0 * t,
        "y": zero,
        "heading": zero,
        "curvature": zero,
        "speed": zero + 10.0,
        "acceleration": zero,
        "s": 10.0 * t,
        "l": zero,
    }
    return Trajectory(**(columns | changes))


def plan(trajectory: Trajectory | None, reason: str = "") -> PlanResult:
    return PlanResult(PlanStatus.OK, trajectory, None, PlanStats(reason))


def test_a_sound_trajectory_passes():
    trajectory = straight_on()
    assert drivable_trajectory(plan(trajectory), EGO, 0.1) is trajectory


def test_no_trajectory_says_why():
    with pytest.raises(PlannerOutputError, match="the scene is empty"):
        drivable_trajectory(plan(None, "the scene is empty"), EGO, 0.1)


@pytest.mark.parametrize("column", ["x", "heading", "speed", "l"])
def test_nan_anywhere_is_refused(column):
    bad = np.array(getattr(straight_on(), column))
    bad[7] = math.nan
    with pytest.raises(PlannerOutputError, match="not finite"):
        drivable_trajectory(plan(straight_on(**{column: bad})), EGO, 0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"y": np.full(11, 0.2)}, "0.20 m from the ego"),
        ({"t": 0.05 + np.arange(11) * 0.1}, "starts at t"),
    ],
)
def test_a_trajectory_that_is_not_from_here_is_refused(changes, message):
    with pytest.raises(PlannerOutputError, match=message):
        drivable_trajectory(plan(straight_on(**changes)), EGO, 0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"speed": np.linspace(10.0, -3.0, 11)},
            r"speed of -3.00 m/s at t = 1.00 s; allowed: 0 or more",
        ),
        (
            {"x": np.arange(11) * -1.0, "s": np.arange(11) * -1.0},
            r"goes 10.00 m against the road's direction until t = 1.00 s",
        ),
        ({"s": np.append(np.arange(10.0), 5.0)}, r"goes 4.00 m against"),
    ],
)
def test_a_trajectory_that_leads_backwards_is_refused(changes, message):
    with pytest.raises(PlannerOutputError, match=message):
        drivable_trajectory(plan(straight_on(**changes)), EGO, 0.1)


def test_rounding_below_zero_is_allowed():
    wavering = straight_on(
        speed=np.full(11, -0.04), s=np.where(np.arange(11) % 2, -0.1, 0.05)
    )
    assert drivable_trajectory(plan(wavering), EGO, 0.1) is wavering


def test_a_trajectory_shorter_than_a_step_is_refused():
    with pytest.raises(PlannerOutputError, match="before the step"):
        drivable_trajectory(plan(straight_on()), EGO, 1.5)


def test_tracking_follows_the_samples_and_wraps_the_heading():
    trajectory = straight_on(heading=np.full(11, 3.0 * math.pi / 2.0))
    after = PerfectTracking().step(EGO, trajectory, 0.3)
    assert after.x == pytest.approx(3.0)
    assert after.heading == pytest.approx(-math.pi / 2.0)


def test_tracking_refuses_a_state_that_is_not_finite():
    trajectory = straight_on(acceleration=np.append(0.0, np.full(10, math.inf)))
    with pytest.raises(PlannerOutputError, match="inf"):
        PerfectTracking().step(replace(EGO, x=1.0), trajectory, 0.1)


@pytest.mark.parametrize(
    ("x", "speed", "fine"), [(1.0, 10.0, True), (1.0, 0.0, True), (1.2, 10.0, False)]
)
def test_the_ego_moves_no_farther_than_it_drives(x, speed, fine):
    after = replace(EGO, x=x, speed=speed)
    if fine:
        check_motion(EGO, after, 0.1)
    else:
        with pytest.raises(PlannerOutputError, match=r"jumps 1.20 m"):
            check_motion(EGO, after, 0.1)
