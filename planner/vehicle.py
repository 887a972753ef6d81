"""The ego vehicle: dimensions, limits and its three-disc cover."""

import math
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

from planner.errors import InvalidInputError
from planner.states import CartesianState, FloatArray, store_floats

CAR_LENGTH = 5.0  # of a body for which lengths in settings of planners are made [m]


class VehicleError(InvalidInputError):
    """Numbers that do not make a vehicle; `field` is the one that is not allowed."""

    def __init__(self, field: str, value: float, allowed: str) -> None:
        super().__init__(f"{field} is {value:g}; allowed: {allowed}")
        self.field = field
        self.value = value
        self.allowed = allowed


def _require_positive(record: object, unbounded: tuple[str, ...] = ()) -> None:
    """Raise unless every number of the record is positive and finite.

    Args:
        record: A dataclass.
        unbounded: Fields that may be infinite, too.
    """
    for field in fields(record):  # type: ignore[arg-type]
        value = getattr(record, field.name)
        if field.name in unbounded and value == math.inf:
            continue
        if isinstance(value, int | float) and not 0.0 < value < math.inf:
            raise VehicleError(field.name, value, "positive and finite")


@dataclass(frozen=True, slots=True)
class VehicleLimits:
    """Limits of the vehicle's motion, which planners keep to."""

    max_speed: float = 20.0  # [m/s]
    max_acceleration: float = 3.0  # [m/s²], Table 4.1
    max_deceleration: float = 4.5  # service braking [m/s²]
    emergency_deceleration: float = 8.0  # tyres on dry asphalt [m/s²]
    max_lateral_acceleration: float = 4.0  # [m/s²]
    max_curvature: float = 0.2  # 1/5 m, a compact car's turning circle [1/m]
    # of the driven curvature in time, inf where steering is immediate [1/m/s]; kept by
    # planners that choose their speed after their path
    max_curvature_rate: float = math.inf

    def __post_init__(self) -> None:
        """Raise unless the limits are positive, finite and consistent."""
        store_floats(self)
        _require_positive(self, unbounded=("max_curvature_rate",))
        if self.emergency_deceleration < self.max_deceleration:
            raise VehicleError(
                "emergency_deceleration",
                self.emergency_deceleration,
                f"at least max_deceleration = {self.max_deceleration:g}",
            )


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A rectangular vehicle, steered at the front, driven at the rear.

    The reference point is the centre of the rear axle, `rear_overhang` ahead of the
    rear bumper.
    """

    length: float = 4.8  # [m]
    width: float = 1.9  # [m]
    wheelbase: float = 2.8  # [m]
    rear_overhang: float = 1.0  # rear axle to rear bumper [m]
    limits: VehicleLimits = VehicleLimits()

    def __post_init__(self) -> None:
        """Raise unless the dimensions make a vehicle."""
        store_floats(self)
        _require_positive(self)
        room = self.length - self.rear_overhang
        if self.wheelbase > room:
            allowed = f"at most length - rear_overhang = {room:g}"
            raise VehicleError("wheelbase", self.wheelbase, allowed)

    @property
    def front_reach(self) -> float:
        """Distance from the rear axle to the front bumper [m]."""
        return self.length - self.rear_overhang

    @property
    def centre_offset(self) -> float:
        """Distance from the rear axle to the centre of the rectangle [m]."""
        return self.length / 2.0 - self.rear_overhang

    def front_wheel_angle(self, curvature: FloatArray) -> FloatArray:
        """Return the angle of the front wheel that drives a curvature, (n,) [rad].

        Of the kinematic single-track model, [Thesis] eq. 3.8: tan δ = L κ at the rear
        axle.
        """
        return np.asarray(np.arctan(self.wheelbase * curvature))

    def disc_cover(self, excess: float) -> tuple[FloatArray, float]:
        """Cover the rectangle by equal discs: three, or as many as a long body takes.

        Args:
            excess: How far they may reach beyond its sides, if more than three do
                [m].

        Returns:
            Their centres along the heading from the rear axle, rear first, (n,), and
            their radius [m].
        """
        half, n = self.width / 2.0, 3
        while math.hypot(self.length / (2 * n), half) - half > excess:
            n += 1
        pitch = self.length / n
        first = self.centre_offset - 0.5 * (self.length - pitch)
        centres = np.asarray(first + pitch * np.arange(n), dtype=np.float64)
        return centres, math.hypot(pitch / 2.0, half)

    @property
    def disc_radius(self) -> float:
        """Radius of each of the three discs that cover the rectangle [m]."""
        return math.hypot(self.length / 6.0, self.width / 2.0)

    @property
    def disc_offsets(self) -> tuple[float, float, float]:
        """Disc centres along the heading, from the rear axle [m], rear first."""
        third = self.length / 3.0
        return (
            self.centre_offset - third,
            self.centre_offset,
            self.centre_offset + third,
        )


@lru_cache(maxsize=16)
def held_to(vehicle: Vehicle, deceleration: float) -> Vehicle:
    """Return a vehicle with another service braking [m/s²].

    Planners ask for the same one in every cycle: records are checked when they are
    made, which takes longer than to look one up.
    """
    limits = replace(vehicle.limits, max_deceleration=deceleration)
    return replace(vehicle, limits=limits)


def body_scale(vehicle: Vehicle) -> float:
    """Return how much more room than a car a body needs to pull out, at least 1.

    Its front swings out ahead of its rear axle, which is what follows a planned path,
    and its side comes after: a motion to the side has to be longer with the body.
    """
    return max(vehicle.length / CAR_LENGTH, 1.0)


def centre_from_rear_axle(ego: CartesianState, vehicle: Vehicle) -> tuple[float, float]:
    """Return the centre of the ego's rectangle, given its rear axle [m]."""
    return (
        ego.x + vehicle.centre_offset * math.cos(ego.heading),
        ego.y + vehicle.centre_offset * math.sin(ego.heading),
    )
