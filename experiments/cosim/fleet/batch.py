"""One call of a planner for all egos that it drives."""

from collections.abc import Mapping, Sequence

from experiments.cosim.fleet.egos import SeenEgo
from experiments.cosim.fleet.takeover import FleetGroup
from experiments.cosim.planning import PlannedCycle, plan_many
from experiments.cosim.plant import PlannerOutputError
from planner.interface import BatchPlanner
from planner.scene import Scene


def plan_together(
    egos: Sequence[SeenEgo], groups: Sequence[FleetGroup]
) -> Mapping[str, PlannedCycle | PlannerOutputError]:
    """Let the planners that plan for many egos at once do so.

    Args:
        egos: All of a moment.
        groups: How each is driven.

    Returns:
        By ego, its plan, or the failure of the call that was to make it; nothing for
        the egos of planners that plan for one.
    """
    planned: dict[str, PlannedCycle | PlannerOutputError] = {}
    for number, group in enumerate(groups):
        planner = group.planner
        if not isinstance(planner, BatchPlanner):
            continue
        scenes = {
            seen.ego.id: (scene, seen.ego.driver.memory)
            for seen in egos
            if seen.ego.group == number and seen.ending is None
            if (scene := seen.scene()) is not None
        }
        planned |= _plan_batch(planner, scenes)
    return planned


def _plan_batch(
    planner: BatchPlanner, egos: Mapping[str, tuple[Scene, object]]
) -> Mapping[str, PlannedCycle | PlannerOutputError]:
    """Plan one cycle of several egos; of all of them the failure, if the call fails.

    Args:
        planner: Of all of them.
        egos: Scene and memory of each, by its id.
    """
    if not egos:
        return {}
    scenes, memories = zip(*egos.values(), strict=True)
    try:
        found = plan_many(planner, scenes, memories)
    except PlannerOutputError as error:
        return {name: PlannerOutputError(str(error)) for name in egos}
    return dict(zip(egos, found, strict=True))
