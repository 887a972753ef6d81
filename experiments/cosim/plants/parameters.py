"""Numbers of vehicles and of their actuators."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

GRAVITY = 9.81  # [m/s²]
TESTED_FRICTION = 1.0489  # of the road on which the tyres were measured


class PlantModel(StrEnum):
    """Equations of motion."""

    KINEMATIC = "kinematic"  # single track about the rear axle, [Thesis] eq. 3.8
    DYNAMIC = "dynamic"  # single track with tyres, about the centre of gravity


@dataclass(frozen=True, slots=True)
class Tyres:
    """A tyre of the Pacejka form, the same on both axles, per unit of its load."""

    shape: float = 1.3507  # p_cy1
    peak: float = TESTED_FRICTION  # p_dy1
    curvature: float = -0.0074722  # p_ey1
    stiffness: float = 21.92  # -p_ky1 [1/rad]
    saturate: bool = False  # False: linear, as in the published single-track model


@dataclass(frozen=True, slots=True)
class Chassis:
    """Masses and lengths of a vehicle, and what its drive can do."""

    front: float  # front axle to centre of gravity [m]
    rear: float  # rear axle to centre of gravity [m]
    mass: float  # [kg]
    inertia: float  # about the vertical axis [kg m²]
    height: float  # of the centre of gravity [m]
    max_steering: float  # [rad]
    max_steering_rate: float  # [rad/s]
    max_acceleration: float = 11.5  # of drive and brakes [m/s²]
    power_speed: float = 7.319  # above it the power limits the drive [m/s]

    def with_wheelbase(self, wheelbase: float) -> "Chassis":
        """Return the same vehicle with another distance of its axles.

        The centre of gravity keeps its share of it, mass and inertia their values.

        Args:
            wheelbase: [m].
        """
        share = wheelbase / (self.front + self.rear)
        return Chassis(
            self.front * share,
            self.rear * share,
            self.mass,
            self.inertia,
            self.height,
            self.max_steering,
            self.max_steering_rate,
            self.max_acceleration,
            self.power_speed,
        )


# [CommonRoad] vehicle parameters: car is the BMW 320i (no. 2), van the VW Vanagon
# (no. 3). Of the lorry (the tractor of no. 4) lengths, steering and drive are
# published; mass, inertia m l_f l_r and height are assumed here.
CHASSIS: Mapping[str, Chassis] = {
    "car": Chassis(1.156, 1.423, 1093.0, 1792.0, 0.614, 1.066, 0.4, 11.5, 7.319),
    "van": Chassis(1.151, 1.321, 1479.0, 2473.0, 0.804, 1.023, 0.4, 11.5, 7.824),
    "lorry": Chassis(1.8, 1.8, 7500.0, 24300.0, 1.2, 0.55, 0.71, 11.5, 7.824),
}


@dataclass(frozen=True, slots=True)
class Actuator:
    """How a command becomes a steering angle or an acceleration."""

    dead_time: float = 0.0  # [s]
    lag: float = 0.0  # time constant [s]
    rate: float = math.inf  # largest change a second; inf: the chassis' for steering
    largest: float = math.inf  # magnitude; inf: the chassis' [rad, m/s²]

    @property
    def lead(self) -> float:
        """How much earlier a command has to be given [s]."""
        return self.dead_time + self.lag


@dataclass(frozen=True, slots=True)
class Actuators:
    """Steering and drive."""

    steering: Actuator = Actuator()
    drive: Actuator = Actuator()


# nuplan: lags of its simulated ego; autoware: its planning simulator's, measured on
# cars. Both publish no more than this.
ACTUATORS: Mapping[str, Actuators] = {
    "ideal": Actuators(),
    "nuplan": Actuators(Actuator(lag=0.05), Actuator(lag=0.2)),
    "autoware": Actuators(
        Actuator(dead_time=0.24, lag=0.27, rate=5.0, largest=1.0),
        Actuator(dead_time=0.1, lag=0.1),
    ),
}
