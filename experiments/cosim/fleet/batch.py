"""One call of a planner for all egos that it drives."""

from collections.abc import Mapping

from experiments.cosim.planning import PlannedCycle, plan_together
from experiments.cosim.plant import PlannerOutputError
from planner.interface import BatchPlanner
from planner.scene import Scene


def plan_batch(
    planner: BatchPlanner, egos: Mapping[str, tuple[Scene, object]]
) -> Mapping[str, PlannedCycle | PlannerOutputError]:
    """Plan one cycle of several egos.

    Args:
        planner: Of all of them.
        egos: Scene and memory of each, by its id.

    Returns:
        The plan of each ego; of all of them the failure, if the call failed.
    """
    if not egos:
        return {}
    scenes, memories = zip(*egos.values(), strict=True)
    try:
        found = plan_together(planner, scenes, memories)
    except PlannerOutputError as error:
        return dict.fromkeys(egos, error)
    return dict(zip(egos, found, strict=True))
