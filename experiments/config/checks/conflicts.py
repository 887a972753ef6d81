"""A conflict: what it cannot be with."""

from experiments.config.base import mismatch
from experiments.config.conflict import N_LANES, STEP_S, Conflict
from experiments.config.sections import ScenarioSections
from experiments.config.traffic import Traffic


def check_conflict(scenario: ScenarioSections) -> None:
    """Reject a conflict beside other vehicles, or on another road."""
    if scenario.conflict is None:
        return
    if scenario.road is None:
        _check_conflict_in_traffic(scenario, scenario.conflict)
    elif any(segment[0] != "line" for segment in scenario.road.segments):
        raise mismatch("road.segments", "allowed with a conflict: lines")
    elif scenario.road.lanes is None or scenario.road.lanes.count != N_LANES:
        problem = f"allowed with a conflict: {{count: {N_LANES}}}"
        raise mismatch("road.lanes", problem)
    if scenario.vehicles:
        raise mismatch("vehicles", "is beside conflict; allowed: one of them")
    if scenario.ego.start_offset_m != 0.0:
        raise mismatch("ego.start_offset_m", "allowed with a conflict: 0")
    if scenario.simulation.step_s != STEP_S:
        raise mismatch("simulation.step_s", f"allowed with a conflict: {STEP_S}")


def _check_conflict_in_traffic(scenario: ScenarioSections, conflict: Conflict) -> None:
    """Reject what a conflict in world sumo cannot be with."""
    if conflict.follower:
        problem = "is for world kinematic; traffic follows in world sumo"
        raise mismatch("conflict.follower", problem)
    if scenario.ego.depart_speed_mps == "max":
        problem = "allowed with a conflict in world sumo: a number"
        raise mismatch("ego.depart_speed_mps", problem)
    if (
        isinstance(scenario.traffic, Traffic)
        and scenario.traffic.slow_leader is not None
    ):
        problem = "is beside conflict; allowed: one of them"
        raise mismatch("traffic.slow_leader", problem)
    if scenario.network is not None and scenario.network.vehicle is not None:
        problem = "is beside conflict; allowed: one of them"
        raise mismatch("network.vehicle", problem)
    if scenario.simulation.without_ego:
        problem = "allowed with a conflict: false"
        raise mismatch("simulation.without_ego", problem)
