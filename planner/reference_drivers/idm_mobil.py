"""IDM and MOBIL: the usual model of a human driver on a road of lanes.

The Intelligent Driver Model gives the acceleration behind a leader, MOBIL the decision
to change lanes from the accelerations that everyone concerned would have before and
after. Both are models of points in lanes; here they drive the same vehicle under the
same limits as every planner, along a smooth path into the lane that MOBIL has chosen.

What stands in a lane, and where a lane ends, is a leader that has stopped; a driver
waits `waiting_room` before it, where the way into the next lane is still open, and as
far behind others that stand there.

Sources:
    [Treiber2000] M. Treiber, A. Hennecke, D. Helbing, Congested traffic states in
        empirical observations and microscopic simulations. Physical Review E 62 (2000).
    [Kesting2007] A. Kesting, M. Treiber, D. Helbing, General lane-changing model MOBIL
        for car-following models. Transportation Research Record 1999 (2007).
"""

import math
from dataclasses import dataclass

import numpy as np

from planner.fallback.braking import braking_on_arc
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.numerics import polynomials
from planner.reference_drivers.lane_road import (
    MARKED,
    LaneRoad,
    beside,
    in_lane,
    lane_at,
    lane_centre,
    lane_end,
    lane_road,
    on_way,
    wished_speed,
)
from planner.reference_path.frenet import frenet_trajectory
from planner.scene import Scene
from planner.scene_checks import invalid
from planner.states import BoolArray, FloatArray, FrenetStates, Trajectory

HORIZON = 5.0  # of the trajectories [s]
SETTLED = 0.1  # as near to its lane's centre a change is over [m]
TOUCHING = 0.1  # a gap below this counts as this, so that braking stays finite [m]
SETTLE_TIME = 3.0  # in which a driver beside the lane's centre returns to it [s]
LEAST_REST = 5.0  # of a change, so that its end is not jerked [m]
BRAKING_JUDGED = 9.0  # harder braking counts as this when lanes are compared [m/s²]
CREEPING = 5.0  # the slower than this it is before a closure, the more room [m/s]
QUEUE = 100.0  # who stands this near before a closure waits there [m]


@dataclass(frozen=True, slots=True)
class IdmMobilSettings:
    """Parameters of both models.

    Raises:
        ValueError: If one is out of range.
    """

    headway: float = 1.2  # T [s]
    standstill_gap: float = 2.0  # s0 [m]
    acceleration: float = 1.5  # a [m/s²]
    deceleration: float = 2.0  # b, comfortable [m/s²]
    exponent: float = 4.0  # delta [-]
    politeness: float = 0.2  # p: weight of the others' accelerations [-]
    threshold: float = 0.1  # advantage that is worth a change [m/s²]
    safe_braking: float = 4.0  # hardest that the new follower may have to brake [m/s²]
    change_time: float = 4.0  # in which a change is driven [s]
    change_length: float = 14.0  # and over at least this [m]
    waiting_room: float = 14.0  # kept to the end of the lane while waiting [m]

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in self.__slots__:
            least_open = name not in ("politeness", "threshold", "waiting_room")
            value = getattr(self, name)
            if not (0.0 < value < 1e3 if least_open else 0.0 <= value < 1e3):
                bound = "above 0" if least_open else "at least 0"
                raise ValueError(f"{name} must be {bound} and below 1000")


@dataclass(frozen=True, slots=True)
class DriverMemory:
    """The lane that the driver keeps or changes to."""

    lane: int
    end: float | None = None  # s where a change is over; None while keeping a lane [m]


@dataclass(frozen=True, slots=True)
class _Ahead:
    """The leader of a vehicle: gap from bumper to bumper, and speed."""

    gap: float = math.inf  # [m]
    speed: float = 0.0  # [m/s]
    id: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class IdmMobilPlanner:
    """Follow by IDM, change lanes by MOBIL; `plan` is pure."""

    settings: IdmMobilSettings

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        road = lane_road(scene)
        last = memory if isinstance(memory, DriverMemory) else None
        wish = wished_speed(scene, self.settings.deceleration)
        choice = _Choice(self, scene, road, wish)
        kept, why = choice.lane(last)
        leader = choice.leader(kept)
        trajectory = self._drive(scene, kept, wish, leader)
        if trajectory is None:
            braking = scene.vehicle.limits.emergency_deceleration
            trajectory = braking_on_arc(scene.ego, braking, scene.step, HORIZON)
            stats = PlanStats(reason="no way in the road's frame", candidates=1)
            return PlanResult(PlanStatus.EMERGENCY_BRAKING, trajectory, kept, stats)
        stats = PlanStats(candidates=1, survivors=1, blocker=leader.id, explanation=why)
        return PlanResult(PlanStatus.OK, trajectory, kept, stats)

    def idm(self, speed: float, wish: float, gap: float, leader_speed: float) -> float:
        """Return the acceleration behind a leader [m/s²]; [Treiber2000] eq. 2, 3.

        Args:
            speed: Own [m/s].
            wish: Speed on a free road [m/s].
            gap: From bumper to bumper, inf without a leader [m].
            leader_speed: [m/s].
        """
        p = self.settings
        free: float = 1.0 - (speed / max(wish, 0.1)) ** p.exponent
        if math.isinf(gap):
            return p.acceleration * free
        desired = float(self._desired_gap(speed, leader_speed))
        interaction: float = (desired / max(gap, TOUCHING)) ** 2
        return p.acceleration * (free - interaction)

    def _desired_gap(
        self, speed: float, leader_speed: float | FloatArray
    ) -> float | FloatArray:
        """Return s* behind each leader [m]; [Treiber2000] eq. 3."""
        p = self.settings
        braking = 2.0 * math.sqrt(p.acceleration * p.deceleration)
        dynamic = speed * p.headway + speed * (speed - leader_speed) / braking
        return p.standstill_gap + np.maximum(dynamic, 0.0)

    def comfortable_gap(self, speed: float, leader_speed: FloatArray) -> FloatArray:
        """Return the gap at which a driver far below its wish brakes with b, (n,) [m].

        Solves [Treiber2000] eq. 2 without its free term, a (1 - (s*/s)²) = -b.

        Args:
            speed: Own [m/s].
            leader_speed: (n,) [m/s].
        """
        p = self.settings
        desired = self._desired_gap(speed, leader_speed)
        return np.asarray(desired / math.sqrt(1.0 + p.deceleration / p.acceleration))

    def _drive(
        self, scene: Scene, kept: DriverMemory, wish: float, leader: _Ahead
    ) -> Trajectory | None:
        """Follow a leader that keeps its speed, on the way into the lane.

        None where the road's frame does not reach.
        """
        ego, limits = scene.ego_frenet, scene.vehicle.limits
        n = max(round(HORIZON / scene.step), 1) + 1
        t = scene.step * np.arange(n, dtype=np.float64)
        s, s_dot, s_ddot = (np.empty(n) for _ in range(3))
        place, speed, gap = ego.s, max(ego.s_dot, 0.0), leader.gap
        for k in range(n):
            rate = self.idm(speed, wish, gap, leader.speed)
            rate = min(rate, limits.max_acceleration)
            rate = max(rate, -limits.emergency_deceleration, -speed / scene.step)
            s[k], s_dot[k], s_ddot[k] = place, speed, rate
            driven = scene.step * (speed + 0.5 * scene.step * rate)
            place, speed = place + driven, max(speed + scene.step * rate, 0.0)
            gap += scene.step * leader.speed - driven
        l, slope, bend = _way(scene, kept, self.settings.change_length, s)
        states = FrenetStates(
            s,
            s_dot,
            s_ddot,
            l,
            slope * s_dot,
            bend * s_dot**2 + slope * s_ddot,
            slope,
            bend,
        )
        return frenet_trajectory(scene.path, t, states)


@dataclass(frozen=True, slots=True, eq=False)
class _Choice:
    """The choice of a lane in one cycle."""

    driver: IdmMobilPlanner
    scene: Scene
    road: LaneRoad
    wish: float  # speed on a free road [m/s]

    def lane(self, last: DriverMemory | None) -> tuple[DriverMemory, str]:
        """Return the lane to keep or to change to, and why."""
        scene, settings = self.scene, self.driver.settings
        ego = scene.ego_frenet
        own = lane_at(scene, ego.l)
        if own < 0:
            return DriverMemory(-1), "no marked lanes"
        if last is not None and last.end is not None and last.lane >= 0:
            settled = abs(lane_centre(scene, last.lane) - ego.l) < SETTLED
            if ego.s < last.end or not settled:
                return last, "changes lanes"
        best, gain = None, settings.threshold
        for lane in (own + 1, own - 1):
            incentive = self.incentive(own, lane)
            if incentive is not None and incentive > gain:
                best, gain = lane, incentive
        if best is None:
            return DriverMemory(own), "keeps its lane"
        length = max(scene.ego.speed * settings.change_time, settings.change_length)
        return DriverMemory(best, ego.s + length), f"gains {gain:.2f} m/s²"

    def incentive(self, own: int, lane: int) -> float | None:
        """Return the advantage of another lane; None if there is none or it is unsafe.

        [Kesting2007] eq. 2 and 4: neither the new follower nor the ego may have to
        brake harder than `safe_braking`; the ego's acceleration counts, and those of
        both followers weighted by `politeness`.
        """
        scene, road, settings = self.scene, self.road, self.driver.settings
        centres, widths = scene.lanes.at(scene.ego_frenet.s)
        if not 0 <= lane < centres.size or widths[lane] <= MARKED:
            return None
        new = in_lane(scene, road, lane)
        if np.any(new & beside(scene, road, settings.standstill_gap)):
            return None
        there, here = self._ahead(lane), self._ahead(own)
        own_after = self._follow(there)
        before, after = self._follower(new, there)
        if min(after, own_after) < -settings.safe_braking:
            return None
        relieved, held_up = self._follower(in_lane(scene, road, own), here)
        others = (after - before) + (relieved - held_up)
        return own_after - self._follow(here) + settings.politeness * others

    def leader(self, kept: DriverMemory) -> _Ahead:
        """Return the leader to mind on the way into, or along, the kept lane."""
        scene, road = self.scene, self.road
        if kept.lane < 0:
            offset = np.full(road.s.size, scene.ego_frenet.l)
            return self._nearest(on_way(scene, road, offset), math.inf, 0.0)
        if kept.end is None:
            return self._ahead(kept.lane)
        touching = road.s - road.half_length - scene.vehicle.front_reach
        length = self.driver.settings.change_length
        offset, _, _ = _way(scene, kept, length, touching)
        met = self._nearest(on_way(scene, road, offset), math.inf, 0.0)
        return min(met, self._ahead(kept.lane), key=self._follow)

    def _ahead(self, lane: int) -> _Ahead:
        """Return the leader in a lane; its end is one that stands."""
        there = in_lane(self.scene, self.road, lane)
        room = self.driver.settings.waiting_room
        return self._nearest(there, lane_end(self.scene, lane), room)

    def _nearest(self, there: BoolArray, end: float, room: float) -> _Ahead:
        """Return the leader that is braked for most.

        Args:
            there: Bodies that may be leaders.
            end: Of the lane, inf if it goes on [m].
            room: Kept to the end of the lane, to bodies that never move, and the more
                of it to what is before these the slower that is [m].
        """
        scene, road = self.scene, self.road
        ego, vehicle = scene.ego_frenet, scene.vehicle
        front, stand = ego.s + vehicle.front_reach, self.driver.settings.standstill_gap
        found = [_Ahead(line - front + stand) for line in scene.stop_lines]
        if math.isfinite(end):
            found.append(_Ahead(max(end - front - room, TOUCHING)))
        gaps = road.s - road.half_length - front
        ahead = there & (road.s > ego.s + vehicle.centre_offset)
        closed = np.min(road.s, where=ahead & road.static, initial=end)
        share = np.where(road.static, 1.0, 0.0)
        if math.isfinite(closed):
            slow = np.maximum(1.0 - road.speed / CREEPING, 0.0)
            share = np.where((road.s < closed) & (closed - road.s < QUEUE), slow, share)
        # for the sake of the room, what moves is never braked for uncomfortably
        gentle = self.driver.comfortable_gap(max(scene.ego.speed, 0.0), road.speed)
        least = np.where(road.static, TOUCHING, np.minimum(gaps, gentle))
        gaps = np.where(share > 0.0, np.maximum(gaps - share * room, least), gaps)
        found += [
            _Ahead(float(gaps[k]), float(road.speed[k]), road.ids[k])
            for k in np.flatnonzero(ahead)
        ]
        return min(found, key=self._follow, default=_Ahead())

    def _follow(self, leader: _Ahead) -> float:
        """Return the ego's acceleration behind a leader, within limits [m/s²]."""
        speed = max(self.scene.ego.speed, 0.0)
        rate = self.driver.idm(speed, self.wish, leader.gap, leader.speed)
        return max(rate, -BRAKING_JUDGED)

    def _follower(self, there: BoolArray, leader: _Ahead) -> tuple[float, float]:
        """Return a follower's acceleration (without the ego, behind the ego) [m/s²].

        The follower is the nearest moving body behind the ego among `there`; it is
        taken for a driver like this one at its own speed. (0, 0) without one.
        """
        scene, road, driver = self.scene, self.road, self.driver
        ego, vehicle = scene.ego_frenet, scene.vehicle
        behind = there & ~road.static & (road.s < ego.s + vehicle.centre_offset)
        if not behind.any():
            return 0.0, 0.0
        k = int(np.argmax(np.where(behind, road.s, -np.inf)))
        speed = float(road.speed[k])
        wish = max(self.wish, speed)
        gap = ego.s - vehicle.rear_overhang - float(road.s[k] + road.half_length[k])
        without = gap + vehicle.length + leader.gap
        rates = (
            driver.idm(speed, wish, without, leader.speed),
            driver.idm(speed, wish, gap, max(ego.s_dot, 0.0)),
        )
        return max(rates[0], -BRAKING_JUDGED), max(rates[1], -BRAKING_JUDGED)


def _way(
    scene: Scene, kept: DriverMemory, least: float, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (l, l', l'') of the way into the lane at arc lengths, (n,) each.

    A quintic from where the ego is; the lane's centre from its end on, and behind.
    """
    ego = scene.ego_frenet
    if kept.lane < 0:
        flat = np.zeros(s.size)
        return np.full(s.size, ego.l), flat, flat
    lanes = scene.lanes
    least = max(least, SETTLE_TIME * max(ego.s_dot, 0.0))
    length = least if kept.end is None else max(kept.end - ego.s, LEAST_REST)
    end = ego.s + length
    target = float(np.interp(end, lanes.s, lanes.centre[kept.lane]))
    c = polynomials.quintic(
        (ego.l, ego.l_prime, ego.l_second), (target, 0.0, 0.0), length
    )
    inside = np.clip(s - ego.s, 0.0, length)
    l, slope, bend = (polynomials.evaluate(c, inside, k) for k in range(3))
    past = s - ego.s > length
    return l, np.where(past, 0.0, slope), np.where(past, 0.0, bend)


def idm_mobil(settings: IdmMobilSettings | None = None) -> IdmMobilPlanner:
    """Make the planner."""
    return IdmMobilPlanner(settings or IdmMobilSettings())
