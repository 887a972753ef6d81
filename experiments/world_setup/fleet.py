"""From a scenario with many egos to their world, their selection and their roads."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from experiments.config import Scenario, SumoTraffic
from experiments.config.egos import EgoGroup
from experiments.cosim.fleet.records import EnteredVehicle
from experiments.cosim.fleet.selection import EgoSelection, GroupShare
from experiments.cosim.fleet.ways import EgoWay, NoWayError
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.sumo.fleet_world import SumoFleetWorld
from experiments.cosim.sumo.settings import BEGIN, FleetSettings
from experiments.world_setup.demand_files import checked_demand
from experiments.world_setup.road import sumo_road
from experiments.world_setup.scenario_network import scenario_network
from experiments.world_setup.traffic import TRAFFIC_FILE, make_flows
from experiments.world_setup.world import random_stream
from planner.errors import PlannerError
from planner.reference_path.path import ReferencePath
from planner.scene import SpeedLimits
from planner.vehicle import Vehicle, VehicleLimits
from sumo_nets.demand import DemandVehicle, write_demand
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network

BODY = Vehicle()  # whose proportions an ego has
END_ROOM = 1.0  # from the front bumper of an ego that has arrived to the end [m]
ROOM_AHEAD = 80.0  # of a road that is laid out in parts, for plans [m]


def fleet_network(scenario: Scenario) -> Network:
    """Return the network of a scenario with many egos.

    Raises:
        ConfigError: If it does not exist.
    """
    try:
        network = scenario_network(scenario)
        network.check()
    except NetworkError as error:
        raise scenario.error(("network",), str(error)) from error
    return network


def make_fleet_world(
    scenario: Scenario, network: Network, folder: Path
) -> SumoFleetWorld:
    """Write the traffic and make the world of it; nothing runs yet.

    Args:
        scenario: Checked.
        network: Of the scenario.
        folder: Where the route file of the traffic goes.

    Raises:
        ConfigError: If the traffic is not possible on this network, or nobody in it
            could be an ego.
    """
    simulation = scenario.simulation
    demand = checked_demand(scenario, network.net_file)
    end = simulation.warmup_s + simulation.duration_s
    file = folder / TRAFFIC_FILE
    try:
        flows = make_flows(scenario)
        vehicles = write_demand(network, flows, simulation.seed, 0.0, end, file)
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    _check_names(scenario, vehicles)
    settings = FleetSettings(
        net_file=network.net_file,
        route_file=file,
        step=simulation.step_s,
        seed=random_stream(simulation.seed, simulation.repetition),
        warm_up=simulation.warmup_s,
        begin=BEGIN if demand is None else demand.begin,
        demand=demand,
        ghost=simulation.ghost,
        lane_change_guard=simulation.lane_change_guard,
    )
    left_hand = read_net(network.net_file).left_hand
    return SumoFleetWorld(settings, left_hand=left_hand)


def _check_names(scenario: Scenario, vehicles: tuple[DemandVehicle, ...]) -> None:
    """Raise if a group is of types or flows that the own traffic does not have."""
    if isinstance(scenario.traffic, SumoTraffic):
        return  # its vehicles are known when SUMO has read the files
    types = {vehicle.type.id for vehicle in vehicles}
    flows = {vehicle.id.rpartition(".")[0] for vehicle in vehicles}
    ids = {vehicle.id for vehicle in vehicles}
    for number, group in enumerate(scenario.egos or ()):
        for name in group.of or ():
            if name in types or name in flows or name in ids:
                continue
            known = ", ".join(sorted(flows) + sorted(types))
            one = len(scenario.egos or ()) == 1
            path = ("egos", "of") if one else ("egos", number, "of")
            raise scenario.error(path, f"is {name}; allowed: {known}")


def ego_selection(scenario: Scenario) -> EgoSelection:
    """Return what chooses the egos of a scenario."""
    groups = [GroupShare(x.of, x.penetration, x.count) for x in scenario.egos or ()]
    return EgoSelection(groups, scenario.simulation.seed)


@dataclass(slots=True)
class FleetRoads:
    """Lays out the ways of egos; the road of a route is made once.

    A road leads from the ego's present edge as far as no edge comes twice: where a
    route goes in circles, places on a road of several rounds would have no meaning.
    """

    net_file: Path
    groups: tuple[EgoGroup, ...]
    _roads: dict[tuple[object, ...], Road | str] = field(default_factory=dict)
    _bodies: dict[tuple[str, float, float], Vehicle] = field(default_factory=dict)
    # of roads that differ in bodies only the paths are one: so are the predictions
    _paths: dict[bytes, ReferencePath] = field(default_factory=dict)

    def __call__(self, vehicle: EnteredVehicle, group: int) -> EgoWay:
        """Return the way of a vehicle from its present edge on.

        Raises:
            NoWayError: If there is none for its body.
        """
        body, settings = self._body(vehicle), self.groups[group]
        edges = _without_repeats(vehicle.route[vehicle.edge :])
        goes_on = vehicle.edge + len(edges) < len(vehicle.route)
        # a road knows the size of a body, not how fast its driver wants to be
        size = (body.length, body.width)
        key = (edges, vehicle.lane, size, settings.speed_factor)
        if key not in self._roads:
            self._roads[key] = self._road(edges, vehicle.lane, body, settings)
        road = self._roads[key]
        if isinstance(road, str):
            raise NoWayError(road)
        length = road.path.length
        fastest = body.limits.max_speed
        if settings.target_speed_mps is not None:
            fastest = min(fastest, settings.target_speed_mps)
        if goes_on:
            task = EgoTask(body, float("inf"), fastest)
            return EgoWay(road, task, max(length - ROOM_AHEAD, 0.5 * length))
        goal = length - body.front_reach - END_ROOM
        return EgoWay(road, EgoTask(body, goal, fastest))

    def _body(self, vehicle: EnteredVehicle) -> Vehicle:
        """Return the body of a vehicle: its size, and the proportions of `BODY`."""
        key = (vehicle.type, vehicle.length, vehicle.width)
        if key not in self._bodies:
            scale = vehicle.length / BODY.length
            limits = VehicleLimits(
                max_speed=vehicle.max_speed,
                max_acceleration=min(
                    BODY.limits.max_acceleration, vehicle.acceleration
                ),
            )
            self._bodies[key] = Vehicle(
                vehicle.length,
                vehicle.width,
                BODY.wheelbase * scale,
                BODY.rear_overhang * scale,
                limits,
            )
        return self._bodies[key]

    def _road(
        self, edges: tuple[str, ...], lane: int, body: Vehicle, group: EgoGroup
    ) -> Road | str:
        """Read a road, or say why it cannot be driven."""
        network = Network("", self.net_file, edges, lane, (), "")
        try:
            road = sumo_road(network, body)
        except (NetworkError, PlannerError) as error:
            return str(error)
        limits = road.speed_limits
        faster = SpeedLimits(limits.s, limits.limit * group.speed_factor)
        key = road.path.table.knots.tobytes()
        path = self._paths.setdefault(key, road.path)
        return replace(road, path=path, speed_limits=faster)


def _without_repeats(edges: tuple[str, ...]) -> tuple[str, ...]:
    """Return the edges up to where one comes for the second time."""
    for number, edge in enumerate(edges):
        if edge in edges[:number]:
            return edges[:number]
    return edges
