"""The world of a scenario with a conflict: a cut-in, a cut-out, a braking leader."""

import numpy as np

from experiments.config import Conflict, Scenario
from experiments.cosim.conflict_world import (
    ConflictWorld,
    FollowerModel,
    ScriptedMotion,
    leader_motion,
    other_motion,
)
from experiments.cosim.conflicts import (
    Conflicts,
    LateralProfile,
    Sizes,
    braking_leader,
    cut_in,
    cut_out,
)
from experiments.errors import ConfigError
from experiments.world_setup.road import Layout
from planner.states import FloatArray

FOLLOWING_TIME = 2.0  # of the ego to its leader, unless a gap is given [s]


def conflict_world(
    scenario: Scenario, conflict: Conflict, layout: Layout
) -> ConflictWorld:
    """Make the world of a conflict without a simulator.

    Raises:
        ConfigError: If the numbers make no such conflict, or a vehicle does not fit
            into its lane.
    """
    follower = None
    if conflict.follower:
        size = (conflict.length_m, conflict.width_m)
        follower = FollowerModel(length=size[0], width=size[1])
    motions = scripted_motions(scenario, conflict, layout)
    return ConflictWorld(layout.road, layout.task, motions, follower)


def scripted_motions(
    scenario: Scenario, conflict: Conflict, layout: Layout
) -> tuple[ScriptedMotion, ...]:
    """Return the motions of a conflict's vehicles.

    Raises:
        ConfigError: If the numbers make no such conflict, a vehicle does not fit into
            its lane, or there is no lane beside the ego's.
    """
    start = layout.task.start.speed
    speed = layout.task.target_speed if start is None else start
    gap = conflict.following_gap_m or FOLLOWING_TIME * speed
    side = 1.0 if conflict.side == "left" else -1.0
    if conflict.kind != "braking" and not _has_lane(layout, side):
        problem = f"is {conflict.side}; the ego's lane has none beside it there"
        raise scenario.error(("conflict", "side"), problem)
    try:
        conflicts = _one_conflict(conflict, _sizes(conflict, layout), speed, gap)
    except ConfigError as error:
        raise scenario.error(("conflict",), str(error)) from error
    motions = [other_motion(conflicts, 0, side)]
    if conflict.kind == "cut_out":
        lateral = conflict.lateral_speed_mps or 0.0
        motions.append(leader_motion(conflicts, 0, gap, lateral, side))
    return tuple(motions)


def _ego_lane(layout: Layout) -> tuple[int, FloatArray, FloatArray]:
    """Return the index of the lane the ego starts in, and centres and widths there."""
    centres, widths = layout.road.lanes.at(layout.task.start.s)
    off = np.where(widths > 0.0, np.abs(centres - layout.task.start.l), np.inf)
    return int(np.argmin(off)), centres, widths


def _has_lane(layout: Layout, side: float) -> bool:
    """Return whether there is a lane beside the one the ego starts in."""
    index, _, widths = _ego_lane(layout)
    beside = index + int(side)
    return 0 <= beside < widths.size and bool(widths[beside] > 0.0)


def _sizes(conflict: Conflict, layout: Layout) -> Sizes:
    """Return the sizes of vehicles and lane."""
    ego = layout.task.vehicle
    index, _, widths = _ego_lane(layout)
    return Sizes(
        ego.length,
        ego.width,
        conflict.length_m,
        conflict.width_m,
        float(widths[index]),
    )


def _one_conflict(
    conflict: Conflict, sizes: Sizes, speed: float, following_gap: float
) -> Conflicts:
    """Build the conflict, with arrays of one column.

    Raises:
        ConfigError: If the numbers make no such conflict.
    """
    gap = np.array([conflict.gap_m or following_gap])
    lateral = np.array([conflict.lateral_speed_mps or 0.0])
    if conflict.kind == "cut_in":
        other = conflict.other_speed_mps or 0.0
        if other >= speed:
            raise ConfigError(
                f"other_speed_mps is {other:g}; allowed: less than the ego's "
                f"{speed:g} m/s"
            )
        profile = LateralProfile(conflict.profile)
        return cut_in(speed, other, gap, lateral, sizes, profile)
    if conflict.kind == "cut_out":
        return cut_out(speed, following_gap, gap, lateral, sizes)
    braking = np.array([conflict.deceleration_mps2 or 0.0])
    return braking_leader(np.array([speed]), braking, gap, sizes)
