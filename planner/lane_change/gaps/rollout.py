"""Drives into the gaps of a lane, rolled out along the road for half a minute.

One dimension: front and rear bumpers along the reference path. The vehicles of the lane
follow each other by IDM without the ego; the ego adjusts to a gap in its own lane, goes
into it, and follows the vehicle ahead. Where it may go in is a matter of distances
(RSS) alone; what it costs those behind is the expected braking of `reaction`. A gap in
which some metres are missing has a price, too: gaps change by as much within seconds.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.lane_change.gaps.reaction import expected_braking
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray

# of the vehicles in the lane; who is as near to another as this brakes. Wished gaps
# in time are larger, but a driver who has come nearer stays there
IDM_TIME_GAP, IDM_GAP = 0.8, 2.5  # [s, m]
COMFORTABLE_GAP = 1.2  # time gap that the ego would leave behind it [s]
IDM_ACCELERATION, IDM_BRAKING = 1.5, 2.0  # [m/s²]
# In which the ego comes to its place beside a gap, each tried: the longer, the less its
# speed differs from that of the lane when it goes in [s]
ADJUST_TIMES = (3.0, 6.0, 12.0)
AIM_INSIDE = 4.0  # behind the nearest place behind a vehicle, or it takes for ever [m]
RESPONSE_TIME = 1.2  # in which it comes to the speed for that [s]
FOLLOW_TIME = 3.0  # in which it comes to its distance behind a vehicle [s]
HARD = 3.0  # braking of the ego where it has to [m/s²]
LEAST_GAIN = 0.4  # by which a later entry has to be cheaper for others [s]


class LaneTraffic(NamedTuple):
    """Vehicles of a lane over time, from the foremost back; arrays are (n, n_times)."""

    front: FloatArray  # [m]
    rear: FloatArray
    speed: FloatArray  # [m/s]


class EgoStart(NamedTuple):
    """The ego now."""

    front: float  # front bumper along the road [m]
    length: float  # [m]
    speed: float  # [m/s]
    wish: float  # speed on a free road [m/s]


class OwnLane(NamedTuple):
    """What is ahead in the ego's own lane."""

    leader_rear: float  # of the vehicle ahead now, inf without [m]
    leader_speed: float  # [m/s]
    leader_stop: float  # where its rear bumper stands in the queue, inf without one [m]
    wait: float  # where the front bumper waits for a gap, inf without a blockage [m]
    aside: float  # before which a change must begin, less `aside_time` v [m]
    passed: float  # behind which the own lane is free again, inf if nowhere [m]


class RolloutRules(NamedTuple):
    """Numbers of a rollout; see `GapSettings`."""

    step: float
    line_time: float
    aside_time: float
    acceleration: float
    braking: float
    front_gap: float
    front_headway: float
    reaction: float
    rear_braking: float
    ego_braking: float
    braking_weight: float
    missing_weight: float
    most_missing: float
    wait_weight: float
    room_weight: float
    room_scale: float
    effort_weight: float


class GapCase(NamedTuple):
    """One gap, with all that a way into it depends on."""

    ego: EgoStart
    own: OwnLane
    lane: LaneTraffic
    gap: int  # behind vehicle `gap - 1` and ahead of vehicle `gap` of the lane
    rules: RolloutRules


class Entry(NamedTuple):
    """The best way into one gap."""

    cost: float  # lost time and what stands for it, inf without a way [s]
    at: int  # step in which the change begins, -1 without a way
    braking: float  # expected of the follower, beyond what it brakes anyway [m/s²]
    missing: float  # of the distances that safety asks for [m]


class Room(NamedTuple):
    """What a gap offers if the change begins in a step."""

    missing: float  # of the distances that safety asks for, inf if it is no gap [m]
    braking: float  # expected of the follower, beyond what it brakes anyway [m/s²]


@compiled
def lane_traffic(
    front: FloatArray,
    length: FloatArray,
    speed: FloatArray,
    wish: FloatArray,
    step: float,
    n_times: int,
) -> LaneTraffic:
    """Let the vehicles of a lane follow each other by IDM+.

    Of the free road and the vehicle ahead, the one that asks for less counts, instead
    of their sum: in the sum, who drives as fast as it wishes keeps three times the gap,
    and gaps close in the rollout that stay open on the road (Schakel, van Arem, Netten,
    Effects of cooperative adaptive cruise control on traffic flow stability, 2010).

    Args:
        front: Of the front bumpers, from the foremost back, (n,) [m].
        length: (n,) [m].
        speed: Now, (n,) [m/s].
        wish: Speeds on a free road, (n,) [m/s].
        step: Between times [s].
        n_times: Number of times.
    """
    n = front.size
    fronts, speeds = np.empty((n, n_times)), np.empty((n, n_times))
    rears = np.empty((n, n_times))
    root = 2.0 * math.sqrt(IDM_ACCELERATION * IDM_BRAKING)
    for j in range(n):
        place, v = front[j], speed[j]
        for i in range(n_times):
            fronts[j, i], speeds[j, i], rears[j, i] = place, v, place - length[j]
            rate = 0.0
            if wish[j] > 0.1:
                rate = IDM_ACCELERATION * (1.0 - (v / wish[j]) ** 4)
            if j > 0:
                gap = max(rears[j - 1, i] - place, 0.5)
                dynamic = v * IDM_TIME_GAP + v * (v - speeds[j - 1, i]) / root
                desired = IDM_GAP + max(dynamic, 0.0)
                rate = min(rate, IDM_ACCELERATION * (1.0 - (desired / gap) ** 2))
            after = max(v + step * max(rate, -IDM_BRAKING), 0.0)
            place, v = place + 0.5 * step * (v + after), after
    return LaneTraffic(fronts, rears, speeds)


@compiled
def best_entry(case: GapCase, motion: FloatArray) -> Entry:
    """Find the best way into one gap.

    Args:
        case: See there.
        motion: Filled with distance [m] and speed [m/s] of the way, (2, n_times).
    """
    ego, n = case.ego, motion.shape[1]
    way, after = np.empty((2, n)), np.empty((2, n))
    best = Entry(np.inf, -1, 0.0, 0.0)
    for adjust in ADJUST_TIMES:
        found = _entry_within(adjust, case, way, after)
        if found.cost < best.cost:
            best = found
            motion[:, : best.at + 1] = way[:, : best.at + 1]
    if best.at >= 0:
        place, v = ego.front + motion[0, best.at], motion[1, best.at]
        _follow(best.at, place, v, case, after)
        motion[:, best.at :] = after[:, best.at :]
    return best


@inlined
def _entry_within(
    adjust: float, case: GapCase, way: FloatArray, after: FloatArray
) -> Entry:
    """Find the best entry of one way beside the gap, which is written to `way`."""
    ego, own, rules = case.ego, case.own, case.rules
    best = Entry(np.inf, -1, 0.0, 0.0)
    place, v, effort, cheapest = ego.front, ego.speed, 0.0, np.inf
    for i in range(way.shape[1]):
        way[0, i], way[1, i] = place - ego.front, v
        room = _room_at(i, place, v, case)
        price = rules.braking_weight * room.braking
        price += rules.missing_weight * room.missing
        if price < cheapest - LEAST_GAIN:
            cheapest = price
            lost, more = _follow(i, place, v, case, after)
            cost = lost + price + rules.wait_weight * rules.step * i
            spare = min(own.wait, own.leader_stop) - place
            cost += rules.room_weight * max(1.0 - spare / rules.room_scale, 0.0) ** 2
            cost += rules.effort_weight * (effort + more)
            if cost < best.cost:
                best = Entry(cost, i, room.braking, room.missing)
        rate = _adjusting(i, place, v, case, adjust)
        effort += rate * rate * rules.step
        faster = max(v + rules.step * rate, 0.0)
        place, v = place + 0.5 * rules.step * (v + faster), faster
    return best


@inlined
def _room_at(i: int, place: float, v: float, case: GapCase) -> Room:
    """Return what the gap offers if the change begins in a step."""
    ego, own, lane, gap, rules = case
    n_times = lane.front.shape[1]
    cross = i + int(rules.line_time / rules.step)
    if cross >= n_times or place > own.aside - rules.aside_time * v:
        return Room(np.inf, 0.0)
    there = place + rules.line_time * v
    missing = 0.0
    if gap > 0:
        ahead = lane.rear[gap - 1, cross] - there
        closing = max(v - lane.speed[gap - 1, cross], 0.0)
        need = rules.front_gap + rules.front_headway * v
        missing += max(need + closing * closing / (2.0 * rules.braking) - ahead, 0.0)
    rear, follower = there - ego.length, lane.speed[gap, cross]
    behind = rear - lane.front[gap, cross]
    need = max(_safe_distance(follower, v, rules), rules.front_gap)
    missing += max(need - behind, 0.0)
    if missing > rules.most_missing:
        return Room(np.inf, 0.0)
    anyway = 0.0
    if gap > 0:
        room = lane.rear[gap - 1, cross] - lane.front[gap, cross]
        anyway = expected_braking(room, follower, lane.speed[gap - 1, cross])
    return Room(missing, max(expected_braking(behind, follower, v) - anyway, 0.0))


@inlined
def _safe_distance(follower: float, v: float, rules: RolloutRules) -> float:
    """Return the distance that RSS asks for ahead of a follower [m]; may be < 0."""
    need = follower * rules.reaction + follower * follower / (2.0 * rules.rear_braking)
    return need - v * v / (2.0 * rules.ego_braking)


@inlined
def _speed_beside(
    i: int, place: float, v: float, case: GapCase, adjust: float
) -> float:
    """Return the speed at which the ego comes to its place beside a gap [m/s]."""
    ego, _, lane, gap, rules = case
    low, high, pace = -np.inf, np.inf, ego.wish
    least = -np.inf
    if gap < lane.front.shape[0]:
        pace = lane.speed[gap, i]
        behind = lane.front[gap, i] + ego.length
        least = behind + max(_safe_distance(pace, v, rules), rules.front_gap)
        low = behind + rules.front_gap + pace * max(rules.reaction, COMFORTABLE_GAP)
        low += max(pace - v, 0.0) * rules.line_time
    if gap > 0:
        high = lane.rear[gap - 1, i] - rules.front_gap - rules.front_headway * v
        pace = lane.speed[gap - 1, i]
    wanted = place
    if place > high or low > high:
        middle = min(0.5 * (least + high), high)
        wanted = max(high - AIM_INSIDE, middle)
    elif place < low:
        wanted = low
    if wanted == place:  # as fast as the gap allows
        target = ego.wish
        if gap > 0:
            target = pace + (high - place) / adjust
    else:
        target = pace + (wanted - place) / adjust
    return min(max(target, 0.0), ego.wish)


@inlined
def _adjusting(i: int, place: float, v: float, case: GapCase, adjust: float) -> float:
    """Return the ego's acceleration on the way to its place beside a gap [m/s²]."""
    own, rules = case.own, case.rules
    target = _speed_beside(i, place, v, case, adjust)
    rate = (target - v) / RESPONSE_TIME
    rate = min(max(rate, -rules.braking), rules.acceleration)
    if own.wait < np.inf:
        room = own.wait - place
        if room <= 0.0:
            rate = -HARD
        elif v * v > 1.6 * rules.braking * room:
            rate = min(rate, -v * v / (2.0 * room))
    if own.leader_rear < np.inf:
        rear, speed = _leader_at(rules.step * i, own)
        rate = min(rate, _behind(v, rear - place, speed, rules))
    return max(rate, -2.0 * HARD, -v / rules.step)


@inlined
def _leader_at(t: float, own: OwnLane) -> tuple[float, float]:
    """Return where the vehicle ahead is and how fast: it stops for the blockage."""
    speed = own.leader_speed
    rear = own.leader_rear + speed * t
    brakes = own.leader_stop - speed * speed / (2.0 * IDM_BRAKING)
    if rear <= brakes or speed <= 0.0:
        return rear, speed
    since = (rear - max(brakes, own.leader_rear)) / speed
    until = speed / IDM_BRAKING
    braked = min(since, until)
    rear -= speed * since - braked * (speed - 0.5 * IDM_BRAKING * braked)
    return rear, speed - IDM_BRAKING * braked


@inlined
def _behind(v: float, gap: float, leader: float, rules: RolloutRules) -> float:
    """Return the acceleration behind a vehicle [m/s²]."""
    spare = gap - rules.front_gap - rules.front_headway * v
    target = leader + spare / FOLLOW_TIME
    return max((target - v) / RESPONSE_TIME, -HARD)


@inlined
def _follow(
    first: int,
    place: float,
    v: float,
    case: GapCase,
    out: FloatArray,
) -> tuple[float, float]:
    """Follow the vehicle ahead from an entry on: (lost time [s], effort [m²/s³]).

    Behind the blockage the ego's own lane is free again.
    """
    ego, own, lane, gap, rules = case
    n, effort = out.shape[1], 0.0
    for i in range(first, n):
        out[0, i], out[1, i] = place - ego.front, v
        rate = (ego.wish - v) / RESPONSE_TIME
        rate = min(max(rate, -rules.braking), rules.acceleration)
        if gap > 0 and place - ego.length < own.passed:
            ahead = lane.rear[gap - 1, i] - place
            rate = min(rate, _behind(v, ahead, lane.speed[gap - 1, i], rules))
        rate = max(rate, -v / rules.step)
        effort += rate * rate * rules.step
        faster = max(v + rules.step * rate, 0.0)
        place, v = place + 0.5 * rules.step * (v + faster), faster
    free = ego.wish * rules.step * (n - 1)
    # what is lost after the horizon: the time to get back to the wished speed
    late = (ego.wish - v) ** 2 / (2.0 * rules.acceleration * max(ego.wish, 1.0))
    return (free - out[0, n - 1]) / max(ego.wish, 1.0) + late, effort
