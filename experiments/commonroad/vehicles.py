"""Vehicles of the solutions, by their published numbers."""

from typing import Final, NamedTuple

from experiments.errors import ConfigError

TOLERANCE: Final = 1e-3  # of a length [m]


class SolutionVehicle(NamedTuple):
    """Numbers of a vehicle of [CommonRoad]; its centre of gravity is its middle."""

    number: int
    name: str
    length: float  # [m]
    width: float
    front: float  # front axle to centre of gravity [m]
    rear: float  # rear axle to it [m]
    max_speed: float  # [m/s]

    @property
    def wheelbase(self) -> float:
        """Distance of the axles [m]."""
        return self.front + self.rear

    @property
    def rear_overhang(self) -> float:
        """Rear axle to rear bumper [m]."""
        return 0.5 * self.length - self.rear


VEHICLES: Final = (
    SolutionVehicle(1, "Ford Escort", 4.298, 1.674, 0.88392, 1.50876, 45.8),
    SolutionVehicle(2, "BMW 320i", 4.508, 1.61, 1.1561957064, 1.4227170936, 50.8),
    SolutionVehicle(3, "VW Vanagon", 4.569, 1.844, 1.1507916024, 1.3211363976, 41.7),
)
DEFAULT: Final = VEHICLES[1]


def vehicle_of(
    length: float, width: float, wheelbase: float, rear_overhang: float
) -> SolutionVehicle:
    """Return the published vehicle of these lengths [m].

    Raises:
        ConfigError: If there is none.
    """
    own = (length, width, wheelbase, rear_overhang)
    for vehicle in VEHICLES:
        lengths = (
            vehicle.length,
            vehicle.width,
            vehicle.wheelbase,
            vehicle.rear_overhang,
        )
        if all(abs(a - b) < TOLERANCE for a, b in zip(own, lengths, strict=True)):
            return vehicle
    allowed = ", ".join(
        f"{v.number} ({v.name}: {v.length:g} x {v.width:g} m)" for v in VEHICLES
    )
    raise ConfigError(
        f"ego.vehicle: is {length:g} x {width:g} m, no vehicle of CommonRoad; "
        f"allowed: {allowed}"
    )
