"""Goal and time on a user's network: the end of a named route, or some way ahead.

Both are written into the scenario where it is silent, so that a run folder tells them.
"""

import math
from pathlib import Path
from typing import Any

from experiments.config.ego import BODY
from experiments.config.network_scenario import drawn_goal, is_network_file
from experiments.config.road import VEHICLE_OF_FILES
from experiments.config.simulation import Simulation
from experiments.config.traffic import FILES
from experiments.config.yaml_reader import Document, KeyPath
from experiments.errors import ConfigError
from sumo_nets.demand_files import named_vehicle
from sumo_nets.demand_records import DemandFiles
from sumo_nets.errors import NetworkError
from sumo_nets.map_files import is_map, network_of_map
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.route_check import check_route
from sumo_nets.route_path import route_path
from sumo_nets.routes import fastest_route
from sumo_nets.sumocfg import read_sumocfg

GOAL: KeyPath = ("ego", "goal_m")
DURATION: KeyPath = ("simulation", "duration_s")
BY_ROUTE = "the end of the route"  # the place of what is written here, for messages
NAMED_BY = ("vehicle", "from", "to", "route")
END_ROOM = 1.0  # left before the end of the road [m]
# A path is smoothed, and shorter than the lanes by up to this share of their length.
CUT = 0.005
SLOW = 2.5  # mean speed that the ego is given time for, with lights and queues [m/s]
USUAL_DURATION = float(Simulation.model_fields["duration_s"].default)  # [s]
LONGEST_DURATION = 3600.0  # [s]


def complete_goal(document: Document) -> None:
    """Write goal and duration where a scenario in SUMO is silent about them.

    What was written before is written anew: the route may have changed since.

    Raises:
        ConfigError: If the route that it names is not there, or too short to drive.
    """
    data: Any = document.data
    if not isinstance(data, dict) or "egos" in data:
        return
    if data.get("world", "sumo") != "sumo":
        return
    sections = [data.get(key) for key in ("network", "ego", "simulation")]
    network, ego, simulation = ({} if x is None else x for x in sections)
    if not all(isinstance(section, dict) for section in (network, ego, simulation)):
        return  # a network of the catalogue, or no section: the schema says so
    if not isinstance(network.get("file"), str) or _is_given(document, ego, GOAL):
        return
    start = _number(ego.get("start_m"), 0.0)
    try:
        goal = _goal(document, network, ego, start)
    except NetworkError as error:
        where = document.where(("network",))
        raise ConfigError(f"{where}: network: {error}") from error
    if goal is not None:
        _write(document, GOAL, goal)
        if not _is_given(document, simulation, DURATION):
            _write(document, DURATION, usual_duration(goal - start))


def _goal(
    document: Document, network: dict[str, Any], ego: dict[str, Any], start: float
) -> float | None:
    """Return the goal [m], None if the scenario has to say it."""
    is_named = any(network.get(key) is not None for key in NAMED_BY)
    if not is_named and not is_network_file(network["file"]):
        return None  # of another world, perhaps
    net = read_net(_network_file(network["file"]))
    data: Any = document.data
    traffic = data.get("traffic")
    if network.get("vehicle") is not None and _demand(traffic) is None:
        where = document.where(("network", "vehicle"))
        raise ConfigError(f"{where}: network.vehicle: {VEHICLE_OF_FILES}")
    route = _named_route(net, network, traffic)
    if route is None:
        return None if is_named else drawn_goal(net, start)
    length = _length(net, route, network.get("lane"))
    goal = _end(length, ego)
    if goal <= start:
        raise NetworkError(
            f'the route from edge "{route[0]}" to "{route[-1]}" has {length:.1f} m, '
            f"which is too short for an ego that starts at {start:g} m; allowed: a "
            "longer one"
        )
    return goal


def _is_given(document: Document, section: dict[str, Any], key: KeyPath) -> bool:
    """Tell whether a key was written by anybody but this module."""
    given = section.get(str(key[-1])) is not None
    return given and document.places.get(key) != BY_ROUTE


def _write(document: Document, key: KeyPath, value: float) -> None:
    """Write a key into its section, and that it follows from the route."""
    data: Any = document.data
    section, name = key
    data[section] = {**(data.get(section) or {}), name: value}
    document.places[key] = BY_ROUTE


def usual_duration(distance: float) -> float:
    """Return the time that an ego is given for a distance [m], in seconds."""
    return min(max(math.ceil(distance / SLOW), USUAL_DURATION), LONGEST_DURATION)


def _network_file(name: str) -> Path:
    """Return the network of a file; a map is converted."""
    return network_of_map(Path(name)) if is_map(name) else Path(name)


def _named_route(
    net: Net, network: dict[str, Any], traffic: Any
) -> tuple[str, ...] | None:
    """Return the route that a section names; None if it leaves it to chance."""
    vehicle, begin, end = (network.get(key) for key in ("vehicle", "from", "to"))
    if vehicle is not None:
        demand = _demand(traffic)
        return None if demand is None else _vehicle_route(demand, net, str(vehicle))
    if begin is not None and end is not None:
        via = network.get("via")
        between = via if isinstance(via, (list, tuple)) else ()
        return fastest_route(net, [str(edge) for edge in (begin, *between, end)])
    route = network.get("route")
    if not isinstance(route, (list, tuple)) or not route:
        return None
    return tuple(str(edge) for edge in route)


def _vehicle_route(demand: DemandFiles, net: Net, name: str) -> tuple[str, ...]:
    """Return the route of a vehicle of the demand."""
    return named_vehicle(demand, net, name).route


def _demand(traffic: Any) -> DemandFiles | None:
    """Return the demand that a traffic section names, None if it names none."""
    if not isinstance(traffic, dict):
        return None
    if isinstance(traffic.get("sumocfg"), str):
        return read_sumocfg(Path(traffic["sumocfg"]))
    names = [traffic.get(key) for key in FILES[1:]]
    if not isinstance(names[0], (list, tuple)) or not names[0]:
        return None
    return DemandFiles(tuple(Path(str(name)) for name in names[0]))


def _length(net: Net, route: tuple[str, ...], lane: Any) -> float:
    """Return the length of the lanes of a route [m]."""
    check_route(net, route)
    if not isinstance(lane, int):
        lane = net.edges[route[0]].drivable_lanes[0].index
    check_route(net, route, lane)
    return route_path(net.file, route, lane).length


def _end(length: float, ego: dict[str, Any]) -> float:
    """Return where the rear axle is when the front is at the end of the road [m]."""
    vehicle = ego.get("vehicle")
    body = vehicle if isinstance(vehicle, dict) else {}
    front = _number(body.get("length_m"), BODY.length) - _number(
        body.get("rear_overhang_m"), BODY.rear_overhang
    )
    end = (1.0 - CUT) * length - END_ROOM
    return math.floor(10.0 * (end - front)) / 10.0


def _number(value: Any, default: float) -> float:
    """Return a number of the file; the default where it has none, or no such number.

    What is no finite number is left to the schema.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number and math.isfinite(value) else default
