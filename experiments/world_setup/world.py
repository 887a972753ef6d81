"""From a scenario and its layout to a world: who moves, and by whom."""

from dataclasses import replace
from pathlib import Path

from experiments.config import Scenario
from experiments.config.traffic import DENSITIES, Traffic
from experiments.cosim.kinematic_world import (
    KinematicSettings,
    KinematicWorld,
    ScriptedVehicle,
)
from experiments.cosim.sumo.settings import SlowLeader, SumoSettings
from experiments.cosim.sumo.sumo_driver import SelfDrivenWorld
from experiments.cosim.sumo.without_ego import EgolessWorld
from experiments.cosim.sumo.world import SumoWorld
from experiments.cosim.world import World
from experiments.world_setup.layout import Layout, make_vehicle
from sumo_nets.catalogue import Network
from sumo_nets.demand import Demand, write_demand
from sumo_nets.errors import NetworkError
from sumo_nets.vehicle_types import LEADER, EgoType, LeaderType

TRAFFIC_FILE = "traffic.rou.xml"  # the background traffic, in the run folder
SUMO_DRIVER = "sumo"  # the planner that is SUMO's own driver
ENTRY_PATIENCE = 120.0  # how long the ego waits for a gap to enter in [s]


def make_world(
    scenario: Scenario, layout: Layout, folder: Path, *, gui: bool = False
) -> World:
    """Make the world; nothing runs yet.

    Args:
        scenario: Checked.
        layout: Of the same scenario.
        folder: Where the route file of the traffic goes.
        gui: Show SUMO's window.

    Returns:
        The world, which the caller closes.

    Raises:
        ConfigError: If the traffic is not possible on this network.
    """
    if layout.network is None:
        return _kinematic_world(scenario, layout)
    return _sumo_world(scenario, layout, layout.network, folder, gui=gui)


def _kinematic_world(scenario: Scenario, layout: Layout) -> KinematicWorld:
    """Make a world without a simulator."""
    if scenario.planner.name == SUMO_DRIVER:
        problem = "is SUMO's own driver; allowed: any other planner in world kinematic"
        raise scenario.error(("planner",), problem)
    ego = scenario.ego
    wanted = ego.depart_speed_mps
    vehicles = tuple(
        ScriptedVehicle(
            f"vehicle.{n}", v.s_m, v.l_m, v.speed_mps, v.length_m, v.width_m
        )
        for n, v in enumerate(scenario.vehicles)
    )
    return KinematicWorld(
        KinematicSettings(
            path=layout.path,
            road=layout.road,
            start_speed=ego.target_speed_mps if wanted == "max" else wanted,
            start_s=ego.start_m,
            start_offset=ego.start_offset_m,
            obstacles=layout.obstacles,
            vehicles=vehicles,
            step=scenario.simulation.step_s,
        )
    )


def _sumo_world(
    scenario: Scenario, layout: Layout, network: Network, folder: Path, *, gui: bool
) -> SumoWorld:
    """Write the traffic and make the world of it."""
    settings = _sumo_settings(
        scenario, layout, network, _write_traffic(scenario, layout, network, folder)
    )
    settings = replace(settings, gui=gui)
    if scenario.planner.name == SUMO_DRIVER:
        return SelfDrivenWorld(settings, scenario.ego.target_speed_mps)
    return SumoWorld(settings)


def make_egoless_world(
    scenario: Scenario, layout: Layout, folder: Path
) -> EgolessWorld:
    """Make the world of the same seed without the ego; see `make_world`.

    Raises:
        ConfigError: If nobody in the scenario's world would react to an ego.
    """
    if layout.network is None:
        problem = "is for world sumo, where vehicles react; allowed: false"
        raise scenario.error(("simulation", "without_ego"), problem)
    route_file = folder / TRAFFIC_FILE
    return EgolessWorld(_sumo_settings(scenario, layout, layout.network, route_file))


def _sumo_settings(
    scenario: Scenario, layout: Layout, network: Network, route_file: Path
) -> SumoSettings:
    """Say what the SUMO world is made of."""
    ego, simulation = scenario.ego, scenario.simulation
    wanted = ego.depart_speed_mps
    return SumoSettings(
        net_file=network.net_file,
        route_file=route_file,
        route=network.route,
        path=layout.path,
        road=layout.road,
        vehicle=make_vehicle(ego),
        start_s=ego.start_m,
        start_offset=ego.start_offset_m,
        start_speed=None if wanted == "max" else wanted,
        leader=_slow_leader(scenario.traffic),
        obstacles=layout.obstacles,
        stop_lines=layout.stop_lines,
        step=simulation.step_s,
        seed=simulation.seed,
        warm_up=simulation.warmup_s,
        entry_patience=ENTRY_PATIENCE,
    )


def _slow_leader(traffic: Traffic | None) -> SlowLeader | None:
    """Say where the slow leader enters, if there is one."""
    leader = traffic.slow_leader if traffic is not None else None
    if leader is None:
        return None
    return SlowLeader(LEADER, leader.gap_m, leader.speed_mps)


def _write_traffic(
    scenario: Scenario, layout: Layout, network: Network, folder: Path
) -> Path:
    """Write the route file of the background traffic."""
    simulation, limits = scenario.simulation, scenario.ego.vehicle.limits
    file = folder / TRAFFIC_FILE
    end = simulation.warmup_s + ENTRY_PATIENCE + simulation.duration_s
    try:
        ego_type = EgoType(
            scenario.ego.vehicle.length_m,
            scenario.ego.vehicle.width_m,
            limits.max_deceleration_mps2,
            limits.emergency_deceleration_mps2,
            limits.max_speed_mps,
        )
        demand = make_demand(scenario, layout)
        write_demand(network, demand, simulation.seed, 0.0, end, file, ego_type)
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    return file


def make_demand(scenario: Scenario, layout: Layout) -> Demand:
    """Make the demand of the traffic section; no vehicles without one.

    Raises:
        ConfigError: If the density is of a road without lanes.
    """
    traffic = scenario.traffic
    if traffic is None:
        return Demand()
    left_out = {"density", "temper", "slow_leader"}
    fields = traffic.model_dump(exclude_none=True, exclude=left_out)
    if "models" in fields:
        fields["models"] = tuple(fields["models"].items())
    if traffic.density is not None:
        n_fed = 1 if traffic.own_lane is not None else _lanes_at_start(layout)
        if n_fed == 0:
            problem = "is of a road without lanes; allowed: own_veh_per_h"
            raise scenario.error(("traffic", "density"), problem)
        fields["own_veh_per_h"] = DENSITIES[traffic.density] * n_fed
    leader = traffic.slow_leader
    if leader is not None:
        fields["leader"] = LeaderType(leader.kind, leader.speed_mps)
    return Demand(**fields)


def _lanes_at_start(layout: Layout) -> int:
    """Count the lanes where the road begins."""
    lanes = layout.lanes
    return int((lanes.at(float(lanes.s[0]))[1] > 0.0).sum())
