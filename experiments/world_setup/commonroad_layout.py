"""From a scenario of world commonroad to its road, task and recorded traffic."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.commonroad.corridor import Extent, make_corridor
from experiments.commonroad.read import read_commonroad
from experiments.commonroad.records import (
    Box,
    CommonRoadScenario,
    GoalState,
    InitialState,
    PlanningProblem,
)
from experiments.commonroad.route import LaneletRoute, find_route
from experiments.config import Scenario
from experiments.config.counted import counted
from experiments.cosim.goal import GoalRegion, GoalWindow
from experiments.cosim.replay_world import Replay, ReplayLog
from experiments.cosim.road import EgoTask, Road, Start
from experiments.world_setup.lanelet_road import lanelet_road, lights
from experiments.world_setup.road import Layout
from experiments.world_setup.scenario_network import log
from planner.reference_path.frenet import MIN_STRETCH
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles
from planner.states import CartesianState
from planner.vehicle import Vehicle

STEP_TOLERANCE = 1e-6  # [s]
BEYOND = 120.0  # of road behind the goal's lanelet, at least [m]
BEYOND_TIME = 6.0  # and as far as is driven in this time [s]
MOST_NAMED = 5  # lanelets in a message
GOAL_STEP = 0.25  # between the places where the goal's area is looked for [m]
STRICT = 0.01  # by which a goal is drawn in, so that rounding leaves no doubt [m]
STRICT_VALUE = 1e-4  # the same of speeds and angles [m/s], [rad]
CREEPING = 1.0  # below this a yaw rate says nothing about the steering [m/s]
NEAR = 80.0  # static bodies farther from the path are left out [m]
PATH_STEP = 5.0  # between points of the path for that [m]


def commonroad_layout(scenario: Scenario) -> Layout:
    """Read the file and lay out the way to the goal.

    Raises:
        ConfigError: If the file cannot be used, or no route reaches the goal.
        PlannerError: If the route makes no path.
    """
    choice = scenario.network
    if choice is None or choice.file is None:
        raise scenario.error(("network", "file"), "is missing")
    found = read_commonroad(Path(choice.file))
    _warn_of_missing(found)
    problem = _problem(scenario, found, choice.planning_problem)
    vehicle = scenario.ego.vehicle.to_planner()
    route = find_route(found, problem)
    start = problem.start
    corridor = make_corridor(
        found.network, route.steps, _extent(problem, route, found.step)
    )
    road = lanelet_road(found.network, corridor, vehicle, left_hand=found.left_hand)
    path = road.path
    plant = scenario.ego.plant
    dynamic = plant is not None and plant.model == "dynamic"
    entry = _entry(start, vehicle, None if dynamic else path)
    s, l = path.project_one(entry.x, entry.y)
    target = scenario.ego.target_speed_mps
    windows = _windows(problem, route, path, s, found.step)
    last = problem.last_step - start.step
    goal = windows[0].begin
    if not math.isfinite(goal):
        goal = min(s + target * found.step * last, path.length)
    task = EgoTask(
        vehicle,
        goal,
        target,
        Start(s, l, entry.speed),
        GoalRegion.of(windows, vehicle),
    )
    replay = Replay(
        ReplayLog.of(found.moving, path, found.step),
        entry,
        start.step,
        tuple(lights(found.network, corridor, path)),
    )
    bodies = _static_bodies(found.static, path)
    return Layout(
        Road(
            path,
            road.bounds,
            road.lanes,
            road.stop_lines,
            bodies,
            road.speed_limits,
        ),
        task,
        replay=replay,
        lanelets=found,
    )


def _warn_of_missing(found: CommonRoadScenario) -> None:
    """Say which lanelets others refer to that a file cut out of a map lacks."""
    missing = found.network.missing
    if missing:
        listed = ", ".join(map(str, missing[:MOST_NAMED]))
        log.warning(
            "%s: refers to %s that it does not hold (%s%s): the road ends there",
            found.file,
            counted(len(missing), "lanelet"),
            listed,
            ", ..." if len(missing) > MOST_NAMED else "",
        )


def _problem(
    scenario: Scenario, found: CommonRoadScenario, wanted: int | None
) -> PlanningProblem:
    """Return the planning problem that is driven, and check the time step."""
    try:
        problem = found.problem(wanted)
    except KeyError:
        allowed = ", ".join(str(problem.id) for problem in found.problems)
        key = ("network", "planning_problem")
        raise scenario.error(key, f"is {wanted}; allowed: {allowed}") from None
    step = scenario.simulation.step_s
    if abs(step - found.step) > STEP_TOLERANCE:
        words = f"is {step:g}; allowed: {found.step:g}, that of the file"
        raise scenario.error(("simulation", "step_s"), words)
    return problem


def _extent(problem: PlanningProblem, route: LaneletRoute, step: float) -> Extent:
    """Return what the corridor has to hold."""
    start, area = problem.start, route.goal.area
    beyond = max(BEYOND, BEYOND_TIME * start.speed)
    goal = None
    if area is None:
        beyond += max(start.speed, 15.0) * step * (problem.last_step - start.step)
    else:
        goal = (float(area.centroid.x), float(area.centroid.y))
    return Extent((start.x, start.y), goal, start.speed, beyond)


def _entry(
    start: InitialState, vehicle: Vehicle, path: ReferencePath | None
) -> CartesianState:
    """Return the ego's first state: of the rear axle, while files give the middle.

    Args:
        start: Of the file.
        vehicle: The ego.
        path: Whose bend the ego is in where the file has no yaw rate: a kinematic
            vehicle may begin with any steering. None: it begins with that of the file.
    """
    back = vehicle.centre_offset
    x = start.x - back * math.cos(start.heading)
    y = start.y - back * math.sin(start.heading)
    curvature = 0.0
    if path is not None and abs(start.yaw_rate) < STRICT_VALUE:
        s, l = path.project_one(x, y)
        bend = float(path.at(s).curvature)
        stretch = 1.0 - bend * l
        curvature = bend / stretch if stretch > MIN_STRETCH else 0.0
    elif start.speed > CREEPING:
        curvature = start.yaw_rate / start.speed
    held = vehicle.limits.max_lateral_acceleration / max(start.speed, CREEPING) ** 2
    most = min(vehicle.limits.max_curvature, held)
    return CartesianState(
        x,
        y,
        math.remainder(start.heading, 2.0 * math.pi),
        min(max(curvature, -most), most),
        start.speed,
        start.acceleration,
    )


def _windows(
    problem: PlanningProblem,
    route: LaneletRoute,
    path: ReferencePath,
    start: float,
    step: float,
) -> list[GoalWindow]:
    """Turn the goal states into windows on the path, the route's own one first."""
    goals = sorted(problem.goals, key=lambda goal: goal is not route.goal)
    first = problem.start.step
    return [_window(goal, path, start, step, first) for goal in goals]


def _window(
    goal: GoalState, path: ReferencePath, start: float, step: float, first: int
) -> GoalWindow:
    """Turn one goal state into a window."""
    time = tuple((count - first) * step for count in goal.steps)
    area, begin, end = goal.area, -math.inf, math.inf
    if area is not None:
        drawn_in = area.buffer(-STRICT)
        area = area if drawn_in.is_empty else drawn_in
        begin, end = _ends_on_path(area, path, start)
    speed = (-math.inf, math.inf)
    if goal.speed is not None:
        speed = _drawn_in(*goal.speed)
    heading = None if goal.heading is None else _drawn_in(*goal.heading)
    return GoalWindow((time[0], time[1]), area, begin, end, speed, heading)


def _drawn_in(begin: float, end: float) -> tuple[float, float]:
    """Draw an interval in, unless it is a point."""
    inner = STRICT_VALUE if end - begin > 4.0 * STRICT_VALUE else 0.0
    return begin + inner, end - inner


def _ends_on_path(
    area: BaseGeometry, path: ReferencePath, start: float
) -> tuple[float, float]:
    """Find where a path comes into an area and leaves it [m].

    A path that misses the area comes nearest to its middle.
    """
    s = np.arange(max(start, 0.0), path.length + 1.0, GOAL_STEP)
    at = path.at(s)
    inside = shapely.contains_xy(area, at.x, at.y)
    if not inside.any():
        middle = area.centroid
        place, _ = path.project_one(float(middle.x), float(middle.y))
        return place - GOAL_STEP, place + GOAL_STEP
    first = int(np.argmax(inside))
    outside = np.flatnonzero(~inside[first:])
    last = first + int(outside[0]) - 1 if outside.size else s.size - 1
    return float(s[first]), float(s[last])


def _static_bodies(boxes: Sequence[tuple[str, Box]], path: ReferencePath) -> Obstacles:
    """Return the bodies that stand near the path."""
    s = np.linspace(0.0, path.length, max(int(path.length / PATH_STEP), 1) + 1)
    at = path.at(s)
    line = shapely.LineString(np.column_stack([at.x, at.y]))
    shapely.prepare(line)
    kept: list[tuple[str, Box]] = []
    for name, box in _named_apart(boxes):
        reach = NEAR + 0.5 * math.hypot(box.length, box.width) + box.radius
        if shapely.dwithin(line, shapely.Point(box.x, box.y), reach):
            kept.append((name, box))
    if not kept:
        return Obstacles.none()
    columns = np.array([box for _, box in kept]).T
    return Obstacles(tuple(name for name, _ in kept), *columns)


def _named_apart(boxes: Sequence[tuple[str, Box]]) -> Iterator[tuple[str, Box]]:
    """Yield the boxes with names of their own: several may be of one obstacle."""
    counts: dict[str, int] = {}
    for name, box in boxes:
        counts[name] = counts.get(name, 0) + 1
        yield (name if counts[name] == 1 else f"{name}.{counts[name] - 1}"), box
