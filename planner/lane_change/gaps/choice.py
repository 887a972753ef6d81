"""The gaps of the neighbour lanes, the cheapest first, with the way into each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.lane_change.gaps.rollout import (
    EgoStart,
    GapCase,
    LaneTraffic,
    OwnLane,
    RolloutRules,
    best_entry,
    lane_traffic,
)
from planner.lane_change.phases.cycle_view import (
    Situation,
    blockage_ahead,
    blockage_end,
)
from planner.lane_change.settings import GapSettings, LaneChangeSettings
from planner.lane_change.surroundings import claims_lane
from planner.states import FloatArray
from planner.vehicle import body_scale

QUEUE_GAP = 2.5  # between vehicles that wait at a blockage [m]
LEAST_ROOM = 5.0  # of a car, in which it may come past a blockage [m]
UNSEEN = 20.0  # behind the last vehicle, if that is where sight ends [m]
UNSEEN_LENGTH = 5.0  # of who comes from there [m]
FOLLOWING = 3.0  # headway below which a vehicle would rather go faster [s]


@dataclass(frozen=True, slots=True, eq=False)
class GapPlan:
    """One gap and the way into it, as rolled out."""

    target: int  # lane
    ahead: str | None  # the vehicle that the ego would follow
    behind: str | None  # the vehicle that would follow the ego
    cost: float  # [s]
    entry: float  # time until the change begins [s]
    braking: float  # expected of the one behind [m/s²]
    missing: float  # of the distances that safety asks for [m]
    distance: FloatArray  # of the way from now, (n,) [m]
    speed: FloatArray  # (n,) [m/s]
    step: float  # between the points of the way [s]

    def at(self, times: FloatArray) -> FloatArray:
        """Return distance and speed of the way at times, (2, n)."""
        own = self.step * np.arange(self.distance.size)
        speed = np.interp(times, own, self.speed)
        driven = np.interp(times, own, self.distance)
        return np.array([driven, speed])

    @property
    def name(self) -> tuple[int, str | None, str | None]:
        """Identify the gap from cycle to cycle."""
        return self.target, self.ahead, self.behind

    def __str__(self) -> str:
        """Describe the gap for explanations."""
        place = f"behind {self.ahead}" if self.ahead else "with nobody ahead"
        place += f", ahead of {self.behind}" if self.behind else ", with nobody behind"
        lacks = f", {self.missing:.1f} m short" if self.missing > 0.0 else ""
        return (
            f"gap {place} in {self.entry:.1f} s{lacks}, "
            f"braking {self.braking:.1f} m/s² there"
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Lane:
    """The vehicles of a lane, from the foremost back; the last one is out of sight."""

    ids: tuple[str | None, ...]
    traffic: LaneTraffic


def choose_gaps(
    here: Situation,
    lane: int,
    targets: Sequence[int],
    kept: tuple[int, str | None, str | None] | None,
    settings: LaneChangeSettings,
) -> list[GapPlan]:
    """Roll out the way into every gap near the ego, the cheapest first.

    Args:
        here: Of this cycle.
        lane: That the ego is in.
        targets: Lanes that it may go to.
        kept: The gap of the last cycle; another one has to be better by `keep_gain`.
        settings: See there.

    Returns:
        Those that the ego can come into within the horizon.
    """
    rules = settings.gaps
    scene = here.scene
    vehicle = scene.vehicle
    front = scene.ego_frenet.s + vehicle.front_reach
    speed = max(scene.ego.speed, 0.0)
    ego = EgoStart(front, vehicle.length, speed, scene.target_speed)
    own = _own_lane(here, lane, front, settings)
    braking = settings.promised_braking(vehicle.limits.max_deceleration)
    numbers = _numbers(rules, settings, braking)
    found = []
    for target in targets:
        there = _lane(here, target, rules)
        for gap in _near_gaps(there.traffic, ego, rules):
            motion = np.empty((2, rules.n_times))
            case = GapCase(ego, own, there.traffic, gap, numbers)
            entry = best_entry(case, motion)
            if entry.at < 0:
                continue
            plan = GapPlan(
                target,
                there.ids[gap - 1] if gap > 0 else None,
                there.ids[gap],
                entry.cost,
                entry.at * rules.step,
                entry.braking,
                entry.missing,
                motion[0],
                motion[1],
                rules.step,
            )
            found.append(plan)

    def rank(plan: GapPlan) -> float:
        return plan.cost - (rules.keep_gain if plan.name == kept else 0.0)

    return sorted(found, key=rank)


def _numbers(
    rules: GapSettings, settings: LaneChangeSettings, braking: float
) -> RolloutRules:
    """Return the settings as compiled code takes them."""
    return RolloutRules(
        rules.step,
        rules.line_time,
        rules.aside_time,
        rules.acceleration,
        rules.braking,
        settings.speed.front_gap + settings.speed.along_margin,
        rules.front_headway,
        rules.reaction,
        settings.manoeuvre.rear_braking,
        braking,
        rules.braking_weight,
        rules.missing_weight,
        rules.most_missing,
        rules.wait_weight,
        rules.room_weight,
        rules.room_scale,
        rules.effort_weight,
    )


def _own_lane(
    here: Situation, lane: int, front: float, settings: LaneChangeSettings
) -> OwnLane:
    """Describe what is ahead in the ego's own lane."""
    bodies = here.bodies
    ahead = (
        ~here.behind
        & claims_lane(here.scene, bodies, lane)
        & (bodies.s > here.scene.ego_frenet.s)
    )
    ahead[: bodies.n_static] = False
    rear, speed = math.inf, 0.0
    if ahead.any():
        rears = np.where(ahead, bodies.s - bodies.half_length, np.inf)
        k = int(np.argmin(rears))
        rear, speed = float(rears[k]), max(float(bodies.speed[k]), 0.0)
    room = blockage_ahead(here, lane)
    if not math.isfinite(room):
        return OwnLane(rear, speed, math.inf, math.inf, math.inf, math.inf)
    scale = body_scale(here.scene.vehicle)
    wait = front + room - settings.manoeuvre.pull_out_room * scale
    queue = bodies.s < front + room
    lengths = 2.0 * bodies.half_length[ahead & queue] + QUEUE_GAP
    stop = front + room - settings.manoeuvre.pull_out_room - float(lengths.sum())
    return OwnLane(
        rear,
        speed,
        stop if lengths.size else math.inf,
        wait,
        front + room - LEAST_ROOM * scale,
        blockage_end(here, lane),
    )


def _lane(here: Situation, target: int, rules: GapSettings) -> _Lane:
    """Roll out the vehicles of a lane as if the ego did not come.

    Whoever comes behind the last one that is seen is not seen yet: one more is taken to
    come from where sight ends, as fast as the ego wants to go.
    """
    bodies, scene = here.bodies, here.scene
    inside = np.flatnonzero(claims_lane(scene, bodies, target) & np.isfinite(bodies.s))
    front = (bodies.s + bodies.half_length)[inside]
    order = np.argsort(-front, kind="stable")
    inside, front = inside[order], front[order]
    speed = np.maximum(bodies.speed[inside], 0.0)
    length = 2.0 * bodies.half_length[inside]
    headway = np.full(speed.size, np.inf)
    headway[1:] = (front[:-1] - length[:-1] - front[1:]) / np.maximum(speed[1:], 0.1)
    hurried = 0.5 * (speed + scene.target_speed)
    wish = np.where(headway < FOLLOWING, np.maximum(speed, hurried), speed)
    wish[inside < bodies.n_static] = 0.0
    unseen = min(scene.ego_frenet.s - rules.sight, front.min(initial=np.inf) - UNSEEN)
    front, length = np.append(front, unseen), np.append(length, UNSEEN_LENGTH)
    speed, wish = (
        np.append(speed, scene.target_speed),
        np.append(wish, scene.target_speed),
    )
    traffic = lane_traffic(front, length, speed, wish, rules.step, rules.n_times)
    ids = here.ahead.ids
    return _Lane((*(ids[k] for k in inside.tolist()), None), traffic)


def _near_gaps(lane: LaneTraffic, ego: EgoStart, rules: GapSettings) -> range:
    """Return the gaps about the ego: `gaps_ahead` and `gaps_behind` of the nearest."""
    n = lane.front.shape[0] - 1  # without the one out of sight
    beside = int(np.count_nonzero(lane.front[:, 0] > ego.front - 0.5 * ego.length))
    first = max(beside - rules.gaps_ahead, 0)
    return range(first, min(beside + rules.gaps_behind, n) + 1)
