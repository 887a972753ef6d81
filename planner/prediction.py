"""Where other vehicles will be: simple predictors behind one signature, `Predictor`."""

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled, inlined
from planner.numerics.interpolation import interpolated
from planner.reference_path.frenet import FRENET_REACH, MIN_STRETCH
from planner.reference_path.linear_curvature import curvature_at, point_at
from planner.reference_path.path import (
    PathTable,
    ReferencePath,
    as_input,
)
from planner.reference_path.projection import EVERYWHERE, NO_DIRECTION, foot
from planner.scene import Lanes, Prediction, RoadUsers
from planner.states import FloatArray, IntArray

# A vehicle follows the ego's road while its heading and place agree with the road.
LANE_HEADING_TOLERANCE = 0.5  # [rad]; lane changes stay below 0.2, turns exceed it
LANE_REACH = 20.0  # [m]; two carriageways of three lanes
# One that moves sideways at walking speed stands askew in SUMO, but changes its lane.
ASKEW_TOLERANCE = 1.2  # the same of a vehicle that moves over [rad]
MOVING_OVER = 0.2  # a vehicle faster than this sideways changes its lane [m/s]
NO_LANES = Lanes.none()
LATERAL_HOLD = 1.5  # for which a lateral speed is held where no lanes are known [s]


class Predictor(Protocol):
    """A model of where other vehicles will be."""

    def __call__(
        self,
        path: ReferencePath,
        vehicles: RoadUsers,
        times: FloatArray,
        lanes: Lanes | None = None,
    ) -> Prediction:
        """Predict vehicles.

        Args:
            path: Reference path of the ego.
            vehicles: As they are now.
            times: Evenly spaced from 0 on, at least two, (n_steps,) [s].
            lanes: Of the ego's carriageway, if they are known.

        Returns:
            The prediction, (n, n_steps).
        """
        ...


def constant_speed(
    path: ReferencePath,
    vehicles: RoadUsers,
    times: FloatArray,
    lanes: Lanes | None = None,
) -> Prediction:
    """Keep the speed, along the lane where there is one, else along the heading.

    A lane change goes on to the middle of the lane that it leads to; where none is
    known, a lateral speed is held for `LATERAL_HOLD`. The acceleration is not used. See
    `Predictor`.
    """
    return _roll_out(path, vehicles, times, lanes, brake=False)


def held_braking(
    path: ReferencePath,
    vehicles: RoadUsers,
    times: FloatArray,
    lanes: Lanes | None = None,
) -> Prediction:
    """Predict as `constant_speed`, but let braking vehicles brake until they stand.

    A vehicle that brakes for a signal, a queue or an obstacle does so for longer than
    an instant; one that speeds up may stop doing so at any time. See `Predictor`.
    """
    return _roll_out(path, vehicles, times, lanes, brake=True)


# those that a scenario can name
PREDICTORS: Mapping[str, Predictor] = {
    "constant_speed": constant_speed,
    "held_braking": held_braking,
}


def _roll_out(
    path: ReferencePath,
    vehicles: RoadUsers,
    times: FloatArray,
    lanes: Lanes | None,
    *,
    brake: bool,
) -> Prediction:
    """Move each vehicle along its lane or heading."""
    if times.size < 2:
        raise InvalidInputError(f"a prediction needs two times, not {times.size}")
    aims = _aims(path, vehicles, lanes)
    table = roll_out(path.table, vehicles.table, as_input(times), brake, aims)
    return Prediction.from_table(float(times[1] - times[0]), table)


def _aims(path: ReferencePath, vehicles: RoadUsers, lanes: Lanes | None) -> FloatArray:
    """Find where lane changes end: the middle of the next lane on their way.

    Args:
        path: Of the ego.
        vehicles: As they are now.
        lanes: Of the ego's carriageway, if they are known.

    Returns:
        Offsets, (n,) [m]; inf where none is known, nan where no lane is changed.
    """
    moving = (np.abs(vehicles.lateral_speed) > MOVING_OVER).nonzero()[0]
    if not moving.size:
        return np.full(len(vehicles.ids), np.nan)
    known = NO_LANES if lanes is None else lanes
    s, l = path.project(vehicles.x[moving], vehicles.y[moving])
    found: FloatArray = _lanes_aimed_at(
        path.table, vehicles.table, (known.s, known.centre, known.width), moving, s, l
    )
    return found


@compiled
def _lanes_aimed_at(
    path: PathTable,
    vehicles: FloatArray,
    lanes: tuple[FloatArray, FloatArray, FloatArray],
    moving: IntArray,
    s: FloatArray,
    l: FloatArray,
) -> FloatArray:
    """Compute the aims of `_aims`.

    Args:
        path: Tables of the reference path.
        vehicles: Rows as in `roll_out`, (8, n).
        lanes: Arc lengths, centres and widths, as in `Lanes`.
        moving: Which of the vehicles move sideways, (m,).
        s: Of these, (m,) [m].
        l: Of these, (m,) [m].
    """
    lanes_s, centre, width = lanes
    aims = np.full(vehicles.shape[1], np.nan)
    for k in range(moving.size):
        v, least = moving[k], np.inf
        aims[v] = np.inf
        along = math.cos(vehicles[2, v] - point_at(path.knots, path.bins, s[k])[6])
        rate = vehicles[5, v] if along > 0.0 else -vehicles[5, v]
        for lane in range(centre.shape[0]):
            if not interpolated(s[k : k + 1], lanes_s, width[lane])[0] > 0.0:
                continue
            offset = interpolated(s[k : k + 1], lanes_s, centre[lane])[0]
            if (offset - l[k]) * rate >= 0.0 and abs(offset - l[k]) < least:
                aims[v], least = offset, abs(offset - l[k])
    return aims


@compiled
def driven_distances(
    speed: FloatArray,
    acceleration: FloatArray,
    times: FloatArray,
    brake: bool,  # noqa: FBT001 - compiled
) -> FloatArray:
    """Compute how far vehicles have driven, (n, n_steps) [m].

    Args:
        speed: Now, (n,) [m/s].
        acceleration: Now, (n,) [m/s²].
        times: (n_steps,) [s].
        brake: Whether those that brake go on doing so until they stand.
    """
    distance = np.empty((speed.size, times.size))
    for v in range(speed.size):
        braking = np.minimum(acceleration[v], -1e-3)
        for i in range(times.size):
            if brake:
                until = np.minimum(times[i], -speed[v] / braking)  # time in motion
                distance[v, i] = speed[v] * until + 0.5 * braking * (until * until)
            else:
                distance[v, i] = speed[v] * times[i]
    return distance


@compiled
def roll_out(
    path: PathTable,
    vehicles: FloatArray,
    times: FloatArray,
    brake: bool,  # noqa: FBT001 - compiled
    aims: FloatArray,
) -> FloatArray:
    """Move vehicles along their lanes or headings.

    Args:
        path: Tables of the reference path.
        vehicles: Rows as in `planner.scene.COLUMNS`, (8, n).
        times: (n_steps,) [s].
        brake: As in `driven_distances`.
        aims: Offsets at which lane changes end, (n,) [m]; inf where that is not known,
            nan where no lane is changed.

    Returns:
        (5, n, n_steps): x, y, heading, s, l as in `Prediction`.
    """
    x, y, heading, speed = vehicles[0], vehicles[1], vehicles[2], vehicles[3]
    lateral_speed = vehicles[5]
    distance = driven_distances(speed, vehicles[4], times, brake)
    n, n_steps = distance.shape
    step = times[1] - times[0]
    out = np.empty((5, n, n_steps))
    for v in range(n):
        s, l = foot(
            path.knots, path.bins, path.blocks, x[v], y[v], EVERYWHERE, NO_DIRECTION
        )
        _, _, _, _, kappa, _, road_heading = point_at(path.knots, path.bins, s)
        error = heading[v] - road_heading
        along = np.cos(error)  # +1 with the road, -1 against it
        moves_over = not np.isnan(aims[v])
        tolerance = ASKEW_TOLERANCE if moves_over else LANE_HEADING_TOLERANCE
        if (
            abs(along) > np.cos(tolerance)
            and abs(l) < LANE_REACH
            and 1.0 - kappa * l > MIN_STRETCH
        ):
            direction = 1.0 if along > 0.0 else -1.0
            drift = direction * lateral_speed[v] * step
            steps = LATERAL_HOLD / step
            if moves_over and np.isfinite(aims[v]):
                steps = (aims[v] - l) / drift
            askew = error if along > 0.0 else (error - np.pi)
            askew = (askew + np.pi) % (2.0 * np.pi) - np.pi
            turn = (0.0 if moves_over else 1.0, vehicles[6, v])
            start = (s, l, drift, error - askew, askew)
            follow_road(path, v, start, (direction, steps, *turn), distance, out)
        else:
            near = abs(l) < 3.0 * FRENET_REACH
            go_straight(path, v, (x[v], y[v], heading[v]), near, distance, out)
    return out


@inlined
def follow_road(
    path: PathTable,
    v: int,
    start: tuple[float, float, float, float, float],
    course: tuple[float, float, float, float],
    distance: FloatArray,
    out: FloatArray,
) -> None:
    """Drive vehicle `v` along the path at its offset.

    ds = d(distance) / (1 - kappa_r l), by the midpoint rule. One that stands askew
    straightens within its own length, once it drifts no more: its rear follows its
    front.

    Args:
        path: Tables of the path.
        v: Row of `distance` and `out`.
        start: s [m], l [m], change of l in one step while it drifts [m], heading along
            the path, 0 or a half turn [rad], and how far it is off that [rad].
        course: 1 with the path, -1 against it; how many steps it drifts; 1 if its
            heading leads it aside, 0 if its drift says all; its length [m].
        distance: Driven, (n, n_steps) [m].
        out: Filled, see `roll_out`.
    """
    knots, bins = path.knots, path.bins
    s, l0, drift, along, askew = start
    direction, steps, leads, length = course
    left, aside, turned, way = 1.0, 0.0, askew, 0.0
    for i in range(distance.shape[1]):
        if i > 0:
            way = distance[v, i] - distance[v, i - 1]
            if leads > 0.0 or i > steps:
                left = max(left - way / length, 0.0)
            mean = 0.5 * leads * (turned + askew * left)
            aside += direction * way * np.sin(mean)
            way *= np.cos(mean)
            turned = askew * left
        l = l0 + drift * min(1.0 * i, steps) + aside
        if i > 0:
            driven = direction * way
            stretch = max(1.0 - curvature_at(knots, bins, s) * l, MIN_STRETCH)
            middle = s + 0.5 * driven / stretch
            stretch = max(1.0 - curvature_at(knots, bins, middle) * l, MIN_STRETCH)
            s += driven / stretch
        x, y, cos, sin, _, _, heading = point_at(knots, bins, s)
        out[0, v, i] = x - l * sin
        out[1, v, i] = y + l * cos
        out[2, v, i] = heading + along + turned
        out[3, v, i] = s
        out[4, v, i] = l


@inlined
def go_straight(
    path: PathTable,
    v: int,
    start: tuple[float, float, float],
    near: bool,  # noqa: FBT001 - compiled
    distance: FloatArray,
    out: FloatArray,
) -> None:
    """Drive vehicle `v` along its heading; it has a place on the path if `near`."""
    x0, y0, heading = start
    cos, sin = np.cos(heading), np.sin(heading)
    for i in range(distance.shape[1]):
        x, y = x0 + distance[v, i] * cos, y0 + distance[v, i] * sin
        s, l = np.inf, 0.0
        if near:
            s, l = foot(
                path.knots, path.bins, path.blocks, x, y, EVERYWHERE, NO_DIRECTION
            )
            if not abs(l) < FRENET_REACH:
                s, l = np.inf, 0.0
        out[0, v, i] = x
        out[1, v, i] = y
        out[2, v, i] = heading
        out[3, v, i] = s
        out[4, v, i] = l
