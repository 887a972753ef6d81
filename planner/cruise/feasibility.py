"""Motion of one candidate and the limits that it must keep; [Thesis] 4.5."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import inlined
from planner.numerics.polynomials import quintic_coefficients

Quintic = tuple[float, float, float, float, float, float]  # lowest order first

MIN_STRETCH = 0.05  # 1 - kappa_r l; below it the Frenet frame is not usable
MIN_SPEED = 0.1  # below it l(t) gives no direction [m/s]
TOLERANCE = 1e-6
STRAIGHT = 1e-6  # a smaller curvature bends nothing within a body's length [1/m]


class Check(IntEnum):
    """The check that removed a candidate, in the order of the checks."""

    PASSED = 0
    REVERSING = 1  # the profile would drive backwards
    SPEED = 2
    STOP_LINE = 3
    JERK = 4  # of the profile, along the path
    DOMAIN = 5  # the offset reaches the centre of curvature
    ROAD = 6
    CURVATURE = 7
    ACCELERATION = 8
    LATERAL_ACCELERATION = 9
    LATERAL_JERK = 10
    COLLISION = 11


class CandidateLimits(NamedTuple):
    """Limits of every candidate; widened to where the ego already is beyond them."""

    acceleration: float  # [m/s²]
    deceleration: float  # positive [m/s²]
    lateral_acceleration: float  # [m/s²]
    curvature: float  # [1/m]
    front: float  # rear axle to the body's front that must stay on the road [m]
    rear: float  # the same to its rear [m]
    half_width: float  # body and road margin [m]
    excess: float  # how far the body may be over the road's edge [m]
    jerk: float  # of a profile [m/s³]
    sideways_change: float  # of the lateral acceleration from step to step [m/s²]


class RoadBend(NamedTuple):
    """Circles that lead as far aside as the road does, from under the rear axle.

    See `planner.reference_path.road_turn.circle_to`.
    """

    front: float  # up to the body's front [1/m]
    axle: float  # the road's curvature there [1/m]
    rear: float  # up to the body's rear [1/m]


class RoadBody(NamedTuple):
    """The body that has to stay on the road, from the rear axle."""

    front: float  # to its front [m]
    rear: float  # to its rear [m]
    half_width: float  # [m]


@inlined
def lateral_over_time(
    c: Quintic,
    t: float,
    s_dot: float,
    s_ddot: float,
) -> tuple[float, float, float, float]:
    """Return (l, l', l'', d³l/dt³) of a quintic l(t) at `t` within its duration."""
    l = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
    rate = c[1] + t * (
        2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5]))
    )
    second = 2.0 * c[2] + t * (6.0 * c[3] + t * (12.0 * c[4] + t * 20.0 * c[5]))
    third = 6.0 * c[3] + t * (24.0 * c[4] + t * 60.0 * c[5])
    speed = max(s_dot, MIN_SPEED)
    slope = rate / speed
    return l, slope, (second - slope * s_ddot) / (speed * speed), third


@inlined
def lateral_over_distance(
    c: Quintic,
    driven: float,
    s_dot: float,
    s_ddot: float,
    s_dddot: float,
) -> tuple[float, float, float, float]:
    """Return (l, l', l'', d³l/dt³) of a quintic l(s), `driven` m after its start."""
    d = driven
    l = c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5]))))
    slope = c[1] + d * (
        2.0 * c[2] + d * (3.0 * c[3] + d * (4.0 * c[4] + d * 5.0 * c[5]))
    )
    bend = 2.0 * c[2] + d * (6.0 * c[3] + d * (12.0 * c[4] + d * 20.0 * c[5]))
    third = 6.0 * c[3] + d * (24.0 * c[4] + d * 60.0 * c[5])
    jerk = (third * s_dot * s_dot + 3.0 * bend * s_ddot) * s_dot + slope * s_dddot
    return l, slope, bend, jerk


class OffsetMotion(NamedTuple):
    """A motion to an offset, as a function of what is driven or of time.

    Within its length it is a polynomial, a quintic, and beyond it the offset. Where a
    point ahead of the axle is led along a quartic, the axle follows it as a trailer
    does: along a quartic and a part that fades exponentially, which is all that is left
    beyond the length.
    """

    polynomial: Quintic
    length: float  # after which the led point is at the offset [s] or [m]
    offset: float  # [m]
    lead: float  # of the led point ahead of the rear axle; 0: the axle itself [m]
    fading: float  # part of the axle's offset that fades from the start on [m]
    trailing: float  # how far the axle is from the offset after the length [m]


@inlined
def lateral_at(
    over_time: bool,  # noqa: FBT001 - a constant of the cycle, hoisted by the compiler
    motion: OffsetMotion,
    done: float,
    s_dot: float,
    s_ddot: float,
    s_dddot: float,
) -> tuple[float, float, float, float]:
    """Return (l, l', l'', d³l/dt³) after `done` s or m."""
    if over_time:
        if done > motion.length + 1e-9:
            return motion.offset, 0.0, 0.0, 0.0
        return lateral_over_time(motion.polynomial, done, s_dot, s_ddot)
    if motion.lead == 0.0:
        if done > motion.length + 1e-9:
            return motion.offset, 0.0, 0.0, 0.0
        return lateral_over_distance(motion.polynomial, done, s_dot, s_ddot, s_dddot)
    l, slope, bend, jerk, fades, since = motion.offset, 0.0, 0.0, 0.0, 0.0, 0.0
    if done > motion.length:
        fades, since = motion.trailing, done - motion.length
    else:
        l, slope, bend, jerk = lateral_over_distance(
            motion.polynomial, done, s_dot, s_ddot, s_dddot
        )
        fades, since = motion.fading, done
    rate = -1.0 / motion.lead
    less = fades * np.exp(rate * since)
    falls = less * rate
    bends = falls * rate
    changes = (bends * rate * s_dot * s_dot + 3.0 * bends * s_ddot) * s_dot
    return l + less, slope + falls, bend + bends, jerk + changes + falls * s_dddot


@inlined
def lateral_motion(
    start: tuple[float, float, float], offset: float, length: float, lead: float
) -> OffsetMotion:
    """Solve for the motion from `start` to (offset, 0, 0); [Thesis] eq. 4.1-4.5.

    A led point, `lead` ahead of the axle, moves to the offset along a quartic
    q = l + lead l', so that a plan made anew on the way is the same one. The axle's l
    solves this equation: a quartic again, and a part that fades.

    Args:
        start: l and its first two derivatives.
        offset: To get to [m].
        length: After which the offset is reached [s] or [m].
        lead: Of the led point ahead of the axle, over distance only; 0 without one [m].
    """
    if lead == 0.0:
        quintic = lateral_quintic(start, offset, length)
        return OffsetMotion(quintic, length, offset, 0.0, 0.0, 0.0)
    here, slope = start[0] + lead * start[1], start[1] + lead * start[2]
    away, rise = here - offset, length * slope
    # of the quartic through these, flat where it ends
    second = (6.0 * (4.0 * away + rise) - 12.0 * (rise + 3.0 * away)) / length**2
    q = quintic_coefficients(here, slope, second, offset, 0.0, 0.0, length)
    c5 = q[5]
    c4 = q[4] - 5.0 * lead * c5
    c3 = q[3] - 4.0 * lead * c4
    c2 = q[2] - 3.0 * lead * c3
    c1 = q[1] - 2.0 * lead * c2
    c0 = q[0] - lead * c1
    fading = start[0] - c0
    end = c0 + length * (
        c1 + length * (c2 + length * (c3 + length * (c4 + length * c5)))
    )
    trailing = end + fading * np.exp(-length / lead) - offset
    axle = (c0, c1, c2, c3, c4, c5)
    return OffsetMotion(axle, length, offset, lead, fading, trailing)


@inlined
def lateral_quintic(
    start: tuple[float, float, float], offset: float, length: float
) -> Quintic:
    """Solve for the quintic from `start` to (offset, 0, 0); [Thesis] eq. 4.1-4.5."""
    return quintic_coefficients(start[0], start[1], start[2], offset, 0.0, 0.0, length)


@inlined
def squared_jerk(c: Quintic, T: float) -> float:
    """Integrate the squared third derivative over 0 ... T; [Thesis] eq. 4.15."""
    a, b, d = 6.0 * c[3], 24.0 * c[4], 60.0 * c[5]
    return T * (
        a * a
        + T * (a * b + T * ((b * b + 2.0 * a * d) / 3.0 + T * (b * d / 2.0)))
        + T * T * T * T * d * d / 5.0
    )


@inlined
def road_excess(
    l: float,
    cos_error: float,
    sin_error: float,
    bend: RoadBend,
    left: float,
    right: float,
    body: RoadBody,
) -> float:
    """Compute how far the body reaches over the road's edge [m]; negative inside.

    Corners and the sides' innermost points are put into the Frenet frame by the circle
    that leads as far aside as the road does up to there: exact on lines and arcs, to
    second order where the curvature is linear.
    """
    half_width = body.half_width
    excess = -np.inf
    for reach, curvature in ((body.front, bend.front), (-body.rear, bend.rear)):
        rate = 0.0  # of the circles' curvature, linear in the way to the point
        if reach != 0.0:
            rate = (curvature - bend.axle) / reach
        first, second = _innermost(l, sin_error, bend.axle, rate)
        for place in (reach, first, second):
            if place != reach and not min(0.0, reach) <= place <= max(0.0, reach):
                continue
            circle = bend.axle + rate * place
            bent = bend.axle + 3.0 * rate * place  # of the road there
            for side in (half_width, -half_width):
                if place != reach and side * bent < 0.0:  # the outer side
                    continue
                along = place * cos_error - side * sin_error
                offset = l + place * sin_error + side * cos_error
                if abs(circle) >= STRAIGHT:
                    # Distance from the centre of the road's circle, less its radius.
                    away = 1.0 - circle * offset
                    turn = circle * along
                    offset = (1.0 - np.sqrt(away * away + turn * turn)) / circle
                excess = max(excess, offset - left, right - offset)
    return excess


@inlined
def _innermost(
    l: float, sin_error: float, axle: float, rate: float
) -> tuple[float, float]:
    """Find where a body is nearest to the inner edge of a bend, ahead of its axle [m].

    There the road, whose circles bend by `axle` + `rate` d, has turned as far as the
    body: the roots of d axle + 1.5 d² rate = sin e, on the road's scale beside it.

    Returns:
        Both places; nan or infinite without one.
    """
    stretch = 1.0 - axle * l
    axle, rate = axle / stretch, 1.5 * rate / stretch
    root = np.sqrt(axle * axle + 4.0 * rate * sin_error)
    total = axle + np.copysign(root, axle)
    return 2.0 * sin_error / total, -0.5 * total / rate
