"""Starts SUMO, and checks that it has what the settings speak of."""

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.settings import (
    EGO_TYPE,
    FleetSettings,
    SumoSettings,
    command_line,
)
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.errors import ConfigError, SimulationError
from planner.vehicle import Vehicle
from sumo_nets.demand_files import explained_refusal
from sumo_nets.demand_records import DemandFiles
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import check_complete

# What SUMO speaks of where it does not read what was written for it.
WRITTEN = r"\b(vehicle|vType|route|option|additional)\b"
TOLD = 3  # errors of SUMO; what follows comes of them for the most part


def ready_libsumo(net_file: Path) -> Libsumo:
    """Return libsumo, which can be started on a network.

    Raises:
        SimulationError: If it cannot be loaded, is in use, or would die of the file.
    """
    sumo = load_libsumo()
    try:
        check_complete(net_file)
    except NetworkError as error:
        raise SimulationError(str(error)) from error
    if sumo.isLoaded():
        raise SimulationError("this process already runs a simulation: close it")
    return sumo


def start(sumo: Libsumo, settings: SumoSettings | FleetSettings) -> None:
    """Start SUMO on the settings' files.

    Raises:
        ConfigError: If it refuses the network or the user's own demand; in its words,
            with the file.
        SimulationError: If it does not read what was written for it.
    """
    command, demand = command_line(settings), settings.demand
    with tempfile.TemporaryFile() as said:
        try:
            with _stderr_to(said.fileno()):
                sumo.start(command)
        except (sumo.TraCIException, sumo.FatalTraCIError) as error:
            others, words = split_messages(_text(said))
            sys.stderr.write(others)
            words = words or " ".join(str(error).split())
            if demand is None and re.search(WRITTEN, words):
                raise SimulationError(f"SUMO failed while starting: {words}") from error
            if demand is not None:
                raise ConfigError(explained_refusal(demand, words)) from error
            raise ConfigError(
                f"{settings.net_file}: SUMO does not load it: {words}; rebuild it by "
                "netconvert, or take another network"
            ) from error
        sys.stderr.write(_text(said))


def split_messages(text: str) -> tuple[str, str]:
    """Split what was written to stderr while SUMO failed.

    Returns:
        What is not SUMO's, and the first of SUMO's errors in one line.
    """
    others, *errors = re.split(r"^Error: ", text, flags=re.MULTILINE)
    words = [" ".join(error.split()).rstrip(".") for error in errors]
    # the name of its exception is no news
    told = list(dict.fromkeys(word for word in words if word != "Process Error"))
    more = f"; and {len(told) - TOLD} more" if len(told) > TOLD else ""
    return others, "; ".join(told[:TOLD]) + more


@contextmanager
def refusals_of(demand: DemandFiles | None) -> Iterator[None]:
    """Take what SUMO fails on for a mistake in a user's demand, if there is one.

    Raises:
        ConfigError: Instead of a SimulationError.
    """
    try:
        yield
    except SimulationError as error:
        if demand is None:
            raise
        raise ConfigError(explained_refusal(demand, str(error))) from error


def check_ego_type(sumo: Libsumo, vehicle: Vehicle) -> None:
    """Raise if the ego's SUMO type has another size than the ego.

    Raises:
        SimulationError: If it has.
    """
    types, name = sumo.vehicletype, EGO_TYPE
    size = (types.getLength(name), types.getWidth(name))
    if not np.allclose(size, (vehicle.length, vehicle.width), atol=1e-3):
        raise SimulationError(
            f"vehicle type {name!r} measures {size[0]:g} x {size[1]:g} m, "
            f"the ego {vehicle.length:g} x {vehicle.width:g} m"
        )


def _text(file: IO[bytes]) -> str:
    """Return all that was written to a file."""
    file.seek(0)
    return file.read().decode(errors="replace")


@contextmanager
def _stderr_to(descriptor: int) -> Iterator[None]:
    """Let what anybody writes to stderr, also SUMO, go to a file."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        os.dup2(descriptor, 2)
        yield
    finally:
        sys.stderr.flush()
        os.dup2(kept, 2)
        os.close(kept)
