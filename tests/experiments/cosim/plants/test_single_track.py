import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from experiments.cosim.plants.parameters import (
    CHASSIS,
    GRAVITY,
    TESTED_FRICTION,
    Actuator,
    Actuators,
    PlantModel,
    Tyres,
)
from experiments.cosim.plants.single_track import (
    DRIVE,
    SUB_STEP,
    drive_open_loop,
    plant_numbers,
)

CAR = CHASSIS["car"]
LAGS = Actuators(Actuator(lag=0.2), Actuator(lag=0.3))


def numbers(model=PlantModel.DYNAMIC, actuators=LAGS, *, saturate=False, **changes):
    values = {"friction": TESTED_FRICTION, "understeer": 0.0} | changes
    tyres = Tyres(saturate=saturate)
    return plant_numbers(model, CAR, tyres, actuators, **values)


def state(speed, **values):
    now = np.zeros(8)
    now[3] = speed
    for index, value in values.items():
        now[int(index[1:])] = value
    return now


def driven(plant, speed, steering, push, duration, step=SUB_STEP):
    n = round(duration / step)
    commands = np.array([np.full(n, steering), np.full(n, push)])
    return drive_open_loop(state(speed), commands, step, plant)


def published_rates(t, x, steering, push, mu, parts):
    """[CommonRoad] ST as printed, with lags before its two inputs."""
    _, _, delta, v, psi, r, beta, a = x
    front, rear, mass, inertia, h = parts
    c, g, length = 21.92 / 1.0489, 9.81, front + rear
    f, b = c * (g * rear - a * h), c * (g * front + a * h)
    return [
        v * math.cos(psi + beta),
        v * math.sin(psi + beta),
        (steering - delta) / 0.2,
        a,
        r,
        mu
        * mass
        / (inertia * length)
        * (
            front * f * delta
            + (rear * b - front * f) * beta
            - (front**2 * f + rear**2 * b) * r / v
        ),
        (mu / (v**2 * length) * (b * rear - f * front) - 1.0) * r
        - mu / (v * length) * (b + f) * beta
        + mu / (v * length) * f * delta,
        (push - a) / 0.3,
    ]


@pytest.mark.parametrize("speed", [6.0, 14.0, 30.0])
@pytest.mark.parametrize("mu", [TESTED_FRICTION, 0.5])
def test_dynamic_model_against_an_independent_integration(speed, mu):
    ours = driven(numbers(friction=mu), speed, 0.03, 0.8, 3.0)
    parts = (CAR.front, CAR.rear, CAR.mass, CAR.inertia, CAR.height)
    theirs = solve_ivp(
        published_rates,
        (0.0, 3.0),
        state(speed),
        "LSODA",
        args=(0.03, 0.8, mu, parts),
        rtol=1e-11,
        atol=1e-12,
    ).y[:, -1]
    assert ours[:, -1] == pytest.approx(theirs, abs=1e-6)


def test_step_steer_converges_with_order_four():
    plant = numbers()
    fine = driven(plant, 14.0, 0.05, 0.0, 1.0, step=0.001)[:, -1]
    coarse, middle = (
        np.abs(driven(plant, 14.0, 0.05, 0.0, 1.0, step=step)[:, -1] - fine).max()
        for step in (0.02, 0.01)
    )
    assert coarse / middle > 12.0


def test_kinematic_model_is_eq_3_8():
    # with ideal actuators and a held angle the rear axle drives on a circle
    plant = numbers(PlantModel.KINEMATIC, Actuators())
    first = state(10.0, _2=0.1)
    commands = np.array([np.full(400, 0.1), np.zeros(400)])
    x, y, _, v, heading, *_ = drive_open_loop(first, commands, SUB_STEP, plant)[:, -1]
    curvature = math.tan(0.1) / (CAR.front + CAR.rear)
    angle = 10.0 * 2.0 * curvature
    assert (x, y) == pytest.approx(
        (math.sin(angle) / curvature, (1.0 - math.cos(angle)) / curvature), abs=1e-9
    )
    assert (v, heading) == pytest.approx((10.0, angle), abs=1e-9)


def test_kinematic_model_with_a_turning_wheel():
    rate = 0.2
    plant = numbers(PlantModel.KINEMATIC, Actuators(Actuator(rate=rate)))
    end = driven(plant, 8.0, 1.0, 0.5, 2.0)[:, -1]

    def rates(t, x):
        v, delta = 8.0 + 0.5 * t, rate * t
        heading = x[2]
        turn = v * math.tan(delta) / (CAR.front + CAR.rear)
        return [v * math.cos(heading), v * math.sin(heading), turn]

    theirs = solve_ivp(rates, (0, 2.0), [0, 0, 0], "LSODA", rtol=1e-12, atol=1e-13)
    assert end[[0, 1, 4]] == pytest.approx(theirs.y[:, -1], abs=1e-9)
    assert end[2] == pytest.approx(0.4)


@pytest.mark.parametrize("understeer", [0.0, 0.003])
def test_steady_cornering(understeer):
    # delta = (L + K v²) kappa, and the rear slip angle a_y / (C g)
    speed, steering = 15.0, 0.02
    plant = numbers(understeer=understeer)
    end = driven(plant, speed, steering, 0.0, 12.0)[:, -1]
    length = CAR.front + CAR.rear
    rate = end[5]
    curvature = steering / (length + understeer * speed**2)
    assert rate / speed == pytest.approx(curvature, rel=1e-9)
    rear_slip = CAR.rear * rate / speed - end[6]
    stiffness = Tyres.__dataclass_fields__["stiffness"].default
    assert rear_slip == pytest.approx(speed * rate / (stiffness * GRAVITY), rel=1e-9)


def test_tyres_with_a_limit_agree_for_small_slip_and_end_at_the_friction():
    soft = driven(numbers(saturate=True), 12.0, 0.002, 0.0, 5.0)[:, -1]
    linear = driven(numbers(), 12.0, 0.002, 0.0, 5.0)[:, -1]
    assert soft[5] == pytest.approx(linear[5], rel=2e-3)
    ice = driven(numbers(saturate=True, friction=0.15), 12.0, 0.2, 0.0, 5.0)
    across = ice[3, 1:] * (ice[5, 1:] + np.diff(ice[6]) / SUB_STEP)
    assert 0.9 < np.abs(across).max() / (0.15 * GRAVITY) <= 1.0
    dry = driven(numbers(), 12.0, 0.2, 0.0, 5.0)
    assert dry[3, -1] * dry[5, -1] > 8.0


def test_braking_is_bounded_by_the_friction_and_ends_in_standing():
    ice = driven(numbers(friction=0.15), 10.0, 0.0, -8.0, 20.0)
    rates = np.diff(ice[3]) / SUB_STEP
    assert rates.min() == pytest.approx(-0.15 * GRAVITY, rel=1e-6)
    assert ice[3, -1] == 0.0
    assert np.isfinite(ice).all()


def test_below_walking_speed_the_dynamic_model_rolls():
    rolling = numbers(PlantModel.KINEMATIC)
    dynamic = driven(numbers(), 0.4, 0.3, 0.0, 4.0)[:, -1]
    length = CAR.front + CAR.rear
    other = driven(rolling, 0.4, 0.3, 0.0, 4.0)[:, -1]
    slip = math.atan(CAR.rear / length * math.tan(0.3))
    assert dynamic[4] == pytest.approx(other[4] * math.cos(slip), rel=1e-2)
    through = driven(numbers(), 4.0, 0.3, -1.0, 6.0)  # to a stand and beyond
    assert np.isfinite(through).all()
    assert np.abs(np.diff(through[5])).max() < 0.05


def test_power_falls_above_a_speed():
    plant = numbers(actuators=Actuators())
    slow = driven(plant, 5.0, 0.0, 11.0, SUB_STEP)
    fast = driven(plant, 30.0, 0.0, 11.0, SUB_STEP)
    grip = TESTED_FRICTION * GRAVITY
    assert (slow[3, 1] - 5.0) / SUB_STEP == pytest.approx(grip, rel=1e-6)
    power = 11.0 if CAR.max_acceleration > 11.0 else CAR.max_acceleration
    limit = min(CAR.max_acceleration * CAR.power_speed / 30.0, power)
    assert (fast[3, 1] - 30.0) / SUB_STEP == pytest.approx(limit, rel=1e-3)


def test_actuators_lag_and_have_a_rate():
    plant = numbers(actuators=Actuators(Actuator(lag=0.27), Actuator(lag=0.1)))
    states = driven(plant, 10.0, 0.02, 1.0, 0.5)
    t = SUB_STEP * np.arange(states.shape[1])
    assert states[2] == pytest.approx(0.02 * (1.0 - np.exp(-t / 0.27)), abs=1e-8)
    assert states[DRIVE] == pytest.approx(1.0 - np.exp(-t / 0.1), abs=1e-6)
    hard = driven(plant, 10.0, 0.5, 0.0, 0.5)
    assert np.diff(hard[2]).max() / SUB_STEP == pytest.approx(CAR.max_steering_rate)
    wild = driven(plant, 3.0, 3.0, 0.0, 5.0)
    assert wild[2].max() <= CAR.max_steering
