"""From a scenario and its layout to a world: who moves, and by whom."""

from pathlib import Path

from experiments.config import Scenario
from experiments.cosim.kinematic_world import (
    KinematicSettings,
    KinematicWorld,
    ScriptedVehicle,
)
from experiments.cosim.self_driven import SelfDrivenWorld
from experiments.cosim.session import SumoWorld
from experiments.cosim.sumo_settings import SumoSettings
from experiments.cosim.world import World
from experiments.layout import Layout, make_vehicle
from sumo_nets.catalogue import Network
from sumo_nets.demand import Demand, write_demand
from sumo_nets.errors import NetworkError
from sumo_nets.vehicle_types import EgoType

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
    ego, simulation = scenario.ego, scenario.simulation
    vehicle = make_vehicle(ego)
    wanted = ego.depart_speed_mps
    make = SelfDrivenWorld if scenario.planner.name == SUMO_DRIVER else SumoWorld
    return make(
        SumoSettings(
            net_file=network.net_file,
            route_file=_write_traffic(scenario, network, folder),
            route=network.route,
            path=layout.path,
            road=layout.road,
            vehicle=vehicle,
            start_s=ego.start_m,
            start_offset=ego.start_offset_m,
            start_speed=None if wanted == "max" else wanted,
            obstacles=layout.obstacles,
            stop_lines=layout.stop_lines,
            step=simulation.step_s,
            seed=simulation.seed,
            warm_up=simulation.warmup_s,
            entry_patience=ENTRY_PATIENCE,
            gui=gui,
        )
    )


def _write_traffic(scenario: Scenario, network: Network, folder: Path) -> Path:
    """Write the route file of the background traffic."""
    simulation, limits = scenario.simulation, scenario.ego.vehicle.limits
    file = folder / "traffic.rou.xml"
    end = simulation.warmup_s + ENTRY_PATIENCE + simulation.duration_s
    try:
        ego_type = EgoType(
            scenario.ego.vehicle.length_m,
            scenario.ego.vehicle.width_m,
            limits.max_deceleration_mps2,
            limits.emergency_deceleration_mps2,
            limits.max_speed_mps,
        )
        demand = make_demand(scenario)
        write_demand(network, demand, simulation.seed, 0.0, end, file, ego_type)
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    return file


def make_demand(scenario: Scenario) -> Demand:
    """Make the demand of the traffic section; no vehicles without one."""
    traffic = scenario.traffic
    if traffic is None:
        return Demand()
    fields = traffic.model_dump(exclude_none=True)
    if "models" in fields:
        fields["models"] = tuple(fields["models"].items())
    return Demand(**fields)
