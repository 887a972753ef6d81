"""The network of a scenario, and the ego's route: drawn where none is named."""

import logging
from collections.abc import Sequence
from pathlib import Path
from zlib import crc32

import numpy as np

from experiments.config import Ego, Scenario
from experiments.world_setup.demand_files import taken_vehicle
from experiments.world_setup.driven_path import NoPathError
from experiments.world_setup.road import BEYOND_GOAL, sumo_road
from planner.errors import PlannerError
from sumo_nets import catalogue
from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import choose_lanes, replaced_start, via_lanes
from sumo_nets.map_files import is_map, missing_parts, network_of_map
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.network import Network
from sumo_nets.route_check import check_route
from sumo_nets.routes import fastest_route, random_route

DRAWN = 12  # random routes that are tried ...

DRAWN_AT_MOST = 200  # ... of those drawn that avoid bends found to be impossible

FRONT_ROOM = 2.0  # before the ego on the first edge of a random route [m]


log = logging.getLogger(__name__)


def scenario_network(scenario: Scenario) -> Network:
    """Return the network of the scenario.

    Raises:
        ConfigError: If the scenario has none.
        NetworkError: If the network, its route or lane does not exist.
    """
    choice = scenario.network
    if choice is None:
        raise scenario.error(("network",), "is missing")
    if choice.file is None:
        return catalogue.network(choice.name or "")
    net = read_net(_network_file(Path(choice.file)))
    taken = taken_vehicle(scenario, net)
    if taken is not None:
        return _of_route(net, taken.route, choice.lane)
    if choice.route is not None:
        return _of_route(net, choice.route, choice.lane)
    if choice.from_ is not None and choice.to is not None:
        places = (choice.from_, *(choice.via or ()), choice.to)
        return _of_route(net, fastest_route(net, places), choice.lane)
    return random_network(net, scenario.simulation.seed, scenario.ego)


def _network_file(file: Path) -> Path:
    """Return the network of a file; a map is converted, and what is lost is told."""
    if not is_map(file):
        return file
    converted = network_of_map(file)
    for lost in missing_parts(file, read_net(converted)):
        log.warning("%s", lost)
    return converted


def _of_route(net: Net, route: Sequence[str], lane: int | None) -> Network:
    """Return a network with a route; without a lane from the first one for cars.

    Where the route begins in another lane than the one asked for, the log says why.
    """
    check_route(net, route, lane)
    if lane is None:
        lane = net.edges[route[0]].drivable_lanes[0].index
    else:
        replaced = replaced_start(net, route, lane)
        if replaced is not None:
            log.warning("%s", replaced)
    return Network.from_file(net.file, route, lane)


def random_network(net: Net, seed: int, ego: Ego) -> Network:
    """Draw routes until the ego can drive one.

    Args:
        net: The network.
        seed: The same seed draws the same route.
        ego: Its goal is on the route.

    Raises:
        NetworkError: If there is no route, or the ego can drive none of those drawn.
    """
    rng = np.random.default_rng([seed, crc32(b"route")])
    vehicle = ego.vehicle.to_planner()
    first = ego.start_m + vehicle.front_reach + FRONT_ROOM
    refused, impossible, tried = "", set[str](), 0
    for _ in range(DRAWN_AT_MOST):
        route = random_route(net, rng, ego.goal + BEYOND_GOAL, first)
        try:
            network = _of_route(net, route, None)
            if impossible and not impossible.isdisjoint(_lanes_of(net, network)):
                continue
            tried += 1
            sumo_road(network, vehicle, ego.start_m)
        except NoPathError as error:
            refused = str(error)
            impossible.add(error.lane)
        except (NetworkError, PlannerError) as error:
            refused = str(error)
        else:
            return network
        if tried >= DRAWN:
            break
    raise NetworkError(
        f"{net.file}: the ego can drive none of {tried} random routes; the last one: "
        f"{refused.removeprefix(f'{net.file}: ')}"
    )


def _lanes_of(net: Net, network: Network) -> set[str]:
    """List the lanes of a route, those inside junctions too."""
    uses = choose_lanes(net, network.route, network.lane)
    inside = [x for use in uses if use.link for x in via_lanes(net, use.link)]
    edges = [lane for use in uses for lane in (use.entered, use.left)]
    return {lane.id for lane in (*inside, *edges)}
