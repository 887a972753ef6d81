"""Where other vehicles will be: simple predictors behind one signature.

`Predictor` is the signature; better ones take the place of these without a change
elsewhere.
"""

from typing import Protocol

import numpy as np

from planner.compiled import compiled
from planner.geometry.pieces import point_at
from planner.geometry.reference_path import ReferencePath
from planner.scene import Prediction
from planner.states import FloatArray, IntArray

# A vehicle follows the ego's road while its heading and place agree with the road.
LANE_HEADING_TOLERANCE = 0.5  # [rad]; lane changes stay below 0.2, turns exceed it
LANE_REACH = 20.0  # [m]; two carriageways of three lanes
MIN_STRETCH = 0.2  # 1 - kappa_r l, below which the frame is too close to its pole
LATERAL_HOLD = 1.5  # for which a lateral speed is held [s]
FRENET_REACH = 40.0  # [m]; farther from the path a vehicle has no Frenet place


class Predictor(Protocol):
    """Anything that says where vehicles will be."""

    def __call__(
        self,
        path: ReferencePath,
        x: FloatArray,
        y: FloatArray,
        heading: FloatArray,
        speed: FloatArray,
        acceleration: FloatArray,
        lateral_speed: FloatArray,
        step: float,
        n_steps: int,
    ) -> Prediction:
        """Predict n vehicles at the times 0, step, ... (n_steps - 1) * step."""
        ...


def constant_speed(
    path: ReferencePath,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,  # noqa: ARG001 - part of the predictor signature
    lateral_speed: FloatArray,
    step: float,
    n_steps: int,
) -> Prediction:
    """Keep the speed, along the lane where there is one, else along the heading.

    Args:
        path: Reference path of the ego.
        x: Centres of the rectangles, (n,) [m].
        y: As x.
        heading: (n,) [rad].
        speed: (n,) [m/s].
        acceleration: (n,) [m/s²]; not used.
        lateral_speed: Across the lane, positive to the vehicle's left, (n,) [m/s]. It
            is held for `LATERAL_HOLD`: a lane change goes on, but nobody knows how far.
        step: Time between columns [s].
        n_steps: Number of columns, the first is now.

    Returns:
        The prediction, (n, n_steps).
    """
    t = step * np.arange(n_steps)
    distance = speed[:, None] * t
    return _roll_out(path, (x, y, heading, lateral_speed), distance, step)


def held_braking(
    path: ReferencePath,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    lateral_speed: FloatArray,
    step: float,
    n_steps: int,
) -> Prediction:
    """Like `constant_speed`, but a vehicle that brakes goes on braking until it stands.

    Someone who brakes for a signal, a queue or an obstacle does so for longer than an
    instant; someone who speeds up may stop doing so at any time.
    """
    t = step * np.arange(n_steps)
    braking = np.minimum(acceleration, -1e-3)[:, None]
    until = np.minimum(t, -speed[:, None] / braking)  # the time still spent moving
    distance = speed[:, None] * until + 0.5 * braking * until**2
    return _roll_out(path, (x, y, heading, lateral_speed), distance, step)


def _roll_out(
    path: ReferencePath,
    now: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    distance: FloatArray,
    step: float,
) -> Prediction:
    """Move each vehicle `distance` (n, n_steps) along its lane or heading."""
    x, y, heading, lateral_speed = now
    s0, l0 = path.project(x, y)
    foot = path.at(s0)
    along = np.cos(heading - foot.heading)  # +1 with the road, -1 against it
    follows = (
        (np.abs(along) > np.cos(LANE_HEADING_TOLERANCE))
        & (np.abs(l0) < LANE_REACH)
        & (1.0 - foot.curvature * l0 > MIN_STRETCH)
    )
    heading_xy = np.cos(heading), np.sin(heading)
    out_x = x[:, None] + distance * heading_xy[0][:, None]
    out_y = y[:, None] + distance * heading_xy[1][:, None]
    out_heading = np.repeat(heading[:, None], distance.shape[1], axis=1)
    out_s = np.full_like(out_x, np.inf)
    out_l = np.zeros_like(out_x)

    lane = np.flatnonzero(follows)
    if lane.size:
        direction = np.sign(along[lane])[:, None]
        drifting = np.minimum(step * np.arange(distance.shape[1]), LATERAL_HOLD)
        l = l0[lane, None] + direction * lateral_speed[lane, None] * drifting
        s, out_x[lane], out_y[lane], along_road = follow_road(
            path.table.knots,
            path.table.bins,
            s0[lane],
            l,
            direction * distance[lane],
        )
        # The course against the lane stays: a car in mid lane change stands askew.
        out_heading[lane] = along_road + (heading - foot.heading)[lane, None]
        out_s[lane], out_l[lane] = s, l

    free = np.flatnonzero(~follows & (np.abs(l0) < 3.0 * FRENET_REACH))
    if free.size:
        s, l = path.project(out_x[free].ravel(), out_y[free].ravel())
        near = np.abs(l) < FRENET_REACH
        out_s[free] = np.where(near, s, np.inf).reshape(free.size, -1)
        out_l[free] = np.where(near, l, 0.0).reshape(free.size, -1)
    return Prediction(step, out_x, out_y, out_heading, out_s, out_l)


@compiled
def follow_road(
    knots: FloatArray,
    bins: IntArray,
    s0: FloatArray,
    l: FloatArray,
    distance: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Drive along a path at given offsets.

    ds = d(distance) / (1 - kappa_r l), by the midpoint rule.

    Args:
        knots: Of the path, as in `ReferencePath.table`.
        bins: As `knots`.
        s0: Where each vehicle begins, (n,) [m].
        l: Offsets, (n, n_steps) [m].
        distance: Driven along the offset path, negative against it, (n, n_steps) [m].

    Returns:
        (s, x, y, heading of the path), (n, n_steps) each.
    """
    s_out = np.empty_like(l)
    x_out = np.empty_like(l)
    y_out = np.empty_like(l)
    heading_out = np.empty_like(l)
    for v in range(l.shape[0]):
        s = s0[v]
        for i in range(l.shape[1]):
            if i > 0:
                driven = distance[v, i] - distance[v, i - 1]
                curvature = point_at(knots, bins, s)[4]
                middle = s + 0.5 * driven / max(1.0 - curvature * l[v, i], MIN_STRETCH)
                curvature = point_at(knots, bins, middle)[4]
                s += driven / max(1.0 - curvature * l[v, i], MIN_STRETCH)
            x, y, cos, sin, _, _, heading = point_at(knots, bins, s)
            s_out[v, i] = s
            x_out[v, i] = x - l[v, i] * sin
            y_out[v, i] = y + l[v, i] * cos
            heading_out[v, i] = heading
    return s_out, x_out, y_out, heading_out
