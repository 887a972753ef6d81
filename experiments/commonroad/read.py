"""Reads CommonRoad scenarios of format 2020a."""

import math
from functools import lru_cache
from pathlib import Path
from typing import Final

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

VERSION: Final = "2020a"
ROOT: Final = "commonRoad"
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
    _check_root(root)
    step = _step(root)
    network = read_network(root)
    return CommonRoadScenario(
        file,
        root.attributes.get("benchmarkID", file.stem),
        step,
        network,
        read_static(root, network.lanelets),
        read_moving(root, network.lanelets, step),
        _read_problems(root, network),
    )


def _check_root(root: Node) -> None:
    """Raise unless a file is a scenario of the version that is read."""
    if root.tag != ROOT:
        problem = f"is not a CommonRoad scenario; allowed: {ROOT}"
        raise ConfigError(f"{root.file}:{root.line}: {short(root.tag)} {problem}")
    version = root.attributes.get("commonRoadVersion", "none")
    if version != VERSION:
        problem = f"commonRoadVersion is {short(version)}; allowed: {VERSION!r}"
        raise ConfigError(f"{root.file}:{root.line}: {problem}")


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
