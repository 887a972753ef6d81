"""Reads CommonRoad scenarios of the formats 2020a and 2018b.

The older one has one kind of obstacle, whose role is an element of its own.
"""

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import shapely

from experiments.commonroad.obstacles import read_moving, read_static
from experiments.commonroad.records import (
    CommonRoadScenario,
    PlanningProblem,
    RoadNetwork,
)
from experiments.commonroad.road_elements import read_network
from experiments.commonroad.states import read_goal_state, read_initial_state
from experiments.commonroad.xml_tree import Node, read_xml, short
from experiments.errors import ConfigError

VERSIONS: Final = ("2020a", "2018b")
ROLES: Final = {"static": "staticObstacle", "dynamic": "dynamicObstacle"}
ROOT: Final = "commonRoad"
ALLOWED: Final = f"allowed: {ROOT}"
_DEMAND: Final = (
    "it is a demand of SUMO; give it to a network: rearview run X.net.xml --set "
    "'traffic.route_files=[FILE]'"
)
HINTS: Final = {
    "routes": _DEMAND,
    "additional": _DEMAND,
    "net": "it is a network of SUMO; allowed: the same file, named X.net.xml",
    "sumoConfiguration": "it configures SUMO; allowed: the same, named X.sumocfg",
    "configuration": "it configures SUMO; allowed: the same file, named X.sumocfg",
}
SHORTEST_STEP: Final = 0.01  # [s]
LONGEST_STEP: Final = 1.0  # [s]
MOST_FILES: Final = 8  # remembered at a time


def read_commonroad(file: Path) -> CommonRoadScenario:
    """Read a scenario, once for each of a file's versions.

    Raises:
        ConfigError: If it cannot be read, is no such file, or is of another version of
            the format; one line with file and line.
    """
    try:
        state = file.stat()
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read: {error.strerror}") from error
    return _read(file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=MOST_FILES)
def _read(file: Path, _changed: int, _size: int) -> CommonRoadScenario:
    """Read a file."""
    root = read_xml(file)
    version = _read_version(root)
    _tell_roles(root)
    step = _step(root)
    network = read_network(root)
    problems = _read_problems(root, network)
    network = _opened(network, problems)
    return CommonRoadScenario(
        file,
        root.attributes.get("benchmarkID", file.stem),
        step,
        network,
        read_static(root, network.lanelets),
        read_moving(root, network.lanelets, step),
        problems,
        version,
    )


def _read_version(root: Node) -> str:
    """Read the version; raise unless it is one that is read."""
    if root.tag != ROOT:
        problem = f"is not a CommonRoad scenario; {HINTS.get(root.tag, ALLOWED)}"
        raise ConfigError(f"{root.file}:{root.line}: {short(root.tag)} {problem}")
    version = root.attributes.get("commonRoadVersion", "none")
    if version not in VERSIONS:
        allowed = ", ".join(VERSIONS)
        problem = f"commonRoadVersion is {short(version)}; allowed: {allowed}"
        raise ConfigError(f"{root.file}:{root.line}: {problem}")
    return version


def _tell_roles(root: Node) -> None:
    """Name the obstacles of the older format by their roles."""
    for node in root.all("obstacle"):
        role = node.need("role")
        if role.text not in ROLES:
            allowed = f"allowed: {', '.join(ROLES)}"
            raise role.error(f"is {short(role.text)}; {allowed}")
        node.tag = ROLES[role.text]


def _opened(network: RoadNetwork, problems: tuple[PlanningProblem, ...]) -> RoadNetwork:
    """Open the ways of others on which an ego begins or is to arrive."""
    named = {name for one in problems for goal in one.goals for name in goal.lanelets}
    starts = [shapely.Point(one.start.x, one.start.y) for one in problems]
    opened = {
        name: replace(lanelet, closed=False)
        for name, lanelet in network.lanelets.items()
        if lanelet.closed
        and (name in named or any(lanelet.area.covers(start) for start in starts))
    }
    return replace(network, lanelets={**network.lanelets, **opened})


def _step(root: Node) -> float:
    """Read the time step [s]."""
    text = root.attributes.get("timeStepSize", "")
    try:
        step = float(text)
    except ValueError:
        step = math.nan
    if not SHORTEST_STEP <= step <= LONGEST_STEP:
        allowed = f"allowed: {SHORTEST_STEP:g} to {LONGEST_STEP:g} s"
        raise root.error(f"timeStepSize is {short(text)}; {allowed}")
    return step


def _read_problems(root: Node, network: RoadNetwork) -> tuple[PlanningProblem, ...]:
    """Read the planning problems; raises a ConfigError without one."""
    problems = []
    for node in root.all("planningProblem"):
        start = read_initial_state(node.need("initialState"), network.lanelets)
        states = list(node.all("goalState"))
        if not states:
            raise node.error("has no goalState")
        goals = tuple(read_goal_state(x, network.lanelets) for x in states)
        problem = PlanningProblem(node.key(), start, goals)
        if problem.last_step <= start.step:
            raise node.error(
                f"its goal ends in step {problem.last_step}; allowed: after step "
                f"{start.step}, in which it begins"
            )
        problems.append(problem)
    if not problems:
        raise root.error("has no planningProblem; allowed: at least one")
    return tuple(problems)
