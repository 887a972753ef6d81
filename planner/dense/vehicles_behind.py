"""Who comes from behind, beside the ego, and would run into what it plans.

Round what stands the ego may swing out into the next lane. Who drives there has the
right of way: the ego goes first only where a gentle braking of theirs is enough.
"""

import numpy as np

from planner.bodies import CORRIDOR_MARGIN
from planner.dense.field import Cover
from planner.numerics.compiled import compiled
from planner.scene import Scene
from planner.states import BoolArray, FloatArray, Trajectory

REACTION = 1.0  # after which who is behind begins to brake [s]
BRAKING = 2.0  # that may be asked of them [m/s²]
ROOM = 0.5  # that is left between the bodies [m]


def cut_off_by(trajectory: Trajectory, scene: Scene) -> BoolArray:
    """Mark the vehicles that a drive would cut off, (n,).

    Those behind the ego's rear now that do not follow it in its own corridor: they keep
    clear by themselves, of what they have had ahead for long.

    Args:
        trajectory: Of the ego.
        scene: Of this cycle.
    """
    vehicles, ego = scene.vehicles, scene.ego
    ahead = vehicles.prediction
    cut_off = np.zeros(len(vehicles.ids), dtype=np.bool_)
    if not vehicles.ids or not ahead.x.shape[1]:
        return cut_off
    gap = (ego.x - vehicles.x) * np.cos(ego.heading)
    gap += (ego.y - vehicles.y) * np.sin(ego.heading)
    gap -= scene.vehicle.rear_overhang
    width = 0.5 * (vehicles.width + scene.vehicle.width) + CORRIDOR_MARGIN
    follows = np.isfinite(ahead.s[:, 0])
    follows &= np.abs(ahead.l[:, 0] - scene.ego_frenet.l) < width
    reach = vehicles.speed * trajectory.t[-1] + vehicles.length
    counted = np.flatnonzero((gap >= 0.0) & (gap < reach) & ~follows)
    if not counted.size:
        return cut_off
    cover = Cover.of(scene.vehicle)
    heading = trajectory.heading
    points = np.stack([trajectory.x, trajectory.y, np.cos(heading), np.sin(heading)])
    for v in counted.tolist():
        cos, sin = np.cos(ahead.heading[v]), np.sin(ahead.heading[v])
        cut_off[v] = _runs_into(
            points,
            np.stack([ahead.x[v], ahead.y[v], cos, sin]),
            (0.5 * float(vehicles.length[v]), 0.5 * float(vehicles.width[v])),
            _when_braking(trajectory.t, float(vehicles.speed[v])) / ahead.step,
            np.array(cover.offsets),
            cover.radius + ROOM,
        )
    return cut_off


def _when_braking(t: FloatArray, speed: float) -> FloatArray:
    """Return when, at constant speed, a vehicle is where braking has it at `t` [s]."""
    if speed <= 0.0:
        return np.zeros_like(t)
    braked = np.clip(t - REACTION, 0.0, speed / BRAKING)
    stands = np.maximum(t - REACTION - speed / BRAKING, 0.0)
    when: FloatArray = t - stands - 0.5 * BRAKING * braked**2 / speed
    return when


@compiled
def _runs_into(
    ego: FloatArray,
    poses: FloatArray,
    half: tuple[float, float],
    column: FloatArray,
    offsets: FloatArray,
    radius: float,
) -> bool:
    """Check whether a body comes nearer to the ego's discs than their radius.

    Args:
        ego: x, y, cos and sin of the heading, (4, n_times).
        poses: Of the body, the same over columns.
        half: Of its length and of its width [m].
        column: Where in its columns the body is, (n_times,).
        offsets: Of the discs, along the ego's heading [m].
        radius: Of the discs [m].
    """
    last = poses.shape[1] - 1
    for i in range(column.size):
        k = min(int(np.rint(column[i])), last)
        cos, sin = poses[2, k], poses[3, k]
        for offset in offsets:
            dx = ego[0, i] + offset * ego[2, i] - poses[0, k]
            dy = ego[1, i] + offset * ego[3, i] - poses[1, k]
            along = max(abs(dx * cos + dy * sin) - half[0], 0.0)
            across = max(abs(dy * cos - dx * sin) - half[1], 0.0)
            if along**2 + across**2 < radius * radius:
                return True
    return False
