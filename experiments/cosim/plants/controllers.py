"""Controllers by name, with the numbers that compiled code takes."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from experiments.cosim.plants.parameters import Actuators
from planner.states import FloatArray
from planner.tracking.error_model import SteeringDelay, commands_on_their_way
from planner.tracking.lqr import SPEEDS, LqrWeights, gain_table

PERIOD = 0.05  # of the controller, by default [s]


class ControllerKind(StrEnum):
    """Steering laws; the drive has one law."""

    LQR = "lqr"
    PURE_PURSUIT = "pure_pursuit"
    STANLEY = "stanley"


LAWS = tuple(ControllerKind)  # compiled code gets the index


@dataclass(frozen=True, slots=True)
class ControllerSettings:
    """A steering law and the gains of steering and drive."""

    kind: ControllerKind = ControllerKind.LQR
    period: float = PERIOD  # [s]
    delay_aware: bool = True  # whether lqr knows dead time and lag of the steering
    weights: LqrWeights = field(default_factory=LqrWeights)
    pursuit_time: float = 0.8  # pure pursuit looks this far ahead [s]
    pursuit_distance: float = 4.0  # at least [m]
    stanley_gain: float = 1.5  # [1/s]
    position_gain: float = 0.6  # of the drive [1/s²]
    speed_gain: float = 1.5  # of the drive [1/s]


class ControlNumbers(NamedTuple):
    """A controller as compiled code takes it."""

    law: int  # index in `LAWS`
    speeds: FloatArray  # at which the gains hold, (n_speeds,) [m/s]
    gains: FloatArray  # of the steering, (n_speeds, 3 + n)
    wheelbase: float  # [m]
    understeer: float  # [rad s²/m]
    slip_gradient: float  # of the rear axle: slip angle per lateral acceleration
    preview: float  # of the curvature [s]
    pursuit_time: float
    pursuit_distance: float
    stanley_gain: float
    drive_lead: float  # [s]
    position_gain: float
    speed_gain: float


def control_numbers(
    settings: ControllerSettings,
    actuators: Actuators,
    wheelbase: float,
    understeer: float,
    slip_gradient: float,
) -> ControlNumbers:
    """Design a controller for a vehicle.

    Args:
        settings: Of the controller.
        actuators: Their dead times and lags, which it knows.
        wheelbase: [m].
        understeer: Gradient [rad s²/m].
        slip_gradient: Of the rear axle [rad s²/m].
    """
    steering = actuators.steering
    known = SteeringDelay(steering.dead_time, steering.lag)
    delay = known if settings.delay_aware else SteeringDelay()
    gains = gain_table(wheelbase, understeer, delay, settings.period, settings.weights)
    return ControlNumbers(
        LAWS.index(settings.kind),
        SPEEDS,
        gains,
        wheelbase,
        understeer,
        slip_gradient,
        delay.dead_time + delay.lag,
        settings.pursuit_time,
        settings.pursuit_distance,
        settings.stanley_gain,
        actuators.drive.lead,
        settings.position_gain,
        settings.speed_gain,
    )


def queue_length(settings: ControllerSettings, actuators: Actuators) -> int:
    """Return how many commands have to be remembered."""
    longest = max(actuators.steering.dead_time, actuators.drive.dead_time)
    return commands_on_their_way(longest, settings.period) + 1
