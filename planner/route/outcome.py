"""What a cycle of the route planner returns: a plan on the reference path, and why."""

from dataclasses import replace

from planner.interface import Indicator, PlanResult
from planner.lane_change.phases.memory import Phase
from planner.route.changes import Look
from planner.route.lane_frame import LaneFrame, on_reference
from planner.route.memory import LaneManoeuvre, RouteMemory


def told(
    look: Look,
    result: PlanResult,
    manoeuvre: LaneManoeuvre,
    frame: LaneFrame,
    frames: dict[tuple[int, bool], LaneFrame],
    how: str,
) -> PlanResult:
    """Put a plan back onto the reference path, and say why it is this one."""
    if result.trajectory is None:
        return result
    trajectory = on_reference(frame, result.trajectory)
    memory = RouteMemory(
        manoeuvre,
        trajectory,
        stood=look.stood,
        round_until=look.round_until,
        close_until=look.close_until,
        frames=frames,
    )
    words = [f"{manoeuvre.phase} lane {manoeuvre.lane}"]
    if manoeuvre.target is not None:
        words.append(f"to {manoeuvre.target}: {manoeuvre.why}")
    if manoeuvre.phase is Phase.SEEK:
        beside = f", {manoeuvre.beside} is there" if manoeuvre.beside else ""
        words.append("no way over yet" + beside)
    if how:
        words.append(how)
    stats = replace(result.stats, explanation=", ".join(words))
    if look.stood > 0.0 and manoeuvre.beside and stats.blocker is None:
        stats = replace(stats, blocker=manoeuvre.beside)  # it waits for a gap
    indicator = Indicator.NONE
    if manoeuvre.target is not None:  # lanes count to the left
        to_left = manoeuvre.target > manoeuvre.lane
        indicator = Indicator.LEFT if to_left else Indicator.RIGHT
    return PlanResult(
        result.status,
        trajectory,
        memory,
        stats,
        speed_graph=result.speed_graph,
        indicator=indicator,
    )


def keeping_open(result: PlanResult, until: float) -> PlanResult:
    """Return a plan after which the road is open up to the same place as before."""
    if not isinstance(result.memory, RouteMemory):
        return result
    return replace(result, memory=replace(result.memory, round_until=until))
