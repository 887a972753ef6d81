"""Prediction of vehicles along their own ways through junctions.

A vehicle that turns follows its lanes, not its heading; one that has to give way, or
that a red light holds, stops at its line if it can.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled
from planner.prediction import MOVING_OVER, driven_distances
from planner.reference_path.frenet import FRENET_REACH
from planner.reference_path.path import PathTable, ReferencePath, as_input
from planner.reference_path.projection import EVERYWHERE, NO_DIRECTION, foot
from planner.scene import Prediction, RoadUsers
from planner.states import FloatArray, IntArray, freeze

NO_WAY = -1
FADE = 3.0  # in which a vehicle comes to the centre of its lane [s] ...
FADE_WAY = 6.0  # ... but it takes so much way; who stands stays as it stands [m]
TURNING = 5.5  # lateral acceleration with which vehicles turn at most [m/s²]
SLOWING = 3.0  # with which they slow down for it [m/s²]
BEND = 4.0  # over which the curvature of a way is taken, to both sides [m]
SOUGHT = 2.0  # between the places where it is looked for [m]
LARGEST_OFFSET = 3.0  # from its way; a vehicle farther off is not on it [m]
NEXT_LANE = 3.2  # from the centre of a lane to that of the one beside it [m]


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """The ways of vehicles, as far as they are known; arrays are (n,)."""

    way: IntArray  # place in `lines`; NO_WAY where there is none
    stop: FloatArray  # that the front has to go to where it will stop [m], inf: none
    lines: tuple[FloatArray, ...]  # arc length, x, y as rows, (3, m) each [m]

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        object.__setattr__(self, "stop", freeze(self.stop))
        way = np.array(self.way, dtype=np.int64)
        way.setflags(write=False)
        object.__setattr__(self, "way", way)
        if way.shape != self.stop.shape or np.any(way >= len(self.lines)):
            raise InvalidInputError("each vehicle needs a way that exists, or none")

    def renamed(self, names: Sequence[str], wanted: Sequence[str]) -> "Ways":
        """Return the ways of other rows: none for a name that is not known.

        Args:
            names: Of the vehicles, (n,).
            wanted: Of the rows to return.
        """
        row = {name: k for k, name in enumerate(names)}
        found = [row.get(name, NO_WAY) for name in wanted]
        way = [NO_WAY if k == NO_WAY else int(self.way[k]) for k in found]
        stop = [np.inf if k == NO_WAY else float(self.stop[k]) for k in found]
        return Ways(np.array(way, dtype=np.int64), np.array(stop), self.lines)

    def later(self, driven: FloatArray) -> "Ways":
        """Return the ways of vehicles that have driven on by (n,) [m]."""
        return Ways(self.way, np.maximum(self.stop - driven, 0.0), self.lines)

    def among(self, kept: IntArray) -> "Ways":
        """Return those of the vehicles in these rows."""
        return Ways(self.way[kept], self.stop[kept], self.lines)


def along_ways(
    prediction: Prediction,
    path: ReferencePath,
    vehicles: RoadUsers,
    ways: Ways,
    times: FloatArray,
    *,
    brake: bool,
) -> Prediction:
    """Replace the predictions of vehicles whose ways are known.

    Args:
        prediction: Of all vehicles, by another predictor.
        path: Reference path of the ego.
        vehicles: As they are now, n of them.
        ways: Of these vehicles.
        times: As of the prediction, (n_steps,) [s].
        brake: Whether those that brake go on doing so until they stand.

    Returns:
        The prediction; the same record if no way is known.
    """
    known = np.flatnonzero(ways.way != NO_WAY)
    if not known.size:
        return prediction
    times = as_input(times)
    driven = driven_distances(vehicles.speed, vehicles.acceleration, times, brake)
    out = prediction.table.copy()
    for v in known.tolist():
        line = ways.lines[ways.way[v]]
        distance = _stopped(driven[v], float(vehicles.speed[v]), ways.stop[v], times)
        follow_line(
            path.table,
            line,
            (
                float(vehicles.x[v]),
                float(vehicles.y[v]),
                float(vehicles.heading[v]),
                float(vehicles.lateral_speed[v]),
                float(vehicles.length[v]),
            ),
            distance,
            times,
            out[:, v],
        )
    return Prediction.from_table(prediction.step, out)


def _stopped(
    distance: FloatArray, speed: float, stop: float, times: FloatArray
) -> FloatArray:
    """Let a vehicle brake evenly so that it stands after `stop` [m]."""
    if not np.isfinite(stop) or speed <= 0.0:
        return distance
    room = max(float(stop), 1e-3)
    until = np.minimum(times, 2.0 * room / speed)
    braked = speed * until - speed * speed / (4.0 * room) * until * until
    return np.minimum(distance, braked)


@compiled
def follow_line(
    path: PathTable,
    line: FloatArray,
    now: tuple[float, float, float, float, float],
    distance: FloatArray,
    times: FloatArray,
    out: FloatArray,
) -> None:
    """Drive one vehicle along a polyline.

    Both its ends stay on the line, as SUMO moves it: the middle of a long one cuts the
    corner. By how much it is off this now, and turned, fades as it drives.

    One that changes its lane goes on doing so up to the centre of that lane: of its
    own one if it comes nearer to it, else of the next one.

    Args:
        path: Tables of the ego's reference path.
        line: Arc length, x, y of the corners, (3, m) [m].
        now: x, y of the vehicle's centre [m], its heading [rad], its speed to the left
            [m/s] and its length [m].
        distance: Driven, (n_steps,) [m].
        times: (n_steps,) [s].
        out: x, y, heading, s, l as in `Prediction`, (5, n_steps). Left as it is if the
            vehicle is not on the line.
    """
    x, y, heading, sideways, length = now
    front = x + 0.5 * length * np.cos(heading), y + 0.5 * length * np.sin(heading)
    begin, offset = nearest_on(line, front)
    if abs(offset) > LARGEST_OFFSET:
        return
    moves_over = abs(sideways) > MOVING_OVER
    leaves = moves_over and offset * sideways >= 0.0
    aim = np.copysign(NEXT_LANE, sideways) if leaves else 0.0
    driven = slowed_in_turns(line, begin, distance, times)
    turned, off_x, off_y = heading, 0.0, 0.0  # from how it would be on its way
    for i in range(distance.size):
        gone = min(times[i] / FADE, (driven[i] - driven[0]) / FADE_WAY)
        fades = max(1.0 - gone, 0.0)
        if moves_over:
            missing = max(abs(aim - offset) - abs(sideways) * times[i], 0.0)
            l = aim + np.copysign(missing, offset - aim)
        else:
            l = offset * fades
        on_x, on_y, heading = body_on(line, begin + driven[i], length, l)
        if i == 0:
            off_x, off_y = x - on_x, y - on_y
            turned = np.arctan2(np.sin(turned - heading), np.cos(turned - heading))
        heading += turned * fades
        x = on_x + off_x * fades
        y = on_y + off_y * fades
        s, own_l = foot(
            path.knots, path.bins, path.blocks, x, y, EVERYWHERE, NO_DIRECTION
        )
        if not abs(own_l) < FRENET_REACH:
            s, own_l = np.inf, 0.0
        out[0, i] = x
        out[1, i] = y
        out[2, i] = heading
        out[3, i] = s
        out[4, i] = own_l


@compiled
def body_on(
    line: FloatArray, at: float, length: float, l: float
) -> tuple[float, float, float]:
    """Return centre (x, y) [m] and heading [rad] of a body with both ends on a line.

    Args:
        line: Arc length, x, y of the corners, (3, m) [m].
        at: Arc length of its front [m].
        length: Of the body [m].
        l: Its offset to the left [m].
    """
    x, y = point_on(line, at)
    rear_x, rear_y = point_on(line, at - length)
    heading = np.arctan2(y - rear_y, x - rear_x)
    cos, sin = np.cos(heading), np.sin(heading)
    half = 0.5 * length
    return x - half * cos - l * sin, y - half * sin + l * cos, heading


@compiled
def slowed_in_turns(
    line: FloatArray, begin: float, distance: FloatArray, times: FloatArray
) -> FloatArray:
    """Let a vehicle slow down for the turns of its way, (n_steps,) [m].

    Its speed stays where v² |curvature| <= `TURNING`, and falls before such places with
    `SLOWING`, or as fast as it must if it is too late for that.

    Args:
        line: Arc length, x, y of the corners, (3, m) [m].
        begin: Where it is on the line [m].
        distance: Driven without turns, (n_steps,) [m].
        times: (n_steps,) [s].
    """
    n = int(distance[-1] / SOUGHT) + 2
    square = np.empty(n)  # of the allowed speed
    ahead = np.inf
    for k in range(n - 1, -1, -1):
        bent = curvature_on(line, begin + SOUGHT * k)
        ahead = min(TURNING / max(bent, 1e-9), ahead + 2.0 * SLOWING * SOUGHT)
        square[k] = ahead
    out = np.empty(distance.size)
    out[0] = distance[0]
    for i in range(1, distance.size):
        place = min(out[i - 1] / SOUGHT, n - 1.001)
        k = int(place)
        allowed = square[k] + (place - k) * (square[k + 1] - square[k])
        way = distance[i] - distance[i - 1]
        out[i] = out[i - 1] + min(way, np.sqrt(allowed) * (times[i] - times[i - 1]))
    return out


@compiled
def curvature_on(line: FloatArray, at: float) -> float:
    """Take the curvature of a polyline between points `BEND` to both sides [1/m]."""
    x0, y0 = point_on(line, at - BEND)
    x1, y1 = point_on(line, at)
    x2, y2 = point_on(line, at + BEND)
    turned = (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1)
    sides = np.hypot(x1 - x0, y1 - y0) * np.hypot(x2 - x1, y2 - y1)
    return float(2.0 * abs(turned) / max(sides * np.hypot(x2 - x0, y2 - y0), 1e-9))


@compiled
def nearest_on(line: FloatArray, place: tuple[float, float]) -> tuple[float, float]:
    """Find the arc length of a polyline's nearest point, and the offset to the left.

    Args:
        line: Arc length, x, y of the corners, (3, m) [m].
        place: x, y [m].
    """
    best, at, offset = np.inf, 0.0, 0.0
    for k in range(line.shape[1] - 1):
        dx, dy = line[1, k + 1] - line[1, k], line[2, k + 1] - line[2, k]
        length = np.hypot(dx, dy)
        if length <= 0.0:
            continue
        px, py = place[0] - line[1, k], place[1] - line[2, k]
        share = min(max((px * dx + py * dy) / (length * length), 0.0), 1.0)
        away = np.hypot(px - share * dx, py - share * dy)
        if away < best:
            best, at = away, line[0, k] + share * length
            offset = away if dx * py - dy * px >= 0.0 else -away
    return at, offset


@compiled
def point_on(line: FloatArray, at: float) -> tuple[float, float]:
    """Find the point of a polyline at an arc length; straight on beyond its ends.

    Args:
        line: Arc length, x, y of the corners, (3, m) [m].
        at: Arc length [m].
    """
    k = min(max(np.searchsorted(line[0], at) - 1, 0), line.shape[1] - 2)
    share = (at - line[0, k]) / (line[0, k + 1] - line[0, k])
    x = line[1, k] + share * (line[1, k + 1] - line[1, k])
    y = line[2, k] + share * (line[2, k + 1] - line[2, k])
    return x, y
