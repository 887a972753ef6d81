"""Starts SUMO, and checks that it has what the settings speak of."""

from pathlib import Path

import numpy as np

from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.settings import EGO_TYPE
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.errors import SimulationError
from planner.vehicle import Vehicle
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import check_complete


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
