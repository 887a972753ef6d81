"""A way out: made of arcs where the ego stands, driven along from cycle to cycle."""

import math
from dataclasses import dataclass

import numpy as np

from planner.reference_path.path import ReferencePath
from planner.scene import Scene
from planner.states import CartesianState, FloatArray, Trajectory
from planner.way_out.search import ARC, ArcBody, Ground, driven, find_way, gap_to_points

SPACING = 0.3  # of points on edges and outlines [m]
PATH_SPACING = 0.5  # [m]
BEHIND = 15.0  # the ego's rear axle, where the road is looked at [m]
BEYOND = 25.0  # the end of a way [m]
STANDS = 1.0  # a slower vehicle is in the way for as long as it takes to go round [m/s]
MARGINS = (0.3, 0.15)  # kept to all, the first with which there is a way [m]
LEAST_MARGIN = 0.03  # to where the ego stands nearer than that [m]
PLACES = 60_000  # looked at
FINE = 0.1  # between the points of a way [m]
ON_IT = 0.25  # the ego may be this far from its way [m]


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Points `FINE` apart, (n,); the ego is on it or has left it."""

    x: FloatArray  # [m]
    y: FloatArray  # [m]
    heading: FloatArray  # [rad]
    curvature: FloatArray  # of the arc that leads on [1/m]

    @property
    def length(self) -> float:
        """Its length [m]."""
        return FINE * (self.x.size - 1)

    def along(self, ego: CartesianState) -> float | None:
        """Return how far along it the ego is [m]; None if it is not on it."""
        apart = np.hypot(self.x - ego.x, self.y - ego.y)
        k = int(np.argmin(apart))
        if float(apart[k]) > ON_IT:
            return None
        cos, sin = math.cos(self.heading[k]), math.sin(self.heading[k])
        rest = (ego.x - self.x[k]) * cos + (ego.y - self.y[k]) * sin
        return float(np.clip(FINE * k + rest, 0.0, self.length))


def way_from(scene: Scene, reach: float) -> Way | None:
    """Find a way on from where the ego stands; None without one.

    Args:
        scene: Of this cycle.
        reach: How far it leads along the path [m].
    """
    vehicle, ego = scene.vehicle, scene.ego
    body = ArcBody(
        vehicle.rear_overhang,
        vehicle.front_reach,
        0.5 * vehicle.width,
        vehicle.limits.max_curvature,
    )
    s = scene.ego_frenet.s
    span = (s - BEHIND, s + reach + vehicle.front_reach + BEYOND)
    points = in_the_way(scene, span)
    path = sampled(scene.path, span)
    now = gap_to_points((ego.x, ego.y, ego.heading), body, points)
    start = (ego.x, ego.y, ego.heading, ego.curvature)
    for margin in MARGINS:
        kept = max(min(margin, now - 1e-3), LEAST_MARGIN)
        ground = Ground(points, path, kept)
        arcs, led = find_way(start, body, ground, reach, PLACES)
        if led >= reach:
            return _of_arcs(ego, arcs)
    return None


def in_the_way(scene: Scene, span: tuple[float, float]) -> FloatArray:
    """Collect what stands between two places as points, (n, 3): x, y, radius [m]."""
    road, path = scene.road, scene.path
    s = np.arange(max(span[0], 0.0), min(span[1], path.length), SPACING)
    at, found = path.at(s), []
    for l in road.at(s):
        x, y = at.x - l * at.sin_heading, at.y + l * at.cos_heading
        found.append(np.column_stack((x, y, np.zeros(s.size))))
    fixed, users = scene.obstacles, scene.vehicles
    rows = [
        *zip(
            *(fixed.x, fixed.y, fixed.heading),
            *(fixed.length, fixed.width, fixed.radius),
            strict=True,
        ),
        *(
            (*row[:5], 0.0)
            for row in zip(
                *(users.x, users.y, users.heading, users.length, users.width),
                users.speed,
                strict=True,
            )
            if row[5] < STANDS
        ),
    ]
    near = max(span[1] - span[0], 0.0)
    found.extend(
        _outline(*map(float, row))
        for row in rows
        if math.hypot(row[0] - scene.ego.x, row[1] - scene.ego.y) < near
    )
    return np.vstack(found)


def sampled(path: ReferencePath, span: tuple[float, float]) -> FloatArray:
    """Return the path between two places, (n, 4): s, x, y, heading."""
    s = np.arange(max(span[0], 0.0), min(span[1], path.length), PATH_SPACING)
    at = path.at(s)
    return np.column_stack((s, at.x, at.y, np.unwrap(at.heading)))


def _outline(
    x: float, y: float, heading: float, length: float, width: float, radius: float
) -> FloatArray:
    """Return points on the outline of a rectangle, (n, 3)."""
    along = np.linspace(-0.5, 0.5, max(math.ceil(length / SPACING), 1) + 1) * length
    across = np.linspace(-0.5, 0.5, max(math.ceil(width / SPACING), 1) + 1) * width
    u = np.concatenate([along, along, 0 * across - length / 2, 0 * across + length / 2])
    v = np.concatenate([0 * along - width / 2, 0 * along + width / 2, across, across])
    cos, sin = math.cos(heading), math.sin(heading)
    points = (x + u * cos - v * sin, y + u * sin + v * cos, np.full(u.size, radius))
    return np.unique(np.column_stack(points), axis=0)


def _of_arcs(ego: CartesianState, arcs: FloatArray) -> Way:
    """Lay points on arcs that begin where the ego is."""
    steps = round(ARC / FINE)
    place = (ego.x, ego.y, ego.heading)
    rows: list[tuple[float, ...]] = []
    for curvature in arcs.tolist():
        rows.extend(
            (*driven(place, curvature, FINE * k), curvature) for k in range(steps)
        )
        place = driven(place, curvature, ARC)
    rows.append((*place, float(arcs[-1]) if arcs.size else 0.0))
    x, y, heading, curvature = np.array(rows).T
    return Way(x, y, heading, curvature)


def drive_along(
    scene: Scene, way: Way, along: float, drive: tuple[float, float], horizon: float
) -> Trajectory:
    """Drive along a way, and stop at its end.

    Args:
        scene: Of this cycle.
        way: That the ego is on.
        along: How far along it the ego is [m].
        drive: Wished speed [m/s], and the acceleration and braking used [m/s²].
        horizon: Of the trajectory [s].
    """
    wished, pace = drive
    step = scene.step
    t = step * np.arange(round(horizon / step) + 1, dtype=np.float64)
    at, speed = np.empty(t.size), np.empty(t.size)
    gone, v = 0.0, max(scene.ego.speed, 0.0)
    left = way.length - along
    for k in range(t.size):
        at[k], speed[k] = gone, v
        stop = math.sqrt(max(2.0 * pace * (left - gone - v * step), 0.0))
        aim = min(wished, stop)
        after = min(max(aim, v - 2.0 * pace * step), v + pace * step)
        after = max(after, 0.0)
        gone, v = min(gone + 0.5 * (v + after) * step, left), after
    acceleration = np.append(np.diff(speed) / step, 0.0)
    place = (along + at) / FINE
    number = np.arange(way.x.size)
    x, y = np.interp(place, number, way.x), np.interp(place, number, way.y)
    heading = np.interp(place, number, way.heading)
    index = np.minimum(place.astype(np.int64), way.x.size - 1)
    x, y, heading = x.copy(), y.copy(), heading.copy()
    # begins where the ego is, and joins the way within a metre
    fade = np.clip(1.0 - at, 0.0, 1.0)
    x += fade * (scene.ego.x - x[0])
    y += fade * (scene.ego.y - y[0])
    turn = math.remainder(scene.ego.heading - heading[0], 2.0 * math.pi)
    heading = heading + fade * turn
    s, l = scene.path.project(x, y, near=scene.ego_frenet.s + at)
    return Trajectory(t, x, y, heading, way.curvature[index], speed, acceleration, s, l)
