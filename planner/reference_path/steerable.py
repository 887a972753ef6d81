"""Paths of bounded curvature through narrow bends, the whole body inside an area.

Lane centre lines of road networks turn corners that no vehicle can follow. Here such a
stretch is planned anew: the curvature at even stations is the unknown, the pose follows
by integration, and a sequence of quadratic programs (linearised anew in each round)
keeps the outline of the body inside a polygon, the curvature and its rate within the
limits of the steering, and the path near its guide.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled
from planner.states import FloatArray
from planner.vehicle import Vehicle

STATION = 0.75  # [m], between unknowns
OUTLINE_STEP = 2.4  # [m], between points of the body's sides
CURVATURE_RATE = 0.1  # [1/m²]; 0.4 rad/s at the wheels of a car at 1.5 m/s
RATE_WEIGHT = 20.0  # of (dκ/ds)² [m³]
CURVATURE_WEIGHT = 1.0  # of κ² [m]
GUIDE_WEIGHT = 0.02  # of the squared distance from the guide [1/m³]
END_WEIGHT = 1e3  # of the squared error of the end pose
OUTSIDE_PENALTY = 50.0  # of the farthest reach beyond the area [1/m]
REGULARISATION = 1e-6  # keeps the Hessian definite
TINY = 1e-12  # [m]
ROUNDS = 40
LOOSE_ROUNDS = 10  # in which the end pose weighs a tenth
STRETCH = 0.05  # share by which the spacing may change in one round
SHIFTS = (0.0, 3.0, -3.0, 6.0, -6.0)  # of first guesses along the guide [m]
FIRST_STEP = 0.05  # trust region of the curvature [1/m]
SHRINK = 0.92  # of the trust region from round to round
SETTLED = 2e-4  # changes of the curvature below this end the rounds [1/m]
NEAR = 0.6  # outline points nearer to the boundary than this are constrained [m]
END_TOLERANCE = 0.02  # [m] and [rad]

X, Y, HEADING, CURVATURE, SPACING = range(5)  # the unknowns of a program, in order


@dataclass(frozen=True, slots=True)
class SteeringLimits:
    """What a steerable path keeps; `margin` is the least distance from the boundary."""

    curvature: float  # [1/m]
    curvature_rate: float = CURVATURE_RATE  # [1/m²]
    margin: float = 0.1  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class SteerablePath:
    """A planned stretch; arrays are (n,).

    `outside` is how far the outline of the body reaches over the margin, 0 where the
    path is drivable; `end_error` how far the end misses the pose asked for.
    """

    x: FloatArray  # rear axle [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    curvature: FloatArray  # [1/m]
    outside: float  # [m]
    end_error: float  # [m], [rad], the larger one

    @property
    def fault(self) -> float:
        """How far from drivable [m]."""
        return self.outside + (
            self.end_error if self.end_error > END_TOLERANCE else 0.0
        )

    @property
    def drivable(self) -> bool:
        """Whether the whole body stays inside and the end is met."""
        return self.outside <= 0.0 and self.end_error <= END_TOLERANCE


class _Motion(NamedTuple):
    """Poses at the stations and what they follow from, (n,)."""

    x: FloatArray  # [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    middle: FloatArray  # heading between two stations, (n - 1,) [rad]
    lever: FloatArray  # of a change of the spacing on it, (n - 1,) [1/m]


class _Task(NamedTuple):
    """What is planned: from where to where, inside what, with which body."""

    guide: FloatArray  # (m, 2) [m]
    boundary: FloatArray  # (k, 4) [m]
    outline: FloatArray  # (p, 2), of the body and the margin, rear axle at 0 [m]
    box: tuple[float, float, float]  # of the same: back, front, half the width [m]
    limits: SteeringLimits
    start: tuple[float, float, float]  # x, y [m], heading [rad]
    end: tuple[float, float, float]


class _Iterate(NamedTuple):
    """One round's unknowns and what follows from them."""

    curvature: FloatArray  # at the stations, (n,) [1/m]
    spacing: float  # of the stations [m]
    motion: _Motion


def steerable_path(
    guide: FloatArray,
    boundary: FloatArray,
    vehicle: Vehicle,
    limits: SteeringLimits,
    shifts: tuple[float, ...] = SHIFTS,
) -> SteerablePath:
    """Plan a path from the begin of a guide to its end, with their directions.

    Args:
        guide: Polyline, (m, 2) [m]; its first and last sides are straight for some
            metres. It may have corners.
        boundary: Sides of the polygons that enclose the area, (k, 4) as x, y of both
            ends [m].
        vehicle: Whose body stays inside; the path is that of its rear axle.
        limits: Of the path.
        shifts: By how much the first guesses turn later than the guide; they are
            tried in turn until a path is drivable [m].

    Returns:
        The path. It need not be drivable: see `SteerablePath.drivable`.

    Raises:
        InvalidInputError: If the guide is too short for a path.
    """
    best = _planned(guide, boundary, vehicle, limits, shifts[0])
    for shift in shifts[1:]:
        if best.fault <= limits.margin:
            break
        found = _planned(guide, boundary, vehicle, limits, shift)
        if found.fault < best.fault:
            best = found
    return best


def _planned(
    guide: FloatArray,
    boundary: FloatArray,
    vehicle: Vehicle,
    limits: SteeringLimits,
    shift: float,
) -> SteerablePath:
    """Plan from one first guess, which turns `shift` metres later than the guide."""
    points, s = _even_points(guide)
    heading = _smooth_heading(points, s, limits.curvature)
    heading = np.interp(s - shift, s, heading)
    curvature = np.gradient(heading, s[1])
    curvature = np.clip(curvature, -limits.curvature, limits.curvature)
    curvature[[0, -1]] = 0.0
    task = _Task(
        guide,
        boundary,
        body_outline(vehicle, limits.margin),
        _box(vehicle, limits.margin),
        limits,
        (float(points[0, 0]), float(points[0, 1]), float(heading[0])),
        (float(points[-1, 0]), float(points[-1, 1]), float(heading[-1])),
    )
    curvature, spacing = _improve(task, curvature, float(s[1]))
    motion = _integrate(curvature, spacing, task.start)
    outline = outline_points(motion.x, motion.y, motion.heading, task.outline)
    corners, _, _ = corner_distances(motion, boundary[:, :2], task.box)
    least = min(float(depths(*outline, boundary)[0].min()), float(corners.min()))
    missed = _missed(task, motion)
    return SteerablePath(
        motion.x,
        motion.y,
        motion.heading,
        curvature,
        max(0.0, -least),
        float(max(np.hypot(missed[0], missed[1]), abs(missed[2]))),
    )


def _improve(
    task: _Task, curvature: FloatArray, spacing: float
) -> tuple[FloatArray, float]:
    """Solve one linearised program after the other; (curvature, spacing)."""
    most, reach = task.limits.curvature, FIRST_STEP
    for k in range(ROUNDS):
        weight = END_WEIGHT if k >= LOOSE_ROUNDS else 0.1 * END_WEIGHT
        motion = _integrate(curvature, spacing, task.start)
        change = _step(task, _Iterate(curvature, spacing, motion), reach, weight)
        curvature = np.clip(curvature + change[:-1], -most, most)
        spacing += float(change[-1])
        reach *= SHRINK
        if np.abs(change[:-1]).max() < SETTLED and k > LOOSE_ROUNDS:
            break
    return curvature, spacing


def _missed(task: _Task, motion: _Motion) -> FloatArray:
    """Measure by how much the last pose misses the one asked for, (3,)."""
    last = np.array([motion.x[-1], motion.y[-1], motion.heading[-1]])
    return np.asarray(last - np.array(task.end))


def _even_points(guide: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Space points evenly along the guide; (points, arc lengths)."""
    sides = np.hypot(*np.diff(guide, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(sides)])
    if not along[-1] > 4.0 * STATION:
        raise InvalidInputError(f"the guide is {along[-1]:.2f} m long: too short")
    s = np.linspace(0.0, along[-1], math.ceil(along[-1] / STATION) + 1)
    return np.column_stack([np.interp(s, along, axis) for axis in guide.T]), s


def _smooth_heading(points: FloatArray, s: FloatArray, curvature: float) -> FloatArray:
    """Average the headings of the guide over a window that takes a right angle."""
    sides = np.diff(points, axis=0)
    raw = np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    width = max(1, round(0.5 * math.pi / curvature / s[1] / 2.0))
    padded = np.pad(raw, width, mode="edge")
    kernel = np.ones(2 * width + 1) / (2 * width + 1)
    middle = np.convolve(padded, kernel, mode="valid")
    return np.concatenate([[raw[0]], 0.5 * (middle[1:] + middle[:-1]), [raw[-1]]])


def _box(vehicle: Vehicle, margin: float) -> tuple[float, float, float]:
    """Measure the body grown by the margin, rear axle at 0: back, front, half width."""
    return (
        -vehicle.rear_overhang - margin,
        vehicle.front_reach + margin,
        vehicle.width / 2.0 + margin,
    )


def body_outline(vehicle: Vehicle, margin: float) -> FloatArray:
    """Place points on the outline of the body and a margin, (p, 2), rear axle at 0."""
    back, front, half = _box(vehicle, margin)
    along = np.linspace(back, front, math.ceil((front - back) / OUTLINE_STEP) + 1)
    sides = [np.column_stack([along, np.full(along.size, y)]) for y in (half, -half)]
    ends = np.array([[back, 0.0], [front, 0.0]])
    return np.concatenate([*sides, ends])


def _integrate(
    curvature: FloatArray, ds: float, start: tuple[float, float, float]
) -> _Motion:
    """Integrate the curvature, linear between stations, by the midpoint rule."""
    x0, y0, heading0 = start
    turn = 0.5 * (curvature[1:] + curvature[:-1])
    heading = heading0 + ds * np.concatenate([[0.0], np.cumsum(turn)])
    lever = 0.375 * curvature[:-1] + 0.125 * curvature[1:]
    middle = heading[:-1] + ds * lever
    x = x0 + ds * np.concatenate([[0.0], np.cumsum(np.cos(middle))])
    y = y0 + ds * np.concatenate([[0.0], np.cumsum(np.sin(middle))])
    return _Motion(x, y, heading, middle, lever)


def outline_points(
    x: FloatArray, y: FloatArray, heading: FloatArray, outline: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Place the outline at poses of the rear axle, x and y, (n, p) each."""
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    along, across = outline[:, 0], outline[:, 1]
    return (
        x[:, None] + cos * along - sin * across,
        y[:, None] + sin * along + cos * across,
    )


def _step(task: _Task, now: _Iterate, reach: float, end_weight: float) -> FloatArray:
    """Solve the program linearised here.

    Its unknowns are changes of x, y, heading and curvature of all stations, then of
    the spacing, and how far the body reaches beyond the area: many, but each row has
    few of them.

    Args:
        task: What is planned.
        now: About which is linearised.
        reach: Bound of the change of the curvature [1/m].
        end_weight: Of the squared error of the end pose.

    Returns:
        Changes of the curvatures and of the spacing, (n + 1,); zero where the solver
        finds none.
    """
    import qpsolvers  # takes 0.2 s, which most roads need not pay

    limits, n = task.limits, now.curvature.size
    hessian, gradient = _objective(task, now, end_weight)
    inside, room = _inside(task, now)
    most = limits.curvature_rate * now.spacing
    swing = _rows(n, [(CURVATURE, 1, 1.0), (CURVATURE, 0, -1.0)], n - 1)
    change = np.diff(now.curvature)
    bounds = [room, np.maximum(most - change, 0.0), np.maximum(most + change, 0.0)]
    low, high = np.full(4 * n + 2, -np.inf), np.full(4 * n + 2, np.inf)
    bent = slice(CURVATURE * n, (CURVATURE + 1) * n)
    low[bent] = np.maximum(-limits.curvature - now.curvature, -reach)
    high[bent] = np.minimum(limits.curvature - now.curvature, reach)
    low[bent.start] = high[bent.start] = -now.curvature[0]
    high[-2] = STRETCH * now.spacing
    low[-2:] = -high[-2], 0.0
    for quantity in (X, Y, HEADING):  # the first pose is given
        low[quantity * n] = high[quantity * n] = 0.0
    found = qpsolvers.solve_qp(
        hessian,
        gradient,
        sparse.vstack([inside, swing, -swing], format="csc"),
        np.concatenate(bounds),
        _dynamics(now),
        np.zeros(3 * (n - 1)),
        lb=low,
        ub=high,
        solver="piqp",
        verbose=False,
    )
    if found is None:
        return np.zeros(n + 1)
    return np.append(found[bent], found[-2])


_Entry = tuple[int, int, FloatArray | float]  # see `_rows`


def _rows(n: int, entries: Sequence[_Entry], count: int) -> sparse.csc_matrix:
    """Build rows with the same unknowns of one station after the other.

    Args:
        n: Number of stations.
        entries: (quantity, by how many stations later, factor) each; the quantity
            `SPACING` is the same one in all rows.
        count: Of the rows; the first is that of the first station.
    """
    row = np.arange(count)
    rows, columns, values = [], [], []
    for quantity, later, factor in entries:
        rows.append(row)
        own = np.full(count, quantity * n)
        columns.append(own if quantity == SPACING else own + row + later)
        values.append(np.broadcast_to(np.asarray(factor, dtype=np.float64), count))
    return sparse.csc_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, 4 * n + 2),
    )


def _dynamics(now: _Iterate) -> sparse.csc_matrix:
    """Let poses follow from curvatures, linearised: rows (3 n - 3, 4 n + 2) = 0."""
    n, ds, motion = now.curvature.size, now.spacing, now.motion
    turn = 0.5 * (now.curvature[1:] + now.curvature[:-1])
    heading: list[_Entry] = [
        (HEADING, 1, -1.0),
        (HEADING, 0, 1.0),
        (CURVATURE, 0, 0.5 * ds),
        (CURVATURE, 1, 0.5 * ds),
        (SPACING, 0, turn),
    ]
    blocks = [_rows(n, heading, n - 1)]
    cos, sin = np.cos(motion.middle), np.sin(motion.middle)
    for quantity, along, by in ((X, cos, -ds * sin), (Y, sin, ds * cos)):
        pose: list[_Entry] = [
            (quantity, 1, -1.0),
            (quantity, 0, 1.0),
            (HEADING, 0, by),
            (CURVATURE, 0, 0.375 * ds * by),
            (CURVATURE, 1, 0.125 * ds * by),
            (SPACING, 0, along + by * motion.lever),
        ]
        blocks.append(_rows(n, pose, n - 1))
    return sparse.csc_matrix(sparse.vstack(blocks))


def _objective(
    task: _Task, now: _Iterate, end_weight: float
) -> tuple[sparse.csc_matrix, FloatArray]:
    """Sum the squares; (Hessian, gradient) by the unknowns of `_step`."""
    n, ds, motion = now.curvature.size, now.spacing, now.motion
    off, normal_x, normal_y = offsets(motion.x, motion.y, task.guide)
    rate = [(CURVATURE, 1, 1.0 / ds), (CURVATURE, 0, -1.0 / ds)]
    ends = np.array([(quantity + 1) * n - 1 for quantity in (X, Y, HEADING, CURVATURE)])
    last = sparse.csc_matrix((np.ones(4), (np.arange(4), ends)), shape=(4, 4 * n + 2))
    squares: list[tuple[sparse.csc_matrix, FloatArray, float]] = [
        (_rows(n, rate, n - 1), np.diff(now.curvature) / ds, RATE_WEIGHT * ds),
        (_rows(n, [(CURVATURE, 0, 1.0)], n), now.curvature, CURVATURE_WEIGHT * ds),
        (_rows(n, [(X, 0, normal_x), (Y, 0, normal_y)], n), off, GUIDE_WEIGHT * ds),
        (last, np.append(_missed(task, motion), now.curvature[-1]), end_weight),
    ]
    hessian = REGULARISATION * sparse.identity(4 * n + 2, format="csc")
    gradient = np.zeros(4 * n + 2)
    for rows, values, weight in squares:
        hessian = hessian + 2.0 * weight * (rows.T @ rows)
        gradient += 2.0 * weight * (values @ rows)
    gradient[-1] = OUTSIDE_PENALTY
    return sparse.csc_matrix(hessian), gradient


def _inside(task: _Task, now: _Iterate) -> tuple[sparse.csc_matrix, FloatArray]:
    """Keep the body inside: rows (q, 4 n + 2) · change <= room (q,).

    The outline is inside the area, and no corner of the area is inside the body.
    """
    motion, n = now.motion, now.curvature.size
    x, y = outline_points(motion.x, motion.y, motion.heading, task.outline)
    depth, inward_x, inward_y = depths(x, y, task.boundary)
    i, p = np.nonzero(depth < NEAR)
    gx, gy = inward_x[i, p], inward_y[i, p]
    arm_x, arm_y = -(y - motion.y[:, None])[i, p], (x - motion.x[:, None])[i, p]
    corners = task.boundary[:, :2]
    apart, away_x, away_y = corner_distances(motion, corners, task.box)
    j, c = np.nonzero(apart < NEAR)
    # a body that moves away from the corner is one that the corner moves away from
    ux, uy = -away_x[j, c], -away_y[j, c]
    turn_x, turn_y = -(corners[c, 1] - motion.y[j]), corners[c, 0] - motion.x[j]
    station = np.concatenate([i, j])
    by_x, by_y = np.concatenate([gx, ux]), np.concatenate([gy, uy])
    by_heading = np.concatenate([gx * arm_x + gy * arm_y, ux * turn_x + uy * turn_y])
    count = station.size
    beyond = np.full(count, 4 * n + 1)
    columns = [X * n + station, Y * n + station, HEADING * n + station, beyond]
    values = [-by_x, -by_y, -by_heading, np.full(count, -1.0)]
    rows = sparse.csc_matrix(
        (
            np.concatenate(values),
            (np.tile(np.arange(count), 4), np.concatenate(columns)),
        ),
        shape=(count, 4 * n + 2),
    )
    return rows, np.concatenate([depth[i, p], apart[j, c]])


def corner_distances(
    motion: _Motion, corners: FloatArray, box: tuple[float, float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure how far corners of the area are from the body, negative inside it.

    Args:
        motion: Poses of the body, (n,).
        corners: (k, 2) [m].
        box: The body: back, front and half the width [m].

    Returns:
        (distance [m], x and y of the unit vector out of the body), (n, k) each.
    """
    back, front, half = box
    cos, sin = np.cos(motion.heading)[:, None], np.sin(motion.heading)[:, None]
    dx, dy = corners[:, 0] - motion.x[:, None], corners[:, 1] - motion.y[:, None]
    u, v = dx * cos + dy * sin, dy * cos - dx * sin
    u = u - 0.5 * (back + front)
    out_u, out_v = np.abs(u) - 0.5 * (front - back), np.abs(v) - half
    beside = np.hypot(np.maximum(out_u, 0.0), np.maximum(out_v, 0.0))
    inside = np.maximum(out_u, out_v)
    distance = np.where(beside > 0.0, beside, inside)
    # inside, or straight beside a side, the nearest side is the way out
    along = np.where(beside > 0.0, np.maximum(out_u, 0.0), out_u >= out_v)
    across = np.where(beside > 0.0, np.maximum(out_v, 0.0), out_u < out_v)
    length = np.maximum(np.hypot(along, across), TINY)
    along, across = np.sign(u) * along / length, np.sign(v) * across / length
    return distance, along * cos - across * sin, along * sin + across * cos


@compiled
def depths(
    x: FloatArray, y: FloatArray, boundary: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure how deep points lie inside polygons, negative outside.

    Args:
        x: (n, p) [m].
        y: (n, p) [m].
        boundary: Sides, (k, 4); which side is inside follows from counting crossings.

    Returns:
        (depth [m], x and y of the unit vector that leads inward), (n, p) each.
    """
    depth = np.empty(x.shape)
    inward_x, inward_y = np.empty(x.shape), np.empty(x.shape)
    for i in range(x.shape[0]):
        for p in range(x.shape[1]):
            px, py = x[i, p], y[i, p]
            best, gx, gy, sx, sy = np.inf, 0.0, 0.0, 1.0, 0.0
            inside = False
            for k in range(boundary.shape[0]):
                ax, ay, bx, by = boundary[k]
                if (ay > py) != (by > py) and px < ax + (py - ay) / (by - ay) * (
                    bx - ax
                ):
                    inside = not inside
                ux, uy = bx - ax, by - ay
                square = ux * ux + uy * uy
                share = 0.0
                if square > 0.0:
                    share = min(
                        max(((px - ax) * ux + (py - ay) * uy) / square, 0.0), 1.0
                    )
                dx, dy = px - ax - share * ux, py - ay - share * uy
                distance = dx * dx + dy * dy
                if distance < best:
                    best, gx, gy, sx, sy = distance, dx, dy, ux, uy
            length = math.sqrt(best)
            if length > 1e-9:
                gx, gy = gx / length, gy / length
            else:
                side = math.hypot(sx, sy)
                gx, gy = -sy / side, sx / side
            depth[i, p] = length if inside else -length
            inward_x[i, p] = gx if inside else -gx
            inward_y[i, p] = gy if inside else -gy
    return depth, inward_x, inward_y


@compiled
def offsets(
    x: FloatArray, y: FloatArray, line: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure the distance of points from a polyline and the direction away from it.

    Args:
        x: (n,) [m].
        y: (n,) [m].
        line: (m, 2) [m].

    Returns:
        (distance [m], x and y of the unit vector away from the line), (n,) each.
    """
    distance = np.empty(x.size)
    away_x, away_y = np.zeros(x.size), np.zeros(x.size)
    for i in range(x.size):
        best, gx, gy = np.inf, 0.0, 0.0
        for k in range(line.shape[0] - 1):
            ux, uy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
            square = ux * ux + uy * uy
            share = 0.0
            if square > 0.0:
                along = (x[i] - line[k, 0]) * ux + (y[i] - line[k, 1]) * uy
                share = min(max(along / square, 0.0), 1.0)
            dx = x[i] - line[k, 0] - share * ux
            dy = y[i] - line[k, 1] - share * uy
            if dx * dx + dy * dy < best:
                best, gx, gy = dx * dx + dy * dy, dx, dy
        length = math.sqrt(best)
        distance[i] = length
        if length > 1e-9:
            away_x[i], away_y[i] = gx / length, gy / length
    return distance, away_x, away_y
