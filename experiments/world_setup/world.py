"""From a scenario and its layout to a world."""

from dataclasses import replace
from pathlib import Path

from experiments.config import Scenario
from experiments.cosim.kinematic_world import KinematicWorld, ScriptedVehicle
from experiments.cosim.sumo.conflict_world import SumoConflictWorld
from experiments.cosim.sumo.settings import SumoSettings
from experiments.cosim.sumo.sumo_driver import SumoDriverWorld
from experiments.cosim.sumo.without_ego import WithoutEgoWorld
from experiments.cosim.sumo.world import SumoWorld
from experiments.cosim.world import World
from experiments.world_setup.conflict import conflict_world, scripted_motions
from experiments.world_setup.road import Layout
from experiments.world_setup.traffic import TRAFFIC_FILE, slow_leader, write_traffic
from sumo_nets.catalogue import Network

SUMO_DRIVER = "sumo"  # the planner that is SUMO's own driver


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


def _kinematic_world(scenario: Scenario, layout: Layout) -> World:
    """Make a world without a simulator."""
    if scenario.planner.name == SUMO_DRIVER:
        problem = "is SUMO's own driver; allowed: any other planner in world kinematic"
        raise scenario.error(("planner",), problem)
    if scenario.conflict is not None:
        return conflict_world(scenario, scenario.conflict, layout)
    vehicles = [
        ScriptedVehicle(
            f"vehicle.{n}", v.s_m, v.l_m, v.speed_mps, v.length_m, v.width_m
        )
        for n, v in enumerate(scenario.vehicles)
    ]
    step = scenario.simulation.step_s
    return KinematicWorld(layout.road, layout.task, vehicles, step)


def _sumo_world(
    scenario: Scenario, layout: Layout, network: Network, folder: Path, *, gui: bool
) -> SumoWorld:
    """Write the traffic and make the world of it."""
    route_file = write_traffic(scenario, layout, network, folder)
    settings = _sumo_settings(scenario, layout, network, route_file)
    settings = replace(settings, gui=gui)
    driven_by_sumo = scenario.planner.name == SUMO_DRIVER
    if scenario.conflict is not None:
        if driven_by_sumo:
            problem = "is SUMO's own driver; allowed with a conflict: any other planner"
            raise scenario.error(("planner",), problem)
        motions = scripted_motions(scenario, scenario.conflict, layout)
        return SumoConflictWorld(settings, motions)
    return SumoDriverWorld(settings) if driven_by_sumo else SumoWorld(settings)


def make_world_without_ego(
    scenario: Scenario, layout: Layout, folder: Path
) -> WithoutEgoWorld:
    """Make the world of the same seed without the ego; see `make_world`.

    Raises:
        ConfigError: If no vehicle in the scenario's world would react to an ego.
    """
    if layout.network is None:
        problem = "is for world sumo, where vehicles react; allowed: false"
        raise scenario.error(("simulation", "without_ego"), problem)
    route_file = folder / TRAFFIC_FILE
    settings = _sumo_settings(scenario, layout, layout.network, route_file)
    return WithoutEgoWorld(settings)


def _sumo_settings(
    scenario: Scenario, layout: Layout, network: Network, route_file: Path
) -> SumoSettings:
    """Collect the settings of the SUMO world."""
    simulation = scenario.simulation
    return SumoSettings(
        net_file=network.net_file,
        route_file=route_file,
        route=network.route,
        road=layout.road,
        task=layout.task,
        leader=slow_leader(scenario.traffic),
        step=simulation.step_s,
        seed=simulation.seed,
        warm_up=simulation.warmup_s,
    )
