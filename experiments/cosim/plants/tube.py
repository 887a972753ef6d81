"""The tube: bounds of tracking errors by speed and curvature, as measured."""

import json
import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from experiments.cosim.plant import PlannerOutputError
from experiments.cosim.plants.manoeuvres import (
    LATERAL,
    SPACING,
    Manoeuvre,
    manoeuvres,
)
from experiments.cosim.plants.parameters import PlantModel
from experiments.cosim.plants.tracked import PlantSettings, TrackedPlant
from experiments.errors import ConfigError
from planner.states import CartesianState
from planner.vehicle import Vehicle, VehicleLimits

# upper ends of the cells
SPEEDS = (2.5, 5.0, 8.0, 11.0, 14.0, 17.0, 20.0, 25.0, 30.0, 36.0)  # [m/s]
CURVATURES = (0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)  # [1/m]
LARGEST = 5.0  # errors of a vehicle that loses its plan [m]
GRIP_SHARE = 0.8  # of the friction that plans may ask for
STEERING_SHARE = 0.95  # of the largest angle
RATE_SHARE = 0.75  # of the steering's rate; the rest corrects errors
SOURCE = "rearview tube"


@dataclass(frozen=True, slots=True)
class ErrorBounds:
    """Largest errors in a cell."""

    lateral: float  # to either side [m]
    ahead: float  # of the plan [m]
    behind: float  # the plan [m]

    def with_errors(self, lateral: float, behind: float) -> "ErrorBounds":
        """Return bounds that hold these errors, too."""
        return ErrorBounds(
            max(self.lateral, abs(lateral)),
            max(self.ahead, -behind),
            max(self.behind, behind),
        )


NONE = ErrorBounds(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ErrorTube:
    """Error bounds of one vehicle with its actuators and controller."""

    plant: str  # identity of the settings
    cells: dict[tuple[float, float], ErrorBounds]  # upper (speed, curvature) -> bounds

    def upto(self, speed: float) -> ErrorBounds:
        """Return the bounds of all cells that are reached at a speed or below.

        Args:
            speed: [m/s]; above the last cell, that one's bounds hold.
        """
        top = next((v for v in SPEEDS if v >= speed), SPEEDS[-1])
        found = NONE
        for (v, _), bounds in self.cells.items():
            if v <= top:
                found = found.with_errors(bounds.lateral, bounds.behind)
                found = found.with_errors(0.0, -bounds.ahead)
        return found

    def to_json(self) -> str:
        """Return the content of a tube file."""
        rows = [
            {"speed_mps": v, "curvature_1pm": k, **_named(bounds)}
            for (v, k), bounds in sorted(self.cells.items())
        ]
        content = {"source": SOURCE, "plant": self.plant, "cells": rows}
        return json.dumps(content, indent=1) + "\n"


def _named(bounds: ErrorBounds) -> dict[str, float]:
    """Return bounds with the names of a file."""
    return {
        "lateral_m": round(bounds.lateral, 4),
        "ahead_m": round(bounds.ahead, 4),
        "behind_m": round(bounds.behind, 4),
    }


def plant_identity(settings: PlantSettings) -> str:
    """Return a name of the settings that changes with any of them."""
    text = json.dumps(asdict(settings), sort_keys=True, default=str)
    return sha256(text.encode()).hexdigest()[:16]


@lru_cache(maxsize=16)
def measure_tube(settings: PlantSettings) -> ErrorTube:
    """Drive all manoeuvres at all speeds and keep the largest errors."""
    cells: dict[tuple[float, float], ErrorBounds] = {}
    for speed in SPEEDS:
        for one in manoeuvres(speed):
            key = _cell(speed, one)
            driven = _errors(settings, one)
            found = cells.get(key, NONE)
            cells[key] = found.with_errors(driven.lateral, driven.behind)
            cells[key] = cells[key].with_errors(0.0, -driven.ahead)
    return ErrorTube(plant_identity(settings), cells)


def _cell(speed: float, manoeuvre: Manoeuvre) -> tuple[float, float]:
    """Return the upper ends of the cell that a manoeuvre is driven in."""
    curvature = manoeuvre.curvature
    return speed, next((k for k in CURVATURES if k >= curvature), CURVATURES[-1])


def _grid() -> set[tuple[float, float]]:
    """Return all cells of a tube: those that a manoeuvre is driven in."""
    return {_cell(speed, one) for speed in SPEEDS for one in manoeuvres(speed)}


def _errors(settings: PlantSettings, manoeuvre: Manoeuvre) -> ErrorBounds:
    """Drive a manoeuvre; a vehicle that loses its plan has the largest errors."""
    plant, plan = TrackedPlant(settings, SPACING), manoeuvre.plan
    ego = CartesianState(0.0, 0.0, 0.0, 0.0, manoeuvre.speed, 0.0)
    found = NONE
    for k in range(plan.t.size - 1):
        try:
            ego = plant.step(ego, plan, SPACING, SPACING * k)
        except PlannerOutputError:
            return ErrorBounds(LARGEST, LARGEST, LARGEST)
        if plant.report is not None:
            found = found.with_errors(plant.report.lateral, plant.report.behind)
    return found


def read_tube(path: Path, settings: PlantSettings) -> ErrorTube:
    """Read a tube file that belongs to a plant.

    Raises:
        ConfigError: If it cannot be read, is damaged, or is of another plant.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        tube = _restored(content)
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError("is no tube file; allowed: one of rearview tube") from error
    own = plant_identity(settings)
    if tube.plant != own:
        raise ConfigError(
            f"is of another plant ({tube.plant[:8]}, not {own[:8]}); allowed: auto, or "
            "the file that rearview tube writes for this scenario"
        )
    return tube


def _restored(content: Any) -> ErrorTube:
    """Restore a tube from the content of its file."""
    cells = {}
    for row in content["cells"]:
        numbers = [float(row[f"{name}_m"]) for name in ("lateral", "ahead", "behind")]
        if not all(0.0 <= n < np.inf for n in numbers):
            raise ValueError("a bound is not a length")
        key = float(row["speed_mps"]), float(row["curvature_1pm"])
        cells[key] = ErrorBounds(*numbers)
    if set(cells) != _grid():
        raise ValueError("cells are missing, or are not of the grid")
    return ErrorTube(str(content["plant"]), cells)


def planned_vehicle(
    vehicle: Vehicle, settings: PlantSettings, bounds: ErrorBounds, speed: float
) -> Vehicle:
    """Return the body and limits that plans are made with.

    The body grows by the tube; the limits are what the plant can reach.

    Args:
        vehicle: As it is.
        settings: Of its plant.
        bounds: Of its tracking errors.
        speed: Up to which it drives [m/s].
    """
    own, chassis, actuators = vehicle.limits, settings.chassis, settings.actuators
    grip = GRIP_SHARE * settings.grip
    drive = min(chassis.max_acceleration, actuators.drive.largest, grip)
    power = drive * min(1.0, chassis.power_speed / max(speed, 0.1))
    steering = min(chassis.max_steering, actuators.steering.largest)
    rate = min(chassis.max_steering_rate, actuators.steering.rate)
    sharpest = np.tan(STEERING_SHARE * steering) / settings.wheelbase
    # no more than the tube was measured for; without one a vehicle that has no tyres
    # holds the road at any speed
    rolls = settings.model is PlantModel.KINEMATIC and bounds is NONE
    measured = math.inf if rolls else LATERAL[-1]
    return Vehicle(
        vehicle.length + bounds.ahead + bounds.behind,
        vehicle.width + 2.0 * bounds.lateral,
        vehicle.wheelbase,
        vehicle.rear_overhang + bounds.behind,
        VehicleLimits(
            own.max_speed,
            min(own.max_acceleration, power),
            min(own.max_deceleration, drive),
            min(own.emergency_deceleration, drive),
            min(own.max_lateral_acceleration, grip, measured),
            min(own.max_curvature, float(sharpest)),
            min(own.max_curvature_rate, RATE_SHARE * rate / settings.wheelbase),
        ),
    )
