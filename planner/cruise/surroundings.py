"""The bodies about the ego and the room that it keeps to each of them."""

import math

import numpy as np

from planner.bodies import Bodies, BodyTable
from planner.cruise.sampling.longitudinal import STANDING
from planner.cruise.settings import CruiseSettings
from planner.cruise.steering import turning_scale
from planner.cruise.workspace import FollowingRules, Surroundings
from planner.numerics.compiled import compiled
from planner.scene import Scene
from planner.shapes.disc_clearance import segment_to_rectangle
from planner.states import FloatArray

DISC_EXCESS = 0.3  # by which the discs may reach beyond the sides of a long body [m]
NO_DISCS = np.zeros(0)  # not frozen, as others: one type, one kernel
# By which a gap below the margin may still shrink in a cycle: rounding, no more, or an
# ego that stands would creep into contact [m].
TOUCH_TOLERANCE = 1e-6


def disc_cover(
    scene: Scene, settings: CruiseSettings
) -> tuple[tuple[float, float, float], FloatArray, float]:
    """Discs that cover the ego: their centres from the rear axle, and their radius.

    Returns:
        Three of them, the first and the last one included, rear first; the others,
        (n,); their radius [m]. A single disc is repeated three times.
    """
    if settings.cover_discs == 1:
        return (0.0, 0.0, 0.0), NO_DISCS, settings.single_disc_radius
    vehicle = scene.vehicle
    if vehicle.disc_radius - vehicle.width / 2.0 <= DISC_EXCESS:
        return vehicle.disc_offsets, NO_DISCS, vehicle.disc_radius
    centres, radius = vehicle.disc_cover(DISC_EXCESS)
    three = float(centres[0]), float(centres[1]), float(centres[-1])
    return three, centres[2:-1].copy(), radius


@compiled
def _thresholds(
    ego: tuple[float, float, float],
    discs: tuple[float, float, float],
    disc_radius: float,
    poses: FloatArray,
    extents: FloatArray,
    margin: float,
) -> FloatArray:
    """Required gap to each body, capped at the present gap so that an escape remains.

    The present gap is measured from a capsule about the discs: from three discs it
    would shrink and grow while the ego drives straight past a body.
    """
    cos, sin = math.cos(ego[2]), math.sin(ego[2])
    out = np.full(poses.shape[0], margin)
    ends = np.empty((2, 2))  # of the capsule's axis in a body's frame
    for b in range(out.size):
        half_length, half_width, radius = extents[b, 0], extents[b, 1], extents[b, 2]
        grown = radius + disc_radius
        for k, disc in enumerate((discs[0], discs[2])):
            dx = ego[0] + disc * cos - poses[b, 0, 0]
            dy = ego[1] + disc * sin - poses[b, 1, 0]
            ends[k, 0] = dx * poses[b, 2, 0] + dy * poses[b, 3, 0]
            ends[k, 1] = dy * poses[b, 2, 0] - dx * poses[b, 3, 0]
        reach = abs(discs[2] - discs[0]) + half_length + half_width + grown + margin
        if abs(ends[0, 0]) + abs(ends[0, 1]) > 2.0 * reach:
            continue
        apart = segment_to_rectangle(
            ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1], half_length, half_width
        )
        out[b] = min(margin, apart - grown - TOUCH_TOLERANCE)
    return out


def surroundings_of(
    scene: Scene, settings: CruiseSettings, bodies: Bodies
) -> Surroundings:
    """Collect the bodies and the rules of following them."""
    vehicle, table = scene.vehicle, bodies.table
    discs, more_discs, disc_radius = disc_cover(scene, settings)
    threshold = _thresholds(
        (scene.ego.x, scene.ego.y, scene.ego.heading),
        discs,
        disc_radius,
        table.poses,
        table.extents,
        settings.margin,
    )
    turn_gap = _turn_gaps(
        table,
        settings.obstacle_gap * turning_scale(vehicle, settings),
        settings.standstill_gap * turning_scale(vehicle, settings),
        (scene.ego_frenet.s, max(scene.stop_lines, default=-np.inf)),
    )
    rules = FollowingRules(
        discs,
        disc_radius,
        settings.scales.clearance,
        disc_radius + settings.margin,
        vehicle.front_reach,
        vehicle.rear_overhang,
        vehicle.limits.max_deceleration,
        settings.standstill_gap,
        settings.time_headway,
        settings.rear_time_headway,
    )
    return Surroundings(*table, threshold, turn_gap, more_discs, *rules)


@compiled
def _turn_gaps(
    table: BodyTable,
    obstacle_gap: float,
    standstill_gap: float,
    queue: tuple[float, float],
) -> FloatArray:
    """Room that the ego keeps to what stands ahead, 0 for what moves, (n,) [m].

    What stands in `queue`, from the ego to the closed line ahead, waits there and will
    move: one does not drive round it but stands behind it.
    """
    gaps = np.zeros(table.speed.size)
    for b in range(gaps.size):
        if b >= table.n_static and queue[0] < table.s[b, 0] < queue[1]:
            continue
        if not table.follower[b] and table.speed[b] <= STANDING:
            gaps[b] = obstacle_gap if b < table.n_static else standstill_gap
    return gaps
