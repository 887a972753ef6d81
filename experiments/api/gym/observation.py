"""What a policy sees: a scene as arrays of fixed shape, in the ego's frame.

All numbers are scaled into [-1, 1] and clipped there. The same function makes the
observations of the environments and those of a policy that drives as a planner.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError
from planner.scene import Scene
from planner.states import FloatArray

Observation = dict[str, NDArray[np.float32]]

AHEAD = 120.0  # scale of positions along the heading [m]
ASIDE = 30.0  # and across it [m]
SPEED = 40.0  # of speeds [m/s]
LENGTH, WIDTH = 20.0, 5.0  # of sizes [m]
ACCELERATION = 10.0  # [m/s²]
CURVATURE = 0.2  # [1/m]
OFFSET = 10.0  # of lateral offsets, bounds and lanes [m]
STOP = 100.0  # of the distance to a closed stop line [m]

EGO = ("speed", "acceleration", "curvature", "offset", "heading error", "target speed")
BODY = (
    "ahead",
    "left",
    "speed ahead",
    "speed left",
    "cos heading",
    "sin heading",
    "length",
    "width",
)
POINT = ("ahead", "left", "curvature", "left bound", "right bound")
LANE = ("is there", "offset of its centre")
LANES = ("right", "own", "left")
SIGNAL = ("is closed", "distance")


@dataclass(frozen=True, slots=True)
class ObservationShape:
    """How many bodies and points an observation holds."""

    bodies: int = 12  # nearest first: vehicles, and obstacles, which stand
    points: int = 20  # of the reference path ahead
    spacing: float = 5.0  # between them [m]

    def __post_init__(self) -> None:
        """Raise a ConfigError unless there is something to see."""
        for name in ("bodies", "points", "spacing"):
            value = getattr(self, name)
            if not value > 0:
                raise ConfigError(f"{name}: is {value}; allowed: more than 0")

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each array."""
        return {
            "ego": (len(EGO),),
            "vehicles": (self.bodies, len(BODY)),
            "mask": (self.bodies,),
            "path": (self.points, len(POINT)),
            "lanes": (len(LANES), len(LANE)),
            "signals": (len(SIGNAL),),
        }


def observe(scene: Scene, shape: ObservationShape) -> Observation:
    """Make the observation of a scene.

    Args:
        scene: Now.
        shape: Of the observation.

    Returns:
        float32 arrays in [-1, 1]: `ego` (6,), `vehicles` (bodies, 8) with `mask`
        (bodies,) that is 1 where there is one, `path` (points, 5), `lanes` (3, 2) from
        right to left, `signals` (2,).
    """
    vehicles, mask = _bodies(scene, shape.bodies)
    arrays = {
        "ego": _ego(scene),
        "vehicles": vehicles,
        "mask": mask,
        "path": _path(scene, shape),
        "lanes": _lanes(scene),
        "signals": _signals(scene),
    }
    return {
        name: np.clip(values, -1.0, 1.0).astype(np.float32)
        for name, values in arrays.items()
    }


def _ego(scene: Scene) -> FloatArray:
    """Return the ego's motion, (6,)."""
    ego, frenet = scene.ego, scene.ego_frenet
    _, _, road = scene.path.pose(frenet.s)
    error = math.remainder(ego.heading - road, math.tau)
    return np.array(
        (
            ego.speed / SPEED,
            ego.acceleration / ACCELERATION,
            ego.curvature / CURVATURE,
            frenet.l / OFFSET,
            error / math.pi,
            scene.target_speed / SPEED,
        )
    )


def _bodies(scene: Scene, most: int) -> tuple[FloatArray, FloatArray]:
    """Return the nearest bodies and which rows hold one."""
    rows, mask = np.zeros((most, len(BODY))), np.zeros(most)
    users, static = scene.vehicles.table, scene.obstacles
    n = users.shape[1]
    table = np.zeros((6, n + len(static.ids)))  # x, y, heading, speed, length, width
    table[:4, :n], table[4:, :n] = users[:4], users[6:]
    grown = 2.0 * static.radius
    table[0, n:], table[1, n:], table[2, n:] = static.x, static.y, static.heading
    table[4, n:], table[5, n:] = static.length + grown, static.width + grown
    ego = scene.ego
    cos, sin = math.cos(ego.heading), math.sin(ego.heading)
    dx, dy = table[0] - ego.x, table[1] - ego.y
    far = np.hypot(dx, dy)
    order = np.argsort(far, kind="stable")[:most]
    order = order[far[order] <= AHEAD]
    dx, dy, (_, _, heading, speed, length, width) = (
        dx[order],
        dy[order],
        table[:, order],
    )
    turned = heading - ego.heading
    turned_cos, turned_sin = np.cos(turned), np.sin(turned)
    k = order.size
    rows[:k, 0] = (dx * cos + dy * sin) / AHEAD
    rows[:k, 1] = (dy * cos - dx * sin) / ASIDE
    rows[:k, 2] = (speed * turned_cos - ego.speed) / SPEED
    rows[:k, 3] = speed * turned_sin / SPEED
    rows[:k, 4], rows[:k, 5] = turned_cos, turned_sin
    rows[:k, 6], rows[:k, 7] = length / LENGTH, width / WIDTH
    mask[:k] = 1.0
    return rows, mask


def _path(scene: Scene, shape: ObservationShape) -> FloatArray:
    """Return points of the reference path ahead, and the road's bounds there."""
    ego = scene.ego
    s = scene.ego_frenet.s + shape.spacing * np.arange(1, shape.points + 1)
    s = np.minimum(s, scene.path.length)
    road = scene.path.at(s)
    left, right = scene.road.at(s)
    cos, sin = math.cos(ego.heading), math.sin(ego.heading)
    dx, dy = road.x - ego.x, road.y - ego.y
    return np.column_stack(
        (
            (dx * cos + dy * sin) / AHEAD,
            (dy * cos - dx * sin) / ASIDE,
            road.curvature / CURVATURE,
            left / OFFSET,
            right / OFFSET,
        )
    )


def _lanes(scene: Scene) -> FloatArray:
    """Return the lanes to the right, under and to the left of the ego, (3, 2)."""
    rows = np.zeros((len(LANES), len(LANE)))
    centres = lane_centres(scene)
    if not centres.size:
        return rows
    own = int(np.abs(centres - scene.ego_frenet.l).argmin())
    for row, place in enumerate((own - 1, own, own + 1)):
        if 0 <= place < centres.size:
            rows[row] = 1.0, (centres[place] - scene.ego_frenet.l) / OFFSET
    return rows


def lane_centres(scene: Scene) -> FloatArray:
    """Return the offsets of the lanes that exist beside the ego, right to left [m]."""
    centres, widths = scene.lanes.at(scene.ego_frenet.s)
    found: FloatArray = centres[widths > 0.0]
    return found


def _signals(scene: Scene) -> FloatArray:
    """Return whether a stop line ahead is closed, and how far the front is from it."""
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    ahead = [s - front for s in scene.stop_lines if s > front - 1.0]
    if not ahead:
        return np.array((0.0, 1.0))
    return np.array((1.0, min(ahead) / STOP))
