"""The background traffic of a scenario: its demand and its route file."""

from pathlib import Path

from experiments.config import Scenario, SumoTraffic
from experiments.config.traffic import DENSITIES, Traffic
from experiments.cosim.sumo.cooperation import CooperationSettings
from experiments.cosim.sumo.driver_errors import DriverErrorSettings, Occurrence
from experiments.cosim.sumo.settings import ENTRY_PATIENCE, SlowLeader
from experiments.world_setup.ego_vehicle import ego_type
from experiments.world_setup.road import Layout
from planner.scene import Lanes
from sumo_nets.demand import Demand, write_demand
from sumo_nets.driver_population import POPULATIONS
from sumo_nets.errors import NetworkError
from sumo_nets.network import Network
from sumo_nets.vehicle_types import LEADER, LeaderType

TRAFFIC_FILE = "traffic.rou.xml"  # in the run folder
MINUTES_PER_HOUR = 60.0
BRAKING_LASTS = 0.5, 2.0  # for no reason [s]
STALLING_LASTS = 10.0, 30.0  # [s]
PUSHING_LASTS = 3.0, 10.0  # [s]
HEEDLESS_FOR = 5.0, 20.0  # of red lights, or of who goes first [s]


def write_traffic(
    scenario: Scenario, layout: Layout, network: Network, folder: Path
) -> Path:
    """Write the route file of the background traffic into a folder.

    Raises:
        ConfigError: If the traffic is not possible on this network.
    """
    simulation = scenario.simulation
    file = folder / TRAFFIC_FILE
    end = simulation.warmup_s + ENTRY_PATIENCE + simulation.duration_s
    try:
        ego = ego_type(layout.task.vehicle)
        demand = make_demand(scenario, layout)
        write_demand(network, demand, simulation.seed, 0.0, end, file, ego)
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    return file


def slow_leader(traffic: Traffic | SumoTraffic | None) -> SlowLeader | None:
    """Return the slow leader of the traffic section, None without one."""
    leader = traffic.slow_leader if isinstance(traffic, Traffic) else None
    if leader is None:
        return None
    return SlowLeader(LEADER, leader.gap_m, leader.speed_mps)


def driver_errors(
    traffic: Traffic | SumoTraffic | None, seed: int
) -> DriverErrorSettings | None:
    """Return what the traffic's drivers do wrong, None if nothing.

    Args:
        traffic: The section of the scenario.
        seed: Of the run: the same errors in its repetitions.
    """
    drivers = traffic.drivers if isinstance(traffic, Traffic) else None
    if drivers is None:
        return None
    away = POPULATIONS[drivers.population].glances
    glances = None
    if away is not None:
        often = away.per_minute * MINUTES_PER_HOUR * drivers.distraction
        glances = Occurrence(often, away.shortest, away.longest)
    settings = DriverErrorSettings(
        seed,
        glances,
        drivers.awareness,
        Occurrence(drivers.hard_brakes_per_h, *BRAKING_LASTS),
        drivers.hard_brake_mps2,
        Occurrence(drivers.stalls_per_h, *STALLING_LASTS),
        Occurrence(drivers.cut_ins_per_h, *PUSHING_LASTS),
        Occurrence(drivers.red_lights_per_h, *HEEDLESS_FOR),
        Occurrence(drivers.right_of_way_violations_per_h, *HEEDLESS_FOR),
        drivers.late_mergers,
        drivers.near_ego_factor,
    )
    return settings if settings.happen else None


def relaxation(traffic: Traffic | SumoTraffic | None) -> float:
    """Return how long followers take to have their time gap back [s]."""
    return traffic.relaxation_s if isinstance(traffic, Traffic) else 0.0


def cooperation(
    traffic: Traffic | SumoTraffic | None, seed: int
) -> CooperationSettings | None:
    """Return which drivers open gaps for the ego, None if nobody does."""
    drivers = traffic.drivers if isinstance(traffic, Traffic) else None
    if drivers is None or drivers.cooperation == 0.0:
        return None
    return CooperationSettings(seed, drivers.cooperation)


def make_demand(scenario: Scenario, layout: Layout) -> Demand:
    """Make the demand of the traffic section; no vehicles without flows.

    Raises:
        ConfigError: If the density is of a road without lanes.
    """
    return make_flows(scenario, _lanes_at_start(layout.road.lanes))


def make_flows(scenario: Scenario, n_lanes: int | None = None) -> Demand:
    """Make the demand; see `make_demand`.

    Args:
        scenario: Checked.
        n_lanes: Of the ego's road where it begins; None: there is no single ego.
    """
    traffic = scenario.traffic
    if not isinstance(traffic, Traffic):
        return Demand()
    left_out = {"density", "temper", "slow_leader", "reaction_s"}
    left_out |= {"drivers", "relaxation_s"}
    fields = traffic.model_dump(exclude_none=True, exclude=left_out)
    fields["reaction"] = traffic.reaction_s
    if traffic.drivers is not None:
        fields["population"] = traffic.drivers.population
    if "models" in fields:
        fields["models"] = tuple(fields["models"].items())
    if traffic.density is not None:
        n_fed = 1 if traffic.own_lane is not None else n_lanes
        if n_fed is None:
            problem = "is of the lanes of an ego's road; allowed: own_veh_per_h"
            raise scenario.error(("traffic", "density"), problem)
        if n_fed == 0:
            problem = "is of a road without lanes; allowed: own_veh_per_h"
            raise scenario.error(("traffic", "density"), problem)
        fields["own_veh_per_h"] = DENSITIES[traffic.density] * n_fed
    leader = traffic.slow_leader
    if leader is not None:
        fields["leader"] = LeaderType(leader.kind, leader.speed_mps)
    return Demand(**fields)


def _lanes_at_start(lanes: Lanes) -> int:
    """Count the lanes where the road begins."""
    return int((lanes.at(float(lanes.s[0]))[1] > 0.0).sum())
