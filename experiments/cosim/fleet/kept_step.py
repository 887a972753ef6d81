"""What is kept of a step of an ego."""

import math

import numpy as np

from experiments.cosim.fleet.egos import FleetEgo
from experiments.cosim.fleet.records import EgoStep
from experiments.cosim.records import StepRecord
from planner.interface import PlanResult

SHOWN_AHEAD = (1.0, 2.0, 3.0)  # of a plan, for pictures [s]


def plan_ahead(plan: PlanResult | None) -> tuple[float, ...]:
    """Return x, y of a plan at the times that are kept of it; its end where it ends."""
    if plan is None or plan.trajectory is None:
        return ()
    way = plan.trajectory
    return tuple(
        float(np.interp(time, way.t, axis))
        for time in SHOWN_AHEAD
        for axis in (way.x, way.y)
    )


def kept_step(ego: FleetEgo, record: StepRecord) -> EgoStep:
    """Return what is kept of a step of an ego."""
    plan, planning = record.plan, record.planning
    return EgoStep(
        ego.id,
        ego.group,
        record.ego,
        "" if plan is None else str(plan.status),
        record.clearance,
        record.off_road,
        record.contacts,
        math.nan if planning is None else planning.cpu_ms,
        plan_ahead(plan),
    )
