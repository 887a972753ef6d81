"""From a recorded run to a CommonRoad scenario, whose replay is the same traffic."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from experiments.commonroad.records import (
    Box,
    CommonRoadScenario,
    GoalState,
    InitialState,
    MovingObstacle,
    PlanningProblem,
    Range,
)
from experiments.commonroad.shapes import box_polygon
from experiments.config import Scenario
from experiments.config.scenario_file import CONFIG_FILE, load_scenario
from experiments.cosim.road import Road
from experiments.episode.commonroad_lanelets import (
    lanelets_of_net,
    lanelets_of_road,
    with_lights,
)
from experiments.errors import ConfigError
from experiments.storage.atomic_folder import require_there
from experiments.trace.files import read_trace
from experiments.trace.schema import ROAD_USER_COLUMNS, Table, Trace
from experiments.world_setup.layout import make_layout
from planner.states import FloatArray
from sumo_nets.net_reader import read_net

FIRST_USER: Final = 1_000_000  # ids of road users begin here
FIRST_BODY: Final = 2_000_000  # and those of static bodies
PROBLEM: Final = 3_000_000  # id of the planning problem
GOAL_LENGTH: Final = 15.0  # of the goal's area along the path [m]
GOAL_TURN: Final = 0.6  # by which the ego may be askew there [rad]
LATER: Final = 5.0  # than the recorded ego the goal may be reached [s]


def exported_scenario(folder: Path) -> CommonRoadScenario:
    """Turn a run into a scenario: its roads, what stood and drove there, its task.

    Raises:
        ConfigError: If the run is of world commonroad already, or has no steps.
        ResultsError: If the folder is damaged.
    """
    require_there(folder)
    trace = read_trace(folder)
    module = str(trace.fact("planner")).partition(":")[0]
    scenario = load_scenario(str(folder / CONFIG_FILE), allow_planners=(module,))
    if scenario.world == "commonroad":
        problem = "world is commonroad, which has a file; allowed: sumo, kinematic"
        raise ConfigError(f"{folder}: {problem}")
    if len(trace.steps["index"]) == 0:
        raise ConfigError(f"{folder}: holds no steps; allowed: a run that began")
    layout = make_layout(scenario)
    road = layout.road
    left_hand = road.lanes.left_hand
    if layout.network is None:
        network = lanelets_of_road(road)
    else:
        net = read_net(layout.network.net_file)
        network, left_hand = lanelets_of_net(net, road.path), net.left_hand
    network = with_lights(network, road.path, trace.signals, len(trace.steps["index"]))
    return CommonRoadScenario(
        folder / CONFIG_FILE,
        _benchmark_id(scenario, left_hand=left_hand),
        float(trace.fact("step_s")),
        network,
        tuple(_static(trace.obstacles)),
        tuple(_moving(trace.vehicles)),
        (_problem(trace, road),),
    )


def _benchmark_id(scenario: Scenario, *, left_hand: bool) -> str:
    """Return the id: a place that is nowhere, or where traffic keeps left."""
    words = scenario.name.split("_")
    name = "".join(word[:1].upper() + word[1:] for word in words)
    number = scenario.simulation.seed + 1
    return f"{'GBR' if left_hand else 'ZAM'}_{name}-1_{number}_T-1"


def _static(table: Table) -> Iterator[tuple[str, Box]]:
    """Yield the static bodies."""
    names = ("x_m", "y_m", "heading_rad", "length_m", "width_m", "radius_m")
    columns = [_numbers(table, name) for name in names]
    for k, row in enumerate(zip(*columns, strict=True)):
        yield str(FIRST_BODY + k), Box(*map(float, row))


def _moving(table: Table) -> Iterator[MovingObstacle]:
    """Yield the road users; one that was out of sight comes back as another."""
    index = np.asarray(table["index"], dtype=np.int64)
    ids = np.asarray(table["id"], dtype=object)
    rows = np.array([_numbers(table, name) for name in ROAD_USER_COLUMNS])
    number = FIRST_USER
    for name in sorted(set(ids.tolist())):
        own = np.flatnonzero(ids == name)
        breaks = np.flatnonzero(np.diff(index[own]) > 1) + 1
        for part in np.split(own, breaks):
            first = int(index[part[0]])
            yield MovingObstacle(str(number), "car", first, rows[:, part])
            number += 1


def _problem(trace: Trace, road: Road) -> PlanningProblem:
    """Return the ego's task: where it began, and the road at its goal."""
    steps = trace.steps
    x, y, heading, speed, curvature = (
        float(_numbers(steps, name)[0])
        for name in ("x_m", "y_m", "heading_rad", "speed_mps", "curvature_1pm")
    )
    offset = float(trace.fact("length_m")) / 2.0 - float(trace.fact("rear_overhang_m"))
    start = InitialState(
        0,
        x + offset * math.cos(heading),
        y + offset * math.sin(heading),
        heading,
        speed,
        yaw_rate=curvature * speed,
    )
    middle = float(trace.fact("goal_m")) + 0.5 * GOAL_LENGTH
    px, py, turned = road.path.pose(middle)
    left, right = road.bounds.at(np.array([middle]))
    l = 0.5 * float(left[0] + right[0])
    box = Box(
        px - l * math.sin(turned),
        py + l * math.cos(turned),
        turned,
        GOAL_LENGTH,
        float(left[0] - right[0]),
    )
    turned = math.remainder(turned, 2.0 * math.pi)
    last = len(steps["index"]) - 1 + round(LATER / float(trace.fact("step_s")))
    goal = GoalState(
        Range(1, last),
        box_polygon(box),
        heading=Range(turned - GOAL_TURN, turned + GOAL_TURN),
    )
    return PlanningProblem(PROBLEM, start, (goal,))


def _numbers(table: Table, name: str) -> FloatArray:
    """Return a column of numbers; null is 0."""
    return np.ma.filled(np.ma.asarray(table[name], dtype=np.float64), 0.0)
