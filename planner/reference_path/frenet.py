"""Full state between the plane and the Frenet frame of a reference path, both ways.

Implements [Thesis] eq. 3.44 and 3.45 with the corrections listed in
`planner/README.md`. Each formula stands once, in a compiled function of scalars that
the batched and the single transforms share.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import OutsidePathDomainError
from planner.numerics.angles import wrapped
from planner.numerics.compiled import compiled, inlined
from planner.reference_path.linear_curvature import IndexArray, point_at
from planner.reference_path.path import (
    PROJECTION_REACH,
    PathTable,
    ReferencePath,
    as_input,
)
from planner.reference_path.projection import EVERYWHERE, NO_DIRECTION, foot
from planner.states import (
    CartesianState,
    CartesianStates,
    FloatArray,
    FrenetState,
    FrenetStates,
    Trajectory,
)

FRENET_REACH = 40.0  # farther from the path another vehicle has no place on it [m]
MIN_STRETCH = 0.2  # 1 - kappa_r l, below which a vehicle is too near the frame's pole

# 1 - kappa_r l and cos(heading error) below this count as outside the domain.
DOMAIN_MARGIN = 1e-9


@inlined
def frenet_rates(
    l: float,
    road_curvature: float,
    road_curvature_rate: float,
    cos_error: float,
    sin_error: float,
    curvature: float,
    speed: float,
    acceleration: float,
) -> tuple[float, float, float, float, float, float]:
    """Transform the derivatives of a state; [Thesis] eq. 3.44 as corrected.

    Args:
        l: Lateral offset [m].
        road_curvature: Of the path at the foot point [1/m].
        road_curvature_rate: Of the path at the foot point [1/m²].
        cos_error: Cosine of the heading error, positive.
        sin_error: Sine of the heading error.
        curvature: Of the driven path [1/m].
        speed: Along the heading [m/s].
        acceleration: Tangential [m/s²].

    Returns:
        (s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second).
    """
    stretch = 1.0 - road_curvature * l
    tan_error = sin_error / cos_error
    s_dot = speed * cos_error / stretch
    l_prime = stretch * tan_error
    # d(heading error)/ds, eq. 3.38, and -d(stretch)/ds, eq. 3.37
    error_rate = curvature * stretch / cos_error - road_curvature
    shrinking = road_curvature_rate * l + road_curvature * l_prime
    s_ddot = (
        acceleration * cos_error - s_dot * s_dot * (l_prime * error_rate - shrinking)
    ) / stretch
    l_dot = speed * sin_error
    turning = curvature - road_curvature * cos_error / stretch
    l_ddot = acceleration * sin_error + speed * speed * cos_error * turning
    l_second = -shrinking * tan_error + stretch / (cos_error * cos_error) * error_rate
    return s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second


@inlined
def cartesian_rates(
    l: float,
    road_curvature: float,
    road_curvature_rate: float,
    s_dot: float,
    s_ddot: float,
    l_prime: float,
    l_second: float,
) -> tuple[float, float, float, float, float]:
    """Transform the derivatives of a state back; [Thesis] eq. 3.45 as corrected.

    Returns:
        (cos_error, sin_error, curvature, speed, acceleration), the first two of the
        heading error.
    """
    # The driven path has the velocity (stretch, l') per metre of road in the frame of
    # the road; 3.45 follows from it and its derivative with a single division.
    stretch = 1.0 - road_curvature * l
    shrinking = road_curvature_rate * l + road_curvature * l_prime
    square = stretch * stretch + l_prime * l_prime
    inverse = 1.0 / np.sqrt(square)
    cos_error, sin_error = stretch * inverse, l_prime * inverse
    turn = stretch * l_second + l_prime * shrinking + road_curvature * square
    curvature = turn * inverse * inverse * inverse
    speed = s_dot * square * inverse
    gain = l_prime * l_second - stretch * shrinking
    acceleration = s_ddot * square * inverse + s_dot * s_dot * gain * inverse
    return cos_error, sin_error, curvature, speed, acceleration


@inlined
def frenet_point(
    knots: FloatArray,
    bins: IndexArray,
    s: float,
    l: float,
    heading: float,
    curvature: float,
    speed: float,
    acceleration: float,
) -> tuple[float, float, float, float, float, float, bool]:
    """Transform the state whose foot point is known; the last value is the domain.

    Returns:
        The six values of `frenet_rates` and whether they are defined.
    """
    _, _, cos, sin, road_curvature, rate, _ = point_at(knots, bins, s)
    cos_heading, sin_heading = np.cos(heading), np.sin(heading)
    cos_error = cos_heading * cos + sin_heading * sin
    sin_error = sin_heading * cos - cos_heading * sin
    inside = cos_error > DOMAIN_MARGIN and 1.0 - road_curvature * l > DOMAIN_MARGIN
    s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second = frenet_rates(
        l, road_curvature, rate, cos_error, sin_error, curvature, speed, acceleration
    )
    return s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second, inside


@inlined
def cartesian_point(
    knots: FloatArray,
    bins: IndexArray,
    s: float,
    s_dot: float,
    s_ddot: float,
    l: float,
    l_prime: float,
    l_second: float,
) -> tuple[float, float, float, float, float, float, bool]:
    """Transform one state back.

    Returns:
        (x, y, heading, curvature, speed, acceleration, inside); unless inside, the
        values mean nothing.
    """
    x, y, cos, sin, road_curvature, rate, _ = point_at(knots, bins, s)
    cos_error, sin_error, curvature, speed, acceleration = cartesian_rates(
        l, road_curvature, rate, s_dot, s_ddot, l_prime, l_second
    )
    heading = np.arctan2(
        sin * cos_error + cos * sin_error, cos * cos_error - sin * sin_error
    )
    inside = 1.0 - road_curvature * l > DOMAIN_MARGIN
    return x - l * sin, y + l * cos, heading, curvature, speed, acceleration, inside


@compiled
def _frenet_points(
    knots: FloatArray,
    bins: IndexArray,
    s: FloatArray,
    l: FloatArray,
    heading: FloatArray,
    curvature: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
) -> tuple[FloatArray, int]:
    """Transform many states; (6, n) and the first one outside, or n."""
    out = np.empty((6, s.size))
    outside = s.size
    for i in range(s.size):
        values = frenet_point(
            knots, bins, s[i], l[i], heading[i], curvature[i], speed[i], acceleration[i]
        )
        out[0, i], out[1, i], out[2, i] = values[0], values[1], values[2]
        out[3, i], out[4, i], out[5, i] = values[3], values[4], values[5]
        if not values[6]:
            outside = min(outside, i)
    return out, outside


@compiled
def _cartesian_points(
    knots: FloatArray,
    bins: IndexArray,
    s: FloatArray,
    s_dot: FloatArray,
    s_ddot: FloatArray,
    l: FloatArray,
    l_prime: FloatArray,
    l_second: FloatArray,
) -> tuple[FloatArray, int]:
    """Transform many states back; (6, n) and the first one outside, or n."""
    out = np.empty((6, s.size))
    outside = s.size
    for i in range(s.size):
        values = cartesian_point(
            knots, bins, s[i], s_dot[i], s_ddot[i], l[i], l_prime[i], l_second[i]
        )
        out[0, i], out[1, i], out[2, i] = values[0], values[1], values[2]
        out[3, i], out[4, i], out[5, i] = values[3], values[4], values[5]
        if not values[6]:
            outside = min(outside, i)
    return out, outside


def cartesian_to_frenet(
    path: ReferencePath,
    states: CartesianStates,
    near: ArrayLike | None = None,
    reach: float = 30.0,
) -> FrenetStates:
    """Transform states of the plane; [Thesis] eq. 3.44 as corrected.

    Args:
        path: The reference path.
        states: Arrays of any one shape.
        near: Guesses of s as in `ReferencePath.project` [m].
        reach: As in `ReferencePath.project` [m].

    Returns:
        Arrays in the shape of `states`.

    Raises:
        OutsidePathDomainError: Where 1 - kappa_r l <= 0, or where the heading is a
            right angle or more off the path.
    """
    s, l = path.project(states.x, states.y, near, reach)
    flat_s, flat_l, heading = as_input(s), as_input(l), as_input(states.heading)
    out, outside = _frenet_points(
        path.table.knots,
        path.table.bins,
        flat_s,
        flat_l,
        heading,
        as_input(states.curvature),
        as_input(states.speed),
        as_input(states.acceleration),
    )
    if outside < flat_s.size:
        raise _outside(path, flat_s[outside], flat_l[outside], heading[outside])
    rows = out.reshape(6, *s.shape)
    s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second = rows
    return FrenetStates(s, s_dot, s_ddot, l, l_dot, l_ddot, l_prime, l_second)


def frenet_to_cartesian(path: ReferencePath, states: FrenetStates) -> CartesianStates:
    """Transform Frenet states to the plane; [Thesis] eq. 3.45 as corrected.

    Reads s, s_dot, s_ddot, l, l_prime and l_second.

    Args:
        path: The reference path.
        states: Arrays of any one shape.

    Returns:
        Arrays in the shape of `states`; the heading is in [-pi, pi].

    Raises:
        OutsidePathDomainError: Where 1 - kappa_r l <= 0.
    """
    s, l = as_input(states.s), as_input(states.l)
    out, outside = _cartesian_points(
        path.table.knots,
        path.table.bins,
        s,
        as_input(states.s_dot),
        as_input(states.s_ddot),
        l,
        as_input(states.l_prime),
        as_input(states.l_second),
    )
    if outside < s.size:
        raise _outside(path, s[outside], l[outside])
    return CartesianStates(*out.reshape(6, *states.s.shape))


def cartesian_to_frenet_one(
    path: ReferencePath, state: CartesianState, near: float | None = None
) -> FrenetState:
    """Transform one state of the plane, as `cartesian_to_frenet` does."""
    *values, inside = _frenet_one(
        path.table,
        float(state.x),
        float(state.y),
        float(state.heading),
        float(state.curvature),
        float(state.speed),
        float(state.acceleration),
        EVERYWHERE
        if near is None
        else (float(near - PROJECTION_REACH), float(near + PROJECTION_REACH)),
    )
    if not inside:
        raise _outside(path, values[0], values[3], state.heading)
    return FrenetState(*values)


@compiled
def _frenet_one(
    path: PathTable,
    x: float,
    y: float,
    heading: float,
    curvature: float,
    speed: float,
    acceleration: float,
    limits: tuple[float, float],
) -> tuple[float, float, float, float, float, float, float, float, bool]:
    """Project one state; the values of a `FrenetState`, and the domain."""
    s, l = foot(path.knots, path.bins, path.blocks, x, y, limits, NO_DIRECTION)
    s_dot, s_ddot, l_dot, l_ddot, l_prime, l_second, inside = frenet_point(
        path.knots, path.bins, s, l, heading, curvature, speed, acceleration
    )
    return s, s_dot, s_ddot, l, l_dot, l_ddot, l_prime, l_second, inside


def frenet_trajectory(
    path: ReferencePath, t: FloatArray, states: FrenetStates
) -> Trajectory | None:
    """Return Frenet states as a trajectory; None where they leave the frame's domain.

    Args:
        path: Of the states.
        t: Times of the states, (n,) [s].
        states: (n,) each, see `frenet_to_cartesian`.
    """
    try:
        plane = frenet_to_cartesian(path, states)
    except OutsidePathDomainError:
        return None
    return Trajectory(
        t,
        plane.x,
        plane.y,
        plane.heading,
        plane.curvature,
        plane.speed,
        plane.acceleration,
        states.s,
        states.l,
    )


def frenet_to_cartesian_one(path: ReferencePath, state: FrenetState) -> CartesianState:
    """Transform one Frenet state to the plane, as `frenet_to_cartesian` does."""
    *values, inside = cartesian_point(
        path.table.knots,
        path.table.bins,
        float(state.s),
        float(state.s_dot),
        float(state.s_ddot),
        float(state.l),
        float(state.l_prime),
        float(state.l_second),
    )
    if not inside:
        raise _outside(path, state.s, state.l)
    return CartesianState(*values)


def state_on_path(
    path: ReferencePath, s: float, l: float, speed: float
) -> CartesianState:
    """Return the state of a rear axle that follows the path at a constant offset.

    Args:
        path: The reference path.
        s: Arc length [m].
        l: Offset, positive to the left [m].
        speed: Along the heading [m/s].

    Returns:
        The state; its heading is wrapped, its acceleration 0.
    """
    x, y, heading = path.pose(s)
    curvature = float(path.at(s).curvature)
    return CartesianState(
        x - l * math.sin(heading),
        y + l * math.cos(heading),
        wrapped(heading),
        curvature / (1.0 - curvature * l),
        speed,
        0.0,
    )


def _outside(
    path: ReferencePath, s: float, l: float, heading: float | None = None
) -> OutsidePathDomainError:
    """Make the error of a state without Frenet coordinates."""
    road = path.at(s)
    message = (
        f"outside the Frenet domain at s = {s:.3f} m, l = {l:.3f} m: "
        f"1 - kappa_r l = {1.0 - road.curvature * l:.3g}"
    )
    if heading is not None:
        error = np.remainder(heading - road.heading + np.pi, 2.0 * np.pi) - np.pi
        message += f", heading error = {error:.3f} rad"
    return OutsidePathDomainError(message)
