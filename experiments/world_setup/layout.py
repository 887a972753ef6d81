"""From a scenario to a road with obstacles, before anything moves on it.

Runs of a sweep share most of this: roads and drawn obstacles are remembered by what
they are made from.
"""

import json
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from experiments.config import Scenario, SumoTraffic
from experiments.config.checks.worlds import beyond_road
from experiments.world_setup.bodies_on_road import joined_bodies
from experiments.world_setup.closures import check_closure, closure_of
from experiments.world_setup.commonroad_layout import commonroad_layout
from experiments.world_setup.ego_vehicle import ego_task
from experiments.world_setup.obstacles import (
    check_on_road,
    check_start,
    static_bodies,
)
from experiments.world_setup.road import Layout, plain_road, sumo_road
from experiments.world_setup.scenario_network import scenario_network
from planner.errors import PlannerError
from planner.scene import Obstacles
from sumo_nets.build import net_path
from sumo_nets.errors import NetworkError

MOST_ROADS = 16  # remembered at a time
MOST_FIELDS = 64  # of drawn obstacles, remembered at a time


@dataclass(frozen=True, slots=True)
class _Source:
    """A scenario as far as a layout depends on it."""

    content: str  # what it is made from
    scenario: Scenario = field(compare=False)


def make_layout(scenario: Scenario) -> Layout:
    """Build the road and put the obstacles on it.

    Raises:
        ConfigError: If the network, its route or lane does not exist, something lies
            beyond the road, an obstacle stands where the ego starts, or a
            closure leaves no way round.
    """
    bare = _bare_layout(_road_source(scenario))
    if bare.replay is not None:  # the ego begins where the file says
        bodies = _static_bodies(_body_source(scenario))
        both = joined_bodies(bare.road.obstacles, bodies)
        return replace(bare, road=replace(bare.road, obstacles=both))
    beyond = beyond_road(scenario, bare.road.path.length)
    if beyond is not None:
        raise scenario.error(*beyond)
    check_on_road(scenario, bare)
    bodies = _static_bodies(_body_source(scenario))
    closure = closure_of(scenario.obstacles)
    road = replace(bare.road, obstacles=bodies, closure=closure)
    layout = replace(bare, road=road)
    check_closure(scenario, layout)
    check_start(scenario, layout)
    return layout


def _road_source(scenario: Scenario) -> _Source:
    """Return what the road is made from: sections and the state of the file."""
    keys = ["world", "network", "road", "ego"]
    if scenario.world == "commonroad":
        keys.append("simulation")  # its step has to be that of the file
    resolved = scenario.resolved()
    if isinstance(scenario.traffic, SumoTraffic):  # may hold the ego's route
        keys.append("traffic")
    parts: list[Any] = [resolved.get(key) for key in keys]
    network = scenario.network
    if network is not None:
        parts.append(_stamp(network.file or net_path(network.name or "")))
        if network.is_drawn:
            parts.append(scenario.simulation.seed)
    return _Source(json.dumps(parts, default=str), scenario)


def _body_source(scenario: Scenario) -> _Source:
    """Return what the obstacles are made from: the road, and the seed if drawn."""
    section = scenario.obstacles
    drawn = section.random is not None or section.field is not None
    seed = scenario.simulation.seed if drawn else None
    own = json.dumps([scenario.resolved()["obstacles"], seed])
    return _Source(_road_source(scenario).content + own, scenario)


def _stamp(file: str | Path) -> tuple[str, int, int] | None:
    """Return a file's place, size and time of its last change; None if it is gone."""
    try:
        state = Path(file).stat()
    except OSError:
        return None
    return str(Path(file).absolute()), state.st_size, state.st_mtime_ns


@lru_cache(maxsize=MOST_FIELDS)
def _static_bodies(source: _Source) -> Obstacles:
    """Return the obstacles of a scenario, drawn once for the same road and seed."""
    bare = _bare_layout(_road_source(source.scenario))
    return static_bodies(source.scenario, bare)


@lru_cache(maxsize=MOST_ROADS)
def _bare_layout(source: _Source) -> Layout:
    """Build the road without obstacles, once for the same content."""
    scenario = source.scenario
    in_sumo = scenario.world == "sumo"
    try:
        if scenario.world == "commonroad":
            return commonroad_layout(scenario)
        task = ego_task(scenario.ego)
        if not in_sumo:
            return Layout(plain_road(scenario), task)
        network = scenario_network(scenario)
        road = sumo_road(network, task.vehicle, task.start.s, task.goal)
        return Layout(road, task, network)
    except NetworkError as error:
        raise scenario.error(("network",), str(error)) from error
    except PlannerError as error:
        section = "road" if scenario.world == "kinematic" else "network"
        raise scenario.error((section,), str(error)) from error
