"""From a scenario and its layout to a world."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from zlib import crc32

from experiments.config import Scenario
from experiments.config.self_driven import (
    SELF_DRIVEN,
    SUMO,
    SUMO_AS_SHIPPED,
    SUMO_SUBLANE,
    SUMO_TUNED,
)
from experiments.cosim.kinematic_world import KinematicWorld, ScriptedVehicle
from experiments.cosim.replay_world import ReplayWorld
from experiments.cosim.sumo.conflict_world import SumoConflictWorld
from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from experiments.cosim.sumo.settings import BEGIN, SumoSettings
from experiments.cosim.sumo.sumo_driver import SumoDriverWorld
from experiments.cosim.sumo.without_ego import WithoutEgoWorld
from experiments.cosim.sumo.world import SumoWorld
from experiments.cosim.world import World
from experiments.world_setup.closures import closed_lanes
from experiments.world_setup.conflict import conflict_world, scripted_motions
from experiments.world_setup.demand_files import checked_demand, taken_vehicle
from experiments.world_setup.road import Layout
from experiments.world_setup.traffic import (
    TRAFFIC_FILE,
    cooperation,
    driver_errors,
    relaxation,
    slow_leader,
    write_traffic,
)
from experiments.world_setup.tuned_driver import SUBLANE_FILE, tuned_driver
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network

FIRST_PLACEBO = 1_000_001  # repetition that no scenario can have

# SUMO's own driver by the name of its planner; scenarios lay their settings over it.
SUMO_DRIVERS: Mapping[str, SumoDriverSettings] = MappingProxyType(
    {
        SUMO: SumoDriverSettings(),
        SUMO_AS_SHIPPED: SumoDriverSettings(told=False),
        SUMO_TUNED: tuned_driver(),
        SUMO_SUBLANE: tuned_driver(SUBLANE_FILE),
    }
)


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
    if layout.replay is not None:
        return replay_world(scenario, layout)
    if layout.network is None:
        return _kinematic_world(scenario, layout)
    return _sumo_world(scenario, layout, layout.network, folder, gui=gui)


def _refuse_sumo_driver(scenario: Scenario) -> None:
    """Raise if SUMO's own driver is to drive without SUMO."""
    if scenario.planner.name in SELF_DRIVEN:
        problem = (
            "is SUMO's own driver; allowed: any other planner in world "
            f"{scenario.world}"
        )
        raise scenario.error(("planner",), problem)


def replay_world(scenario: Scenario, layout: Layout) -> ReplayWorld:
    """Make the world of a recording.

    Raises:
        ConfigError: If SUMO's own driver is to drive in it, or there is no recording.
    """
    _refuse_sumo_driver(scenario)
    if layout.replay is None:
        raise scenario.error(("world",), "has no recording; allowed: commonroad")
    known = scenario.simulation.predictor == "recorded"
    return ReplayWorld(layout.road, layout.replay, known_future=known)


def _kinematic_world(scenario: Scenario, layout: Layout) -> World:
    """Make a world without a simulator."""
    _refuse_sumo_driver(scenario)
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
    driven_by_sumo = settings.driver is not None
    if scenario.conflict is not None:
        if driven_by_sumo:
            problem = "is SUMO's own driver; allowed with a conflict: any other planner"
            raise scenario.error(("planner",), problem)
        motions = scripted_motions(scenario, scenario.conflict, layout)
        return SumoConflictWorld(settings, motions)
    return SumoDriverWorld(settings) if driven_by_sumo else SumoWorld(settings)


def make_world_without_ego(
    scenario: Scenario, layout: Layout, folder: Path, *, placebo: int | None = None
) -> WithoutEgoWorld:
    """Make the world of the same seed without the ego; see `make_world`.

    Args:
        scenario: Checked.
        layout: Of the same scenario.
        folder: Where the route file of the traffic is.
        placebo: Which one; with other random numbers from the ego's entry on.

    Raises:
        ConfigError: If no vehicle in the scenario's world would react to an ego.
    """
    if layout.network is None:
        problem = "is for world sumo, where vehicles react; allowed: false"
        raise scenario.error(("simulation", "without_ego"), problem)
    route_file = folder / TRAFFIC_FILE
    settings = _sumo_settings(scenario, layout, layout.network, route_file)
    # Nobody is told anything where there is no ego: so planners share more of these.
    closed = closed_lanes(scenario, layout, layout.network, told=False)
    settings = replace(settings, closed=closed)
    if placebo is None:
        return WithoutEgoWorld(settings)
    stream = random_stream(settings.seed, FIRST_PLACEBO + placebo)
    return WithoutEgoWorld(settings, stream, folder)


def random_stream(seed: int, repetition: int) -> int:
    """Return the seed of SUMO's random numbers in a repetition of a run."""
    return seed if repetition == 0 else crc32(f"{seed} {repetition}".encode()) >> 1


def sumo_driver(scenario: Scenario) -> SumoDriverSettings | None:
    """Return the settings of SUMO's driver, None if a planner drives the ego."""
    choice = scenario.planner
    base = SUMO_DRIVERS.get(choice.name)
    return None if base is None else replace(base, **choice.settings)


def _sumo_settings(
    scenario: Scenario, layout: Layout, network: Network, route_file: Path
) -> SumoSettings:
    """Collect the settings of the SUMO world."""
    simulation = scenario.simulation
    driver = sumo_driver(scenario)
    told = driver is not None and driver.told
    demand = checked_demand(scenario, network.net_file)
    begin = BEGIN if demand is None else demand.begin
    try:
        taken = taken_vehicle(scenario, read_net(network.net_file))
    except NetworkError as error:
        raise scenario.error(("network", "vehicle"), str(error)) from error
    warm_up = simulation.warmup_s
    if taken is not None:
        warm_up = max(taken.depart - begin - simulation.step_s, 0.0)
    return SumoSettings(
        net_file=network.net_file,
        route_file=route_file,
        route=network.route,
        road=layout.road,
        task=layout.task,
        leader=slow_leader(scenario.traffic),
        closed=closed_lanes(scenario, layout, network, told=told),
        driver=driver,
        ghost=simulation.ghost,
        lane_change_guard=simulation.lane_change_guard,
        errors=driver_errors(scenario.traffic, simulation.seed),
        relaxation=relaxation(scenario.traffic),
        cooperation=cooperation(scenario.traffic, simulation.seed),
        step=simulation.step_s,
        seed=random_stream(simulation.seed, simulation.repetition),
        warm_up=warm_up,
        demand=demand,
        begin=begin,
        taken=None if taken is None else taken.id,
    )
