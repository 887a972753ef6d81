"""Demand that comes in SUMO's own files, and who drives in it."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class DemandFiles:
    """Files of a demand, and when and how SUMO is to run them."""

    route_files: tuple[Path, ...]
    additional_files: tuple[Path, ...] = ()
    begin: float = 0.0  # [s]
    options: tuple[tuple[str, str], ...] = ()  # of SUMO's command line
    net_file: Path | None = None  # that the demand was made for, if it says so

    @property
    def files(self) -> tuple[Path, ...]:
        """All files."""
        return (*self.route_files, *self.additional_files)


@dataclass(frozen=True, slots=True)
class NamedVehicle:
    """A vehicle of a route file."""

    id: str
    depart: float  # [s]
    route: tuple[str, ...]  # edges; of a trip: from, via, to
    whole: bool  # whether the route is complete, not only places on it
