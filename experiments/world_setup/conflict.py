"""The world of a scenario with a conflict: a cut-in, a cut-out, a braking leader."""

import numpy as np

from experiments.config import Conflict, Scenario
from experiments.cosim.conflict_world import (
    ConflictWorld,
    FollowerModel,
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

FOLLOWING_TIME = 2.0  # of the ego to its leader, unless a gap is given [s]


def conflict_world(
    scenario: Scenario, conflict: Conflict, layout: Layout
) -> ConflictWorld:
    """Make the world of a conflict.

    Raises:
        ConfigError: If the numbers make no such conflict, or a vehicle does not fit
            into its lane.
    """
    start = layout.task.start.speed
    speed = layout.task.target_speed if start is None else start
    gap = conflict.following_gap_m or FOLLOWING_TIME * speed
    try:
        conflicts = _one_conflict(conflict, _sizes(conflict, layout), speed, gap)
    except ConfigError as error:
        raise scenario.error(("conflict",), str(error)) from error
    side = 1.0 if conflict.side == "left" else -1.0
    motions = [other_motion(conflicts, 0, side)]
    if conflict.kind == "cut_out":
        lateral = conflict.lateral_speed_mps or 0.0
        motions.append(leader_motion(conflicts, 0, gap, lateral, side))
    follower = None
    if conflict.follower:
        size = (conflict.length_m, conflict.width_m)
        follower = FollowerModel(length=size[0], width=size[1])
    return ConflictWorld(layout.road, layout.task, tuple(motions), follower)


def _sizes(conflict: Conflict, layout: Layout) -> Sizes:
    """Return the sizes of vehicles and lane."""
    ego, lanes = layout.task.vehicle, layout.road.lanes
    return Sizes(
        ego.length,
        ego.width,
        conflict.length_m,
        conflict.width_m,
        float(lanes.width[0, 0]),
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
