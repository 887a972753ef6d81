"""Finds the lanelets from where the ego begins to its goal."""

import heapq
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import shapely

from experiments.commonroad.records import (
    CommonRoadScenario,
    GoalState,
    InitialState,
    Lanelet,
    PlanningProblem,
)
from experiments.errors import ConfigError

NEAR: Final = 5.0  # an ego beside all lanelets begins on one within this [m]
ACROSS: Final = math.pi / 2.0  # a lanelet that leads elsewhere is not the ego's [rad]
TURN_COST: Final = 10.0  # of beginning on a lanelet that leads aside [m/rad]
CHANGE_COST: Final = 25.0  # of a lane change, in metres of way
SHORT_CHANGE: Final = 40.0  # a lane change on a shorter lanelet costs more [m]
BESIDE_GOAL: Final = 100.0  # of an end whose middle line misses the goal's area [m]
SHOWN: Final = 4  # ids in a message
GOAL_BEHIND: Final = 1.0  # the goal may lie so far behind where the ego begins [m]


class Step(NamedTuple):
    """A lanelet of a route, and how the route comes to it."""

    lanelet: int
    how: str  # start, successor, left, right


@dataclass(frozen=True, slots=True)
class LaneletRoute:
    """The way from the initial state to a goal."""

    steps: tuple[Step, ...]
    goal: GoalState  # that the route was found for


def find_route(scenario: CommonRoadScenario, problem: PlanningProblem) -> LaneletRoute:
    """Find the shortest way to one of the goals; lane changes count as detours.

    Raises:
        ConfigError: If the ego begins off the road, or no route reaches a goal.
    """
    lanelets = scenario.network.lanelets
    begins = initial_lanelets(lanelets, problem.start)
    if not begins:
        start = problem.start
        raise ConfigError(
            f"{scenario.file}: planningProblem {problem.id}: begins at ({start.x:.1f}, "
            f"{start.y:.1f}); allowed: within {NEAR:g} m of a lanelet in its direction"
        )
    found = []
    for goal in problem.goals:
        if goal.area is None:
            best = min(begins, key=lambda name: begins[name])
            found.append((0.0, LaneletRoute((Step(best, "start"),), goal)))
            continue
        ends = goal_lanelets(lanelets, goal)
        reached = _search(lanelets, begins, ends, problem.start, goal)
        if reached is not None:
            found.append((reached[0], LaneletRoute(reached[1], goal)))
    if not found:
        raise ConfigError(_unreachable(scenario, problem, begins))
    return min(found, key=lambda item: item[0])[1]


def initial_lanelets(
    lanelets: Mapping[int, Lanelet], start: InitialState
) -> dict[int, float]:
    """Return the lanelets on which the ego may begin, and what each costs [m]."""
    drivable = [x for x in lanelets.values() if not x.closed]
    point = shapely.Point(start.x, start.y)
    areas = np.array([lanelet.area for lanelet in drivable])
    apart = shapely.distance(areas, point)
    if not apart.size or apart.min() > NEAR:
        return {}
    within = apart <= max(0.0, float(apart.min())) + 0.05
    costs = {}
    for k in np.flatnonzero(within).tolist():
        lanelet = drivable[k]
        turned = lanelet.heading_at(start.x, start.y) - start.heading
        turned = abs(math.remainder(turned, 2.0 * math.pi))
        if turned < ACROSS:
            costs[lanelet.id] = TURN_COST * turned
    return costs


def goal_lanelets(lanelets: Mapping[int, Lanelet], goal: GoalState) -> dict[int, float]:
    """Return the lanelets on which a goal is, and what each costs [m]."""
    if goal.lanelets:
        return dict.fromkeys(goal.lanelets, 0.0)
    names = [name for name, x in lanelets.items() if not x.closed]
    areas = np.array([lanelets[name].area for name in names])
    shared = shapely.area(shapely.intersection(areas, goal.area))
    ends = {}
    for k in np.flatnonzero(shared > 0.0).tolist():
        lanelet = lanelets[names[k]]
        line = shapely.LineString(lanelet.centre)
        met = shapely.length(shapely.intersection(line, goal.area))
        cost = 0.0 if met > 0.0 else BESIDE_GOAL
        if goal.heading is not None and not _heads_for(lanelet, goal):
            cost += BESIDE_GOAL
        ends[lanelet.id] = cost
    return ends


def _heads_for(lanelet: Lanelet, goal: GoalState) -> bool:
    """Tell whether a lanelet leads about where the goal's orientation says."""
    middle = goal.area.centroid if goal.area is not None else lanelet.area.centroid
    span = goal.heading
    if span is None:
        return True
    turned = lanelet.heading_at(middle.x, middle.y) - span.middle
    beyond = abs(math.remainder(turned, 2.0 * math.pi)) - 0.5 * (span.end - span.begin)
    return beyond < math.pi / 4.0


def _search(
    lanelets: Mapping[int, Lanelet],
    begins: Mapping[int, float],
    ends: Mapping[int, float],
    start: InitialState,
    goal: GoalState,
) -> tuple[float, tuple[Step, ...]] | None:
    """Search the cheapest way (Dijkstra); returns (cost, steps) or None."""
    at = {name: lanelets[name].place_of(start.x, start.y) for name in begins}
    queue = [(cost, name, -1, "start") for name, cost in begins.items()]
    heapq.heapify(queue)
    came: dict[int, tuple[int, str]] = {}
    best: tuple[float, int] | None = None
    while queue:
        cost, name, before, how = heapq.heappop(queue)
        if best is not None and cost >= best[0]:
            break
        if name in came:
            continue
        came[name] = (before, how)
        ahead = how != "start" or _is_ahead(lanelets[name], at[name], goal)
        if name in ends and ahead:
            total = cost + ends[name]
            best = (total, name) if best is None or total < best[0] else best
        for follower, change, extra in _onward(lanelets, name):
            if follower not in came:
                heapq.heappush(queue, (cost + extra, follower, name, change))
    if best is None:
        return None
    steps: list[Step] = []
    name = best[1]
    how = ""
    while how != "start":
        before, how = came[name]
        steps.append(Step(name, how))
        name = before
    return best[0], tuple(reversed(steps))


def _is_ahead(lanelet: Lanelet, place: float, goal: GoalState) -> bool:
    """Tell whether a goal on the first lanelet is not behind the ego."""
    if goal.area is None:
        return True
    met = shapely.intersection(shapely.LineString(lanelet.centre), goal.area)
    if met.is_empty:
        middle = goal.area.centroid
        return lanelet.place_of(middle.x, middle.y) > place - GOAL_BEHIND
    ends = shapely.get_coordinates(met)
    last = max(lanelet.place_of(x, y) for x, y in ends)
    return last > place - GOAL_BEHIND


def _onward(
    lanelets: Mapping[int, Lanelet], name: int
) -> Iterable[tuple[int, str, float]]:
    """Yield (lanelet, how, cost) of what can be driven next."""
    lanelet = lanelets[name]
    for follower in lanelet.successors:
        if not lanelets[follower].closed:
            yield follower, "successor", lanelet.length
    change = CHANGE_COST + max(SHORT_CHANGE - lanelet.length, 0.0)
    for beside, how in ((lanelet.same_left, "left"), (lanelet.same_right, "right")):
        if beside is not None and not lanelets[beside].closed:
            yield beside, how, change


def _unreachable(
    scenario: CommonRoadScenario, problem: PlanningProblem, begins: Mapping[int, float]
) -> str:
    """Say that no route reaches a goal, and where routes end."""
    lanelets = scenario.network.lanelets
    reached, todo = set(begins), list(begins)
    while todo:
        for follower, _, _ in _onward(lanelets, todo.pop()):
            if follower not in reached:
                reached.add(follower)
                todo.append(follower)
    dead = sorted(x for x in reached if not lanelets[x].successors)
    goals = sorted({x for g in problem.goals for x in goal_lanelets(lanelets, g)})
    where = f"on lanelets {_listed(goals)}" if goals else "off all lanelets"
    ends = f"; lanelets {_listed(dead)} have no successor" if dead else ""
    return (
        f"{scenario.file}: planningProblem {problem.id}: no route reaches its goal "
        f"{where}: it begins on lanelet {_listed(sorted(begins))}{ends}"
    )


def _listed(names: list[int]) -> str:
    """Write some ids."""
    shown = ", ".join(str(name) for name in names[:SHOWN])
    return f"{shown}, ..." if len(names) > SHOWN else shown
