"""Single-track models in compiled code, integrated by Runge-Kutta of order 4.

Kinematic, about the rear axle ([Thesis] eq. 3.8, KS of [CommonRoad]):
x' = v cos psi, y' = v sin psi, psi' = v tan(delta) / L, v' = a.

Dynamic, about the centre of gravity (ST of [CommonRoad]): tyre forces proportional to
slip and load, or of Pacejka's form. It has no solution in standing: below walking speed
it fades into the kinematic model.
"""

import math
from typing import NamedTuple

import numpy as np

from experiments.cosim.plants.parameters import (
    GRAVITY,
    Actuators,
    Chassis,
    PlantModel,
    Tyres,
)
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray

SUB_STEP = 0.005  # of the integration [s]
# The state, (8,): x, y [m], steering [rad], speed [m/s], heading [rad], yaw rate
# [rad/s], slip angle [rad], acceleration that the drive gives [m/s²].
X, Y, STEERING, SPEED, HEADING, YAW_RATE, SLIP, DRIVE = range(8)
N_STATES = 8
FADE_SPEED = 1.0  # where dynamic and kinematic model weigh the same [m/s]
FADE_WIDTH = 0.1  # of the transition [m/s]
FADE_TIME = 0.05  # in which yaw rate and slip follow the kinematic ones [s]
SLOWEST = 0.2  # speed that the dynamic model divides by at least [m/s]
PARTS = (0.0, 0.5, 0.5, 1.0)  # of the step at which the four stages look
LEFT_FOR_TURNING = 0.05  # least share of the grip that braking leaves


class PlantNumbers(NamedTuple):
    """A vehicle as compiled code takes it."""

    dynamic: bool
    saturate: bool  # tyres of Pacejka's form instead of linear ones
    front: float  # [m]
    rear: float  # [m]
    mass: float  # [kg]
    inertia: float  # [kg m²]
    height: float  # [m]
    friction: float  # [-]
    front_stiffness: float  # per load and friction [1/rad]
    rear_stiffness: float  # [1/rad]
    shape: float  # Pacejka's C
    curvature: float  # Pacejka's E
    max_steering: float  # [rad]
    steering_rate: float  # [rad/s]
    steering_lag: float  # [s]
    drive_lag: float  # [s]
    drive_rate: float  # [m/s³]
    max_acceleration: float  # [m/s²]
    power_speed: float  # [m/s]


def plant_numbers(
    model: PlantModel,
    chassis: Chassis,
    tyres: Tyres,
    actuators: Actuators,
    friction: float,
    understeer: float,
) -> PlantNumbers:
    """Collect the numbers of a vehicle.

    Args:
        model: Equations of motion.
        chassis: With the wheelbase that is to be driven.
        tyres: Of both axles.
        actuators: Their lags and limits; dead times are not the plant's matter.
        friction: Of the road, `tyres.peak` where they were measured.
        understeer: Gradient K of delta = (L + K v²) kappa; a softer front axle
            [rad s²/m].
    """
    stiffness = tyres.stiffness / tyres.peak
    front = stiffness / (1.0 + tyres.peak * GRAVITY * stiffness * understeer)
    steering, drive = actuators.steering, actuators.drive
    return PlantNumbers(
        model is PlantModel.DYNAMIC,
        tyres.saturate,
        chassis.front,
        chassis.rear,
        chassis.mass,
        chassis.inertia,
        chassis.height,
        friction,
        front,
        stiffness,
        tyres.shape,
        tyres.curvature,
        min(chassis.max_steering, steering.largest),
        min(chassis.max_steering_rate, steering.rate),
        steering.lag,
        drive.lag,
        drive.rate,
        min(chassis.max_acceleration, drive.largest),
        chassis.power_speed,
    )


@inlined
def within(value: float, limit: float) -> float:
    """Return a value cut to a magnitude."""
    return min(max(value, -limit), limit)


@inlined
def reachable(wish: float, speed: float, plant: PlantNumbers) -> float:
    """Return the acceleration that drive, brakes and grip give for a wish [m/s²]."""
    grip = plant.friction * GRAVITY if plant.dynamic else np.inf
    power = plant.max_acceleration
    if speed > plant.power_speed:
        power *= plant.power_speed / speed
    driven = min(max(wish, -min(plant.max_acceleration, grip)), power, grip)
    return 0.0 if speed <= 0.0 and driven < 0.0 else driven  # brakes do not reverse


@inlined
def _saturated(slip: float, stiffness: float, plant: PlantNumbers) -> float:
    """Return Pacejka's lateral force per load and friction, against the slip angle."""
    b = stiffness / plant.shape
    bent = b * slip - plant.curvature * (b * slip - math.atan(b * slip))
    return -math.sin(plant.shape * math.atan(bent))


@inlined
def _turning(
    state: FloatArray, acceleration: float, plant: PlantNumbers
) -> tuple[float, float]:
    """Compute (yaw acceleration [rad/s²], rate of the slip angle [rad/s])."""
    speed = max(state[SPEED], SLOWEST)
    steering, rate, slip = state[STEERING], state[YAW_RATE], state[SLIP]
    front, rear, mu = plant.front, plant.rear, plant.friction
    length = front + rear
    # loads of the axles per mass, times the wheelbase
    front_load = GRAVITY * rear - acceleration * plant.height
    rear_load = GRAVITY * front + acceleration * plant.height
    if plant.saturate:
        used = acceleration / (mu * GRAVITY)
        left = mu * math.sqrt(max(1.0 - used * used, LEFT_FOR_TURNING**2))
        along = max(speed * math.cos(slip), SLOWEST)
        across = speed * math.sin(slip)
        front_slip = math.atan((across + front * rate) / along) - steering
        rear_slip = math.atan((across - rear * rate) / along)
        front_force = front_load * left / length
        front_force *= _saturated(front_slip, plant.front_stiffness, plant)
        rear_force = rear_load * left / length
        rear_force *= _saturated(rear_slip, plant.rear_stiffness, plant)
        front_force *= math.cos(steering)
        yaw = plant.mass * (front * front_force - rear * rear_force) / plant.inertia
        return yaw, (front_force + rear_force) / speed - rate
    f = plant.front_stiffness * front_load
    r = plant.rear_stiffness * rear_load
    yaw = -(front * front * f + rear * rear * r) * rate / speed
    yaw += (rear * r - front * f) * slip + front * f * steering
    yaw *= mu * plant.mass / (plant.inertia * length)
    turn = (mu / (speed * speed * length) * (r * rear - f * front) - 1.0) * rate
    turn -= mu / (speed * length) * (f + r) * slip
    turn += mu / (speed * length) * f * steering
    return yaw, turn


@compiled
def _fill_rates(
    state: FloatArray,
    command: tuple[float, float],
    plant: PlantNumbers,
    rates: FloatArray,
) -> None:
    """Fill the time derivatives of a state; see `integrate` for the arguments."""
    steering, speed, heading = state[STEERING], state[SPEED], state[HEADING]
    acceleration = reachable(state[DRIVE], speed, plant)
    rates[STEERING] = rates[DRIVE] = 0.0
    if plant.steering_lag > 0.0:
        wish = (command[0] - steering) / plant.steering_lag
        rates[STEERING] = within(wish, plant.steering_rate)
    if plant.drive_lag > 0.0:
        wish = (command[1] - state[DRIVE]) / plant.drive_lag
        rates[DRIVE] = within(wish, plant.drive_rate)
    rates[SPEED] = acceleration
    length = plant.front + plant.rear
    if not plant.dynamic:
        rates[X] = speed * math.cos(heading)
        rates[Y] = speed * math.sin(heading)
        rates[HEADING] = speed * math.tan(steering) / length
        rates[YAW_RATE] = rates[SLIP] = 0.0
        return
    tangent = math.tan(steering)
    slip_rolling = math.atan(plant.rear / length * tangent)
    rate_rolling = speed * math.cos(slip_rolling) * tangent / length
    weight = 0.5 * (math.tanh((speed - FADE_SPEED) / FADE_WIDTH) + 1.0)
    rest = 1.0 - weight
    slip = weight * state[SLIP] + rest * slip_rolling
    yaw, turn = _turning(state, acceleration, plant)
    rates[X] = speed * math.cos(heading + slip)
    rates[Y] = speed * math.sin(heading + slip)
    rates[HEADING] = weight * state[YAW_RATE] + rest * rate_rolling
    rates[YAW_RATE] = weight * yaw
    rates[YAW_RATE] += rest * (rate_rolling - state[YAW_RATE]) / FADE_TIME
    rates[SLIP] = weight * turn + rest * (slip_rolling - state[SLIP]) / FADE_TIME


@compiled
def integrate(
    state: FloatArray,
    command: tuple[float, float],
    step: float,
    plant: PlantNumbers,
    work: FloatArray,
) -> None:
    """Move a state one step on, in place.

    Args:
        state: (8,), see the top of this file.
        command: Steering [rad] and acceleration [m/s²] that arrive at the actuators.
        step: [s].
        plant: The vehicle.
        work: Scratch, (5, 8).
    """
    wanted = within(command[0], plant.max_steering)
    command = (wanted, command[1])
    turned = pushed = 0.0  # by actuators without a lag, which only have a rate
    if plant.steering_lag <= 0.0:
        turned = within(wanted - state[STEERING], plant.steering_rate * step)
    if plant.drive_lag <= 0.0:
        pushed = within(command[1] - state[DRIVE], plant.drive_rate * step)
        state[DRIVE] += pushed
    at = work[4]
    for stage in range(4):
        part = PARTS[stage]
        for i in range(N_STATES):
            before = 0.0 if stage == 0 else work[stage - 1, i]
            at[i] = state[i] + part * step * before
        if plant.steering_lag <= 0.0:
            at[STEERING] = state[STEERING] + part * turned
        _fill_rates(at, command, plant, work[stage])
    for i in range(N_STATES):
        mean = work[0, i] + 2.0 * (work[1, i] + work[2, i]) + work[3, i]
        state[i] += step / 6.0 * mean
    state[STEERING] += turned
    state[SPEED] = max(state[SPEED], 0.0)


@compiled
def drive_open_loop(
    state: FloatArray, commands: FloatArray, step: float, plant: PlantNumbers
) -> FloatArray:
    """Integrate with given commands; return the states, (8, n + 1).

    Args:
        state: At the start, (8,).
        commands: Steering [rad] and acceleration [m/s²], each held a step, (2, n).
        step: [s].
        plant: The vehicle.
    """
    now, work = state.copy(), np.empty((5, N_STATES))
    states = np.empty((N_STATES, commands.shape[1] + 1))
    states[:, 0] = now
    for k in range(commands.shape[1]):
        integrate(now, (commands[0, k], commands[1, k]), step, plant, work)
        states[:, k + 1] = now
    return states


@inlined
def rear_axle(state: FloatArray, plant: PlantNumbers) -> tuple[float, float, float]:
    """Return x, y [m] of the rear axle and its speed along the heading [m/s]."""
    if not plant.dynamic:
        return float(state[X]), float(state[Y]), float(state[SPEED])
    heading = state[HEADING]
    x = state[X] - plant.rear * math.cos(heading)
    y = state[Y] - plant.rear * math.sin(heading)
    return x, y, state[SPEED] * math.cos(state[SLIP])


@inlined
def turning_rate(state: FloatArray, plant: PlantNumbers) -> float:
    """Return the rate of the heading [rad/s]."""
    tangent = math.tan(state[STEERING])
    length = plant.front + plant.rear
    if not plant.dynamic:
        return float(state[SPEED] * tangent / length)
    slip = math.atan(plant.rear / length * tangent)
    rolling = state[SPEED] * math.cos(slip) * tangent / length
    weight = 0.5 * (math.tanh((state[SPEED] - FADE_SPEED) / FADE_WIDTH) + 1.0)
    return float(weight * state[YAW_RATE] + (1.0 - weight) * rolling)
