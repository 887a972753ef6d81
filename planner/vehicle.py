"""The ego vehicle: dimensions, limits, single-track model and its three-disc cover."""

import math
from dataclasses import dataclass, fields

from planner.errors import InvalidInputError
from planner.states import CartesianState


def _require_positive(record: object) -> None:
    """Raise unless every number of the record is positive and finite."""
    for field in fields(record):  # type: ignore[arg-type]
        value = getattr(record, field.name)
        if isinstance(value, int | float) and not 0.0 < value < math.inf:
            raise InvalidInputError(f"{field.name} = {value} must be positive")


@dataclass(frozen=True, slots=True)
class VehicleLimits:
    """What the vehicle can do; the planner stays inside."""

    max_speed: float = 20.0  # [m/s]
    max_acceleration: float = 3.0  # [m/s²], Table 4.1
    max_deceleration: float = 4.5  # service braking [m/s²]
    emergency_deceleration: float = 8.0  # tyres on dry asphalt [m/s²]
    max_lateral_acceleration: float = 4.0  # [m/s²]
    max_curvature: float = 0.2  # 1/5 m, a compact car's turning circle [1/m]

    def __post_init__(self) -> None:
        """Refuse limits that are not positive and finite."""
        _require_positive(self)
        if self.emergency_deceleration < self.max_deceleration:
            raise InvalidInputError(
                f"emergency_deceleration = {self.emergency_deceleration} must be at "
                f"least max_deceleration = {self.max_deceleration}"
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
        """Refuse dimensions that do not make a vehicle."""
        _require_positive(self)
        if self.rear_overhang + self.wheelbase > self.length:
            raise InvalidInputError(
                f"rear_overhang + wheelbase = {self.rear_overhang + self.wheelbase:g} "
                f"must not exceed length = {self.length:g}"
            )

    @property
    def front_reach(self) -> float:
        """Distance from the rear axle to the front bumper [m]."""
        return self.length - self.rear_overhang

    @property
    def centre_offset(self) -> float:
        """Distance from the rear axle to the centre of the rectangle [m]."""
        return self.length / 2.0 - self.rear_overhang

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

    def steering_angle(self, curvature: float) -> float:
        """Front wheel angle that drives `curvature` [rad]; [Thesis] eq. 3.7."""
        return math.atan(self.wheelbase * curvature)


def single_track_rates(
    state: CartesianState, steering_angle: float, vehicle: Vehicle
) -> tuple[float, float, float]:
    """Rates of the kinematic single-track model; [Thesis] eq. 3.8.

    Args:
        state: Pose and speed of the rear axle.
        steering_angle: Front wheel angle, positive to the left [rad].
        vehicle: Gives the wheelbase.

    Returns:
        (x_dot [m/s], y_dot [m/s], heading_dot [rad/s]).
    """
    return (
        state.speed * math.cos(state.heading),
        state.speed * math.sin(state.heading),
        state.speed * math.tan(steering_angle) / vehicle.wheelbase,
    )
