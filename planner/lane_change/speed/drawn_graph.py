"""The s-T graph behind a speed plan, as it is drawn."""

import numpy as np

from planner.interface import SpeedGraph
from planner.lane_change.speed.plan import SpeedPlan
from planner.states import FloatArray, SpeedProfile


def speed_graph_of(plan: SpeedPlan, profile: SpeedProfile) -> SpeedGraph:
    """Return obstacles, passing order and profile of a speed plan.

    Args:
        plan: Its order names the vehicles of its graph, one by one.
        profile: The plan's own.

    Returns:
        The graph over the knots that both share.
    """
    graph = plan.graph

    def where_hit(bound: FloatArray) -> FloatArray:
        return np.where(graph.hit, bound, np.nan)

    return SpeedGraph(
        profile.t,
        profile.distance,
        graph.ids,
        tuple(str(side) for _, side in plan.order),
        where_hit(graph.lower),
        where_hit(graph.upper),
    )
