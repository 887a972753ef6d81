"""From a scenario to a road with obstacles, before anything moves on it."""

from dataclasses import replace

from experiments.config import Scenario
from experiments.world_setup.ego_vehicle import ego_task
from experiments.world_setup.obstacles import (
    check_on_road,
    check_start,
    static_bodies,
)
from experiments.world_setup.road import (
    Layout,
    plain_road,
    scenario_network,
    sumo_road,
)
from planner.errors import PlannerError
from sumo_nets.errors import NetworkError


def make_layout(scenario: Scenario) -> Layout:
    """Build the road and put the obstacles on it.

    Raises:
        ConfigError: If the network, its route or lane does not exist, something lies
            beyond the road, or an obstacle stands where the ego starts.
    """
    bare = _bare_layout(scenario)
    beyond = scenario.beyond(bare.road.path.length)
    if beyond is not None:
        raise scenario.error(*beyond)
    check_on_road(scenario, bare)
    road = replace(bare.road, obstacles=static_bodies(scenario, bare))
    layout = replace(bare, road=road)
    check_start(scenario, layout)
    return layout


def _bare_layout(scenario: Scenario) -> Layout:
    """Build the road without obstacles."""
    task, in_sumo = ego_task(scenario.ego), scenario.world == "sumo"
    try:
        if not in_sumo:
            return Layout(plain_road(scenario), task)
        network = scenario_network(scenario)
        return Layout(sumo_road(network, task.vehicle, task.start.s), task, network)
    except NetworkError as error:
        raise scenario.error(("network",), str(error)) from error
    except PlannerError as error:
        section = "network" if in_sumo else "road"
        raise scenario.error((section,), str(error)) from error
