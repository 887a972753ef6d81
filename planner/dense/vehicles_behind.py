"""Who comes from behind, beside the ego, and would run into what it plans.

Round what stands the ego may swing out into the next lane. Who drives there has the
right of way: the ego goes first only where a gentle braking of theirs is enough.
"""

import numpy as np

from planner.bodies import bodies_of
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
        trajectory: Of the ego, evenly in time.
        scene: Of this cycle.
    """
    vehicles, ego = scene.vehicles, scene.ego
    cut_off = np.zeros(len(vehicles.ids), dtype=np.bool_)
    if not vehicles.ids or not vehicles.prediction.x.shape[1]:
        return cut_off
    along = (vehicles.x - ego.x) * np.cos(ego.heading)
    along += (vehicles.y - ego.y) * np.sin(ego.heading)
    step = float(trajectory.t[1] - trajectory.t[0])
    bodies = bodies_of(scene, trajectory.t.size, step)
    table = bodies.table
    moving = np.arange(table.n_static, len(bodies.ids))
    behind = (along <= -scene.vehicle.rear_overhang) & ~table.follower[moving]
    if not behind.any():
        return cut_off
    cover = Cover.of(scene.vehicle)
    points = np.stack(
        [
            trajectory.x,
            trajectory.y,
            np.cos(trajectory.heading),
            np.sin(trajectory.heading),
        ]
    )
    for v in np.flatnonzero(behind).tolist():
        body = table.n_static + v
        speed = float(table.speed[body])
        cut_off[v] = _runs_into(
            points,
            np.ascontiguousarray(table.poses[body]),
            table.extents[body],
            _when_braking(trajectory.t, speed) / step,
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
    extents: FloatArray,
    column: FloatArray,
    offsets: FloatArray,
    radius: float,
) -> bool:
    """Check whether a body comes nearer to the ego's discs than their radius.

    Args:
        ego: x, y, cos and sin of the heading, (4, n_times).
        poses: Of the body, the same over columns.
        extents: Half length, half width, radius [m].
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
            along = max(abs(dx * cos + dy * sin) - extents[0], 0.0)
            across = max(abs(dy * cos - dx * sin) - extents[1], 0.0)
            if along**2 + across**2 < (radius + extents[2]) ** 2:
                return True
    return False
