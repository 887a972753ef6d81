"""What it costs where a plan comes to: its heading, and a dead end."""

from typing import NamedTuple

from planner.cruise.candidate_motion import (
    KAPPA,
    S_DOT,
    SLOPE,
    UNIT_L,
    UNIT_SLOPE,
    L,
    Lateral,
    S,
    Tracks,
    lateral_length,
)
from planner.cruise.costs import DEAD_END, HEADING
from planner.cruise.feasibility import OffsetMotion, lateral_at, lateral_motion
from planner.cruise.workspace import CycleTables
from planner.numerics.compiled import inlined
from planner.reference_path.frenet import cartesian_rates
from planner.reference_path.road_turn import circle_to
from planner.states import FloatArray


class Onward(NamedTuple):
    """How the offset of a profile goes on after its end, until it is reached."""

    back: OffsetMotion  # to the same offset
    unit: OffsetMotion  # of a change of 1 m


@inlined
def onward_of(p: int, rows: FloatArray, tracks: Tracks, lateral: Lateral) -> Onward:
    """Return how the offsets of profile `p` go on; its rows stand under the number 0.

    A motion over time is taken to stay where it ends.
    """
    here, lead = lateral.start[0], lateral.lead
    length = lateral_length(rows, 0, tracks.duration[p], lateral)
    back = lateral_motion(lateral.start, here, length, lead)
    unit = lateral_motion((0.0, 0.0, 0.0), 1.0, length, lead)
    if lateral.over_time:
        still = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        back = OffsetMotion(still, -1.0, here, 0.0, 0.0, 0.0)
        unit = OffsetMotion(still, -1.0, 1.0, 0.0, 0.0, 0.0)
    return Onward(back, unit)


@inlined
def price_end(
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    onward: Onward,
    cycle: CycleTables,
    own: FloatArray,
) -> None:
    """Fill heading and dead end: where the plans of one profile come to.

    A dead end is the share of the room that is missing where a plan ends in front of
    what stands. The room is a stopping distance and `turn_gap`: with less, the ego
    could later neither stop nor steer round, and it has no reverse gear. Linear, so
    that creeping nearer never pays.
    """
    last = count - 1
    s, speed = rows[0, S, last], rows[0, S_DOT, last]
    l, unit = basis[L, last], basis[UNIT_L, last]
    for o in range(delta_l.size):
        slope = basis[SLOPE, last] + delta_l[o] * basis[UNIT_SLOPE, last]
        _, sin_e, _, _, _ = cartesian_rates(
            l + delta_l[o] * unit, rows[0, KAPPA, last], 0.0, 0.0, 0.0, slope, 0.0
        )
        own[HEADING, o] = sin_e * sin_e
        own[DEAD_END, o] = 0.0
    around = cycle.around
    for b in range(around.size.size):
        beyond = around.s[b, last] - s
        if around.turn_gap[b] == 0.0 or not beyond > 0.0:
            continue
        gap = beyond - around.extents[b, 0] - around.extents[b, 2] - around.front_reach
        needed = around.turn_gap[b] + 0.5 * speed * speed / around.deceleration
        lack = 1.0 - max(gap, 0.0) / needed
        if lack <= 0.0:
            continue
        begin = rows[0, S, 0], s - rows[0, S, 0]
        _price_body(b, last, begin, delta_l, onward, cycle, own[DEAD_END], lack)


@inlined
def _price_body(
    b: int,
    last: int,
    begin: tuple[float, float],
    delta_l: FloatArray,
    onward: Onward,
    cycle: CycleTables,
    dead_end: FloatArray,
    lack: float,
) -> None:
    """Raise the dead end of those that come to body `b`, as they go on, to the lack.

    A long body goes to the side over more metres than a slow plan covers: what counts
    is whether its front, its axle and its rear pass beside the body, driven on.

    Args:
        b: Which body.
        last: Step at which the plans end.
        begin: Where the profile begins, and what it drives [m].
        delta_l: Changes of offset, (n_offsets,) [m].
        onward: How the motions go on.
        cycle: Tables of the cycle.
        dead_end: Raised, (n_offsets,).
        lack: Share of the room that is missing.
    """
    around = cycle.around
    start, driven = begin
    reach = around.corridor + around.extents[b, 1] + around.extents[b, 2]
    near = around.s[b, last] - around.extents[b, 0] - around.extents[b, 2]
    for q in (around.front_reach, 0.0, -around.rear_overhang):
        done = max(near - q - start, driven)
        circle, _ = circle_to(start + done, q, cycle.road.turn)
        beside = around.l[b, last] + 0.5 * circle * q * q
        _price_dead_end((q, done), beside, reach, delta_l, onward, dead_end, lack)


@inlined
def _price_dead_end(
    point: tuple[float, float],
    beside: float,
    reach: float,
    delta_l: FloatArray,
    onward: Onward,
    dead_end: FloatArray,
    lack: float,
) -> None:
    """Raise the dead end of those a point of which comes to a body to the lack.

    Args:
        point: Of the ego, ahead of its axle, and what the axle has driven when it is
            at the body [m].
        beside: Offset of the body, and how far the road leads aside to the point [m].
        reach: Offset from which on the point passes [m].
        delta_l: Changes of offset, (n_offsets,) [m].
        onward: How the motions go on.
        dead_end: Raised, (n_offsets,).
        lack: Share of the room that is missing.
    """
    q, done = point
    in_time = False  # motions over time have ended here, see `onward_of`
    l, slope, _, _ = lateral_at(in_time, onward.back, done, 0.0, 0.0, 0.0)
    unit, unit_slope, _, _ = lateral_at(in_time, onward.unit, done, 0.0, 0.0, 0.0)
    apart = beside - l - q * slope
    moved = unit + q * unit_slope
    for o in range(delta_l.size):
        if abs(apart - delta_l[o] * moved) <= reach:
            dead_end[o] = max(dead_end[o], lack)
