"""One step of a vehicle that follows a plan: control, actuators, motion."""

import math
from typing import NamedTuple

import numpy as np

from experiments.cosim.plants.controllers import (
    LAWS,
    ControllerKind,
    ControlNumbers,
)
from experiments.cosim.plants.parameters import GRAVITY
from experiments.cosim.plants.single_track import (
    DRIVE,
    HEADING,
    N_STATES,
    SPEED,
    STEERING,
    PlantNumbers,
    integrate,
    reachable,
    rear_axle,
    turning_rate,
)
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray
from planner.tracking.geometric import pure_pursuit, stanley
from planner.tracking.longitudinal import drive_command
from planner.tracking.lqr import lqr_feedback, steering_of_curvature
from planner.tracking.reference import ALONG, CURVATURE, errors_against, value_at

# rows of the queue of commands, (4, n), newest last: when it was given [s], steering
# [rad], acceleration [m/s²], feedback part of the steering [rad]
GIVEN, STEER, PUSH, FEEDBACK = range(4)
# what a step reports, (15,)
(
    LATERAL,  # error at the end of the step, positive to the left [m]
    BEHIND,  # the plan, along it [m]
    TURNED,  # heading error [rad]
    STEER_COMMAND,  # last one given [rad]
    STEER_ANGLE,  # [rad]
    PUSH_COMMAND,  # last one given [m/s²]
    PUSH_DRIVEN,  # [m/s²]
    LIMITED,  # share of the step at a limit of steering, drive or grip
    GRIP,  # largest share of the friction used
    REAR_X,  # [m]
    REAR_Y,
    REAR_HEADING,  # [rad]
    REAR_CURVATURE,  # of the rear axle's line [1/m]
    REAR_SPEED,  # along the heading [m/s]
    REAR_ACCELERATION,  # [m/s²]
) = range(15)
N_REPORTED = 15
PURSUIT = LAWS.index(ControllerKind.PURE_PURSUIT)
STANLEY = LAWS.index(ControllerKind.STANLEY)
CREEPING = 0.5  # below it the line's curvature is that of the steering [m/s]
EPSILON = 1e-9  # [s]


class Clock(NamedTuple):
    """Times of one step."""

    now: float  # since the ego entered [s]
    plan: float  # the same moment on the plan [s]
    period: float  # of the controller [s]
    ticks: int  # of the controller in the step
    sub_steps: int  # of the integration in a tick
    steering_dead_time: float  # [s]
    drive_dead_time: float  # [s]


@compiled
def _commands(
    plan: FloatArray,
    time: float,
    state: FloatArray,
    plant: PlantNumbers,
    control: ControlNumbers,
    given: FloatArray,
) -> tuple[float, float, float]:
    """Return steering [rad], acceleration [m/s²], and the steering's feedback part."""
    x, y, speed = rear_axle(state, plant)
    pose = (x, y, state[HEADING])
    lateral, behind, turned, place = errors_against(plan, time, pose)
    gains = (control.position_gain, control.speed_gain)
    push = drive_command(plan, time, (behind, speed), control.drive_lead, gains)
    length, soft = control.wheelbase, control.understeer
    if control.law == PURSUIT:
        distance = max(control.pursuit_time * speed, control.pursuit_distance)
        return pure_pursuit(plan, place, pose, length, distance), push, 0.0
    # a car answers to its steering with the lag v K_slip of its tyres
    preview = control.preview + speed * control.slip_gradient
    ahead = value_at(plan, ALONG, CURVATURE, place + speed * preview)
    forward = steering_of_curvature(ahead, speed, length, soft)
    if control.law == STANLEY:
        feedback = stanley(lateral, turned, speed, length, control.stanley_gain)
        return forward + feedback, push, feedback
    here = value_at(plan, ALONG, CURVATURE, place)
    turned -= control.slip_gradient * speed * speed * here
    off = state[STEERING] - steering_of_curvature(here, speed, length, soft)
    errors = (lateral, turned, off)
    feedback = lqr_feedback(control.gains, control.speeds, speed, errors, given)
    return forward + feedback, push, feedback


@inlined
def _is_limited(
    state: FloatArray,
    command: tuple[float, float],
    plant: PlantNumbers,
) -> bool:
    """Check whether an actuator, the power or the grip holds the vehicle back."""
    if abs(command[0]) > plant.max_steering:
        return True
    if plant.steering_lag > 0.0:
        rate = abs(command[0] - state[STEERING]) / plant.steering_lag
        if rate > plant.steering_rate:
            return True
    given = reachable(state[DRIVE], state[SPEED], plant)
    return bool(state[SPEED] > 0.0 and abs(given - state[DRIVE]) > EPSILON)


@compiled
def follow(
    state: FloatArray,
    queue: FloatArray,
    plan: FloatArray,
    clock: Clock,
    plant: PlantNumbers,
    control: ControlNumbers,
) -> FloatArray:
    """Follow a plan for one step; `state` and `queue` are changed in place.

    Args:
        state: See `single_track`, (8,).
        queue: Commands, (4, n).
        plan: Its table, see `planner.tracking.reference`.
        clock: Times.
        plant: The vehicle.
        control: The controller.

    Returns:
        What the names at the top of this file say, (15,).
    """
    report, work = np.zeros(N_REPORTED), np.empty((5, N_STATES))
    step = clock.period / clock.sub_steps
    last, limited, grip = queue.shape[1] - 1, 0, 0.0
    driven = 0.0
    for tick in range(clock.ticks):
        passed = tick * clock.period
        steer, push, feedback = _commands(
            plan, clock.plan + passed, state, plant, control, queue[FEEDBACK]
        )
        for row in range(queue.shape[0]):
            for i in range(last):
                queue[row, i] = queue[row, i + 1]
        queue[GIVEN, last] = clock.now + passed
        queue[STEER, last], queue[PUSH, last] = steer, push
        queue[FEEDBACK, last] = feedback
        for sub in range(clock.sub_steps):
            at = clock.now + passed + sub * step + EPSILON
            s = d = 0
            for i in range(1, last + 1):
                s = i if queue[GIVEN, i] <= at - clock.steering_dead_time else s
                d = i if queue[GIVEN, i] <= at - clock.drive_dead_time else d
            command = (queue[STEER, s], queue[PUSH, d])
            limited += _is_limited(state, command, plant)
            integrate(state, command, step, plant, work)
            driven = reachable(state[DRIVE], state[SPEED], plant)
            across = state[SPEED] * turning_rate(state, plant)
            grip = max(grip, math.hypot(driven, across))
    report[STEER_COMMAND], report[PUSH_COMMAND] = queue[STEER, last], queue[PUSH, last]
    report[STEER_ANGLE], report[PUSH_DRIVEN] = state[STEERING], driven
    report[LIMITED] = limited / (clock.ticks * clock.sub_steps)
    report[GRIP] = grip / (plant.friction * GRAVITY)
    end = clock.plan + clock.ticks * clock.period
    _fill_motion(report, state, driven, plant)
    pose = (report[REAR_X], report[REAR_Y], report[REAR_HEADING])
    report[LATERAL], report[BEHIND], report[TURNED], _ = errors_against(plan, end, pose)
    return report


@inlined
def _fill_motion(
    report: FloatArray, state: FloatArray, driven: float, plant: PlantNumbers
) -> None:
    """Fill the motion of the rear axle into a report."""
    x, y, speed = rear_axle(state, plant)
    report[REAR_X], report[REAR_Y], report[REAR_SPEED] = x, y, speed
    report[REAR_HEADING] = state[HEADING]
    if speed > CREEPING:
        report[REAR_CURVATURE] = turning_rate(state, plant) / speed
    else:
        length = plant.front + plant.rear
        report[REAR_CURVATURE] = math.tan(state[STEERING]) / length
    report[REAR_ACCELERATION] = driven
