"""The scenario of a bare network file: a random route with some traffic."""

from pathlib import Path
from types import MappingProxyType

import numpy as np

from experiments.config.sections import scenario_name
from experiments.config.traffic import FILES
from experiments.config.yaml_reader import Document, Plain
from experiments.errors import ConfigError
from sumo_nets.errors import NetworkError
from sumo_nets.map_files import is_map, network_of_map
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.routes import random_route
from sumo_nets.sumocfg import read_sumocfg

NETWORK_FILES = (".net.xml", ".net.xml.gz")
SIMULATION = ".sumocfg"
GOALS = (300.0, 180.0, 100.0, 50.0, 30.0)  # the first that the network has room for [m]
BEYOND_GOAL = 30.0  # a route goes on behind the goal [m]
FLOW = 300.0  # each way [veh/h]
CROSSING = 100.0  # on each other road into the junctions of the route [veh/h]
USUAL_FLOWS = MappingProxyType(
    {"own_veh_per_h": FLOW, "oncoming_veh_per_h": FLOW, "cross_veh_per_h": CROSSING}
)


def is_network_file(name: str) -> bool:
    """Tell whether a name is that of a SUMO network, a map, or a simulation."""
    return name.endswith((*NETWORK_FILES, SIMULATION)) or is_map(name)


def network_document(name: str) -> Document:
    """Make the scenario of a network file: which route it is decides the seed.

    A map is converted; of a simulation's configuration network and traffic are taken.
    The goal follows once the options are known, which may name a route.

    Raises:
        ConfigError: If the network cannot be read.
    """
    path = source = Path(name)
    traffic: dict[str, Plain] = dict(USUAL_FLOWS)
    try:
        if name.endswith(SIMULATION):
            traffic = {"sumocfg": str(path.resolve())}
            path = source = _network_of_simulation(path)
        if is_map(name):
            path = network_of_map(path)
        read_net(path)
    except NetworkError as error:
        raise ConfigError(str(error)) from error
    stem = Path(name).name
    for suffix in (".gz", ".xml", ".net", ".osm", ".xodr", SIMULATION):
        stem = stem.removesuffix(suffix)
    data: dict[str, Plain] = {
        "name": scenario_name(stem),
        "network": {"file": str(source.resolve())},
        "traffic": traffic,
    }
    return Document(name, data)


def drop_usual_flows(document: Document) -> None:
    """Take the usual flows out of a bare network's scenario that got a demand.

    Flows that an option asks for stay; they do not go with a demand, as ever.
    """
    traffic = document.data.get("traffic") if isinstance(document.data, dict) else None
    if not is_network_file(document.name) or not isinstance(traffic, dict):
        return
    if any(traffic.get(key) is not None for key in FILES):
        for key in USUAL_FLOWS:
            if ("traffic", key) not in document.places:
                traffic.pop(key, None)


def _network_of_simulation(file: Path) -> Path:
    """Return the network that a .sumocfg names.

    Raises:
        NetworkError: If it names none, or no demand.
    """
    found = read_sumocfg(file).net_file
    if found is None:
        raise NetworkError(f"{file}: names no net-file: there is no network in it")
    return found


def drawn_goal(net: Net, start: float = 0.0) -> float:
    """Return the goal of an ego on a random route [m], which starts at `start` [m].

    Raises:
        NetworkError: If the network has no room for a route.
    """
    for goal in GOALS:
        try:
            random_route(net, np.random.default_rng(0), start + goal + BEYOND_GOAL)
        except NetworkError:
            continue
        return start + goal
    shortest = start + GOALS[-1] + BEYOND_GOAL
    raise NetworkError(
        f"{net.file}: no route of {shortest:g} m for cars was found "
        f"among {len(net.roads)} edges; name one in a scenario file"
    )
