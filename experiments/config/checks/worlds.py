"""Worlds: what each has of its own, and what has to be on its road."""

from experiments.config.base import mismatch
from experiments.config.ego import Ego
from experiments.config.road import VEHICLE_OF_FILES
from experiments.config.sections import ScenarioSections
from experiments.config.traffic import SumoTraffic
from experiments.config.yaml_reader import KeyPath, dotted


def check_world(scenario: ScenarioSections) -> None:
    """Reject keys of the other worlds, and objects beyond the road."""
    if scenario.world == "commonroad":
        _check_commonroad(scenario)
    else:
        _check_without_recording(scenario)
        _check_sumo_or_kinematic(scenario)


def _check_sumo_or_kinematic(scenario: ScenarioSections) -> None:
    """Reject keys of one of the two worlds in the other."""
    sumo = scenario.world == "sumo"
    needed, foreign = ("network", "road") if sumo else ("road", "network")
    if getattr(scenario, needed) is None:
        raise mismatch(needed, f"is missing; world {scenario.world} needs it")
    if getattr(scenario, foreign) is not None:
        raise mismatch(foreign, f"is not for world {scenario.world}; allowed: {needed}")
    if sumo and scenario.vehicles:
        raise mismatch("vehicles", "is not for world sumo; allowed: traffic")
    if not sumo and scenario.traffic is not None:
        raise mismatch("traffic", "is not for world kinematic; allowed: vehicles")
    if not sumo and scenario.obstacles.closure is not None:
        problem = "is of SUMO's traffic; allowed in world kinematic: a list"
        raise mismatch("obstacles.closure", problem)
    if scenario.network is not None and scenario.network.vehicle is not None:
        _check_taken(scenario)
    if not sumo and scenario.simulation.without_ego:
        problem = "is for world sumo, where vehicles react; allowed: false"
        raise mismatch("simulation.without_ego", problem)
    if scenario.simulation.placebo and not scenario.simulation.without_ego:
        problem = "needs without_ego; allowed: false, or without_ego = true"
        raise mismatch("simulation.placebo", problem)
    beyond = beyond_road(scenario, scenario.road.length) if scenario.road else None
    if beyond is not None:
        raise mismatch(dotted(beyond[0]), beyond[1])


def _check_taken(scenario: ScenarioSections) -> None:
    """Reject where and how fast an ego enters that takes a vehicle's place."""
    if not isinstance(scenario.traffic, SumoTraffic):
        raise mismatch("network.vehicle", VEHICLE_OF_FILES)
    ego = scenario.single_ego
    if ego is None or scenario.conflict is not None:
        return  # they are not of each other: that is said first
    usual = Ego(goal_m=ego.goal_m)
    for key in ("start_m", "start_offset_m", "depart_speed_mps"):
        if getattr(ego, key) != getattr(usual, key):
            problem = "is that of the vehicle; allowed with network.vehicle: without it"
            raise mismatch(f"ego.{key}", problem)


def _check_without_recording(scenario: ScenarioSections) -> None:
    """Reject what only a CommonRoad file gives, and what only that leaves out."""
    if scenario.single_ego is not None and scenario.single_ego.goal_m is None:
        raise mismatch("ego.goal_m", f"is missing; world {scenario.world} needs it")
    if scenario.simulation.predictor == "recorded":
        problem = "is for world commonroad; allowed: constant_speed, held_braking"
        raise mismatch("simulation.predictor", f"is recorded, which {problem}")
    if scenario.network is not None and scenario.network.planning_problem is not None:
        problem = "is for world commonroad; allowed: name, or file and route"
        raise mismatch("network.planning_problem", problem)


def _check_commonroad(scenario: ScenarioSections) -> None:
    """Reject what a CommonRoad file gives, or cannot be with."""
    if scenario.network is None or scenario.network.file is None:
        raise mismatch("network", "allowed in world commonroad: file: scenario.xml")
    if not scenario.network.is_drawn or scenario.network.lane is not None:
        problem = "allowed in world commonroad: file, planning_problem"
        raise mismatch("network", problem)
    for key in ("road", "traffic", "conflict"):
        if getattr(scenario, key) is not None:
            problem = "is not for world commonroad, whose file has the traffic"
            raise mismatch(key, f"{problem}; allowed: obstacles")
    if scenario.vehicles:
        raise mismatch("vehicles", "is not for world commonroad; allowed: obstacles")
    ego = scenario.ego
    placed = ego.start_m or ego.start_offset_m or ego.depart_speed_mps != "max"
    if placed or ego.goal_m is not None:
        key = "ego.start_m" if placed else "ego.goal_m"
        problem = "is the planning problem's; allowed: network.planning_problem"
        raise mismatch(key, problem)
    if scenario.obstacles.closure is not None or scenario.obstacles.field is not None:
        problem = "allowed in world commonroad: a list, or random"
        raise mismatch("obstacles", problem)
    if scenario.simulation.predictor == "recorded" and ego.perception is not None:
        problem = "is beside ego.perception; allowed: constant_speed, held_braking"
        raise mismatch("simulation.predictor", problem)
    if scenario.simulation.without_ego:
        problem = "is for world sumo, where vehicles react; allowed: false"
        raise mismatch("simulation.without_ego", problem)


def beyond_road(
    scenario: ScenarioSections, length: float
) -> tuple[KeyPath, str] | None:
    """Find a goal, obstacle or vehicle that is not on the road.

    Args:
        scenario: Its sections.
        length: Of the road [m].

    Returns:
        The key and what is wrong with it, None if all is on the road.
    """
    places: dict[KeyPath, float] = {}
    if scenario.single_ego is not None:
        places["ego", "goal_m"] = scenario.single_ego.goal
    for index, obstacle in enumerate(scenario.obstacles.listed):
        key: KeyPath = ("obstacles", *scenario.obstacles.listed_key, index, "s_m")
        places[key] = obstacle.s_m
    for index, vehicle in enumerate(scenario.vehicles):
        places["vehicles", index, "s_m"] = vehicle.s_m
    if scenario.obstacles.random:
        places["obstacles", "random", "first_m"] = scenario.obstacles.random.first_m
    if scenario.obstacles.field:
        places["obstacles", "field", "last_m"] = scenario.obstacles.field.last_m
    for key, place in places.items():
        if place > length:
            problem = f"is {place:g}; allowed: 0 to {length:.1f}, the road's end"
            return key, problem
    return None
