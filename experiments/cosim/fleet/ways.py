"""The roads of egos, as far as they are laid out."""

import math
from dataclasses import dataclass
from typing import Protocol

from experiments.cosim.fleet.records import EnteredVehicle
from experiments.cosim.road import EgoTask, Road
from experiments.errors import ExperimentError


class NoWayError(ExperimentError):
    """A vehicle cannot be an ego: its route has no path for its body."""


@dataclass(frozen=True, slots=True, eq=False)
class EgoWay:
    """The road of an ego as far as it is laid out, and its task there."""

    road: Road
    task: EgoTask
    renew_at: float = math.inf  # arc length from where on the next part is needed [m]


class WayFinder(Protocol):
    """Lays out the roads of egos."""

    def __call__(self, vehicle: EnteredVehicle, group: int) -> EgoWay:
        """Return the way of a vehicle from its present edge on.

        Raises:
            NoWayError: If it cannot be driven.
        """
        ...
