"""Which lines at junctions are closed for the ego because others go first."""

from collections.abc import Sequence, Set
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from experiments.cosim.junctions import RoadJunction
from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.signals import CLEARING, STOP
from experiments.cosim.swinging_out import STANDS, oncoming
from planner.right_of_way.decision import decide, is_near
from planner.right_of_way.records import (
    AtJunction,
    Foe,
    JunctionAhead,
    Permission,
    Rule,
    Waiting,
)
from planner.scene import RoadUsers
from planner.states import CartesianState
from planner.ways import Ways

COMFORTABLE_DECELERATION = 3.0  # that a line may ask for [m/s²]
SAME_LINE = 0.5  # a signal's stop line and its junction's are so near [m]
QUEUE_SPEED = 1.0  # slower vehicles behind a junction may stay there [m/s]
QUEUE_WIDTH = 1.6  # lateral offset up to which they are in the ego's lane [m]
BEHIND = 1.0  # a vehicle with its rear so little inside counts as behind it [m]
SEEN = 100.0  # junctions nearer ahead are looked at [m] ...
LEFT = 30.0  # ... until the ego has left them so far behind [m]
BENT = 0.03  # curvature of the road beside which others take turns of their own [1/m]
SPACING = 1.0  # at which such bends are looked for [m]
FREE_ROOM = 1.0  # that is left when the ego has left the junction [m]

# What a signal's letter makes of the right of way; others need no decision here.
OF_LETTER = {
    "g": Rule.MINOR,
    "m": Rule.MINOR,
    "o": Rule.MINOR,
    "s": Rule.STOP,
    "=": Rule.RIGHT_BEFORE_LEFT,
    "w": Rule.ALL_WAY_STOP,
}
UNGUARDED = frozenset({Rule.MAJOR, Rule.OFF_MAJOR, Rule.ZIPPER})


@runtime_checkable
class JunctionTraffic(Protocol):
    """A world that knows who is on the way over the ego's junctions."""

    def movements(
        self, near: Set[int], vehicles: RoadUsers
    ) -> tuple[tuple[Foe, ...], Ways]:
        """Read the foes at the junctions in these places of the road's list.

        Also the ways of all vehicles.
        """
        ...


class RightOfWay:
    """Decides step by step at which junctions the ego has to wait.

    Args:
        road: Of the episode.
        task: The ego's.
        traffic: Knows the vehicles at junctions.
        step: Between two decisions [s].
    """

    def __init__(
        self, road: Road, task: EgoTask, traffic: JunctionTraffic, step: float
    ) -> None:
        self._road = road
        self._task = task
        self._traffic = traffic
        self._step = step
        self._memory: dict[int, Waiting] = {}
        self._stood: dict[str, float] = {}  # of those that stand [s]
        along = np.arange(0.0, road.path.length, SPACING)
        self._bends = along[np.abs(road.path.at(along).curvature) > BENT]

    def update(
        self, state: TrafficState, s: float, ego: CartesianState
    ) -> tuple[TrafficState, list[Permission]]:
        """Decide on all junctions that the ego is near.

        Args:
            state: The traffic, now.
            s: Arc length of the ego's rear axle [m].
            ego: Its state.

        Returns:
            The traffic with what happens at these junctions, and the decisions.
        """
        at = self._at(s, ego)
        near = [
            number
            for number, junction in enumerate(self._road.junctions)
            if junction.ahead.stop_s < at.front + SEEN
            and at.rear < junction.ahead.exit_s + LEFT
        ]
        if not near and not self._bends_near(at):
            return state, []
        found, ways = self._traffic.movements(set(near), state.vehicles)
        if any(self._road.junctions[number].swings for number in near):
            self._watch(state.vehicles)
        decided, junctions = [], []
        foes: list[Foe] = []
        for place, number in enumerate(near):
            junction = self._road.junctions[number]
            own = [x._replace(junction=place) for x in found if x.junction == number]
            if junction.swings:
                own += oncoming(place, junction, state.vehicles, ways, self._stood)
            ahead = self._ahead(junction, state, at)
            if ahead is not None and self._clears(junction, state, at):
                own = [x._replace(goes_first=x.to_line <= 0.0) for x in own]
            junctions.append(ahead or junction.ahead)
            foes += own
            if ahead is not None and self._is_due(number, at, ahead):
                decided.append(self._decision(number, at, ahead, own, state))
            elif ahead is None and is_near(at, junction.ahead):
                decided.append(self._first(at, junction.ahead, state))
        state = replace(state, ways=ways, junctions=tuple(junctions), foes=tuple(foes))
        return state, decided

    def _watch(self, vehicles: RoadUsers) -> None:
        """Remember for how long the others have stood, near a swing."""
        standing = np.flatnonzero(vehicles.speed < STANDS).tolist()
        names = [vehicles.ids[row] for row in standing]
        self._stood = {x: self._stood.get(x, -self._step) + self._step for x in names}

    def _bends_near(self, at: AtJunction) -> bool:
        """Check whether the road bends near the ego.

        There others are predicted along their lanes: one beside the ego does not turn
        as the ego does.
        """
        bends = self._bends  # growing
        first = int(bends.searchsorted(at.rear - LEFT, side="right"))
        return first < bends.size and bool(bends[first] < at.front + SEEN)

    def _decision(
        self,
        number: int,
        at: AtJunction,
        junction: JunctionAhead,
        foes: Sequence[Foe],
        state: TrafficState,
    ) -> Permission:
        """Decide on one junction and remember it."""
        memory = self._memory.get(number, Waiting())
        decision = decide(at, junction, foes, memory, self._step)
        if decision.stop_s is None and at.front <= junction.stop_s:
            decision = self._kept_clear(at, junction, state.vehicles, decision)
        self._memory[number] = decision.memory
        return decision

    def _first(
        self, at: AtJunction, ahead: JunctionAhead, state: TrafficState
    ) -> Permission:
        """Decide on a junction where the ego goes first: it still keeps it clear."""
        free = Permission(None, Waiting(), "")
        if at.front > ahead.stop_s or ahead.rule is Rule.ZIPPER:
            return free
        return self._kept_clear(at, ahead, state.vehicles, free)

    def lines_ahead(self, s: float) -> tuple[float, ...]:
        """List where vehicles give way at junctions ahead, growing [m]."""
        front = s + self._task.vehicle.front_reach
        lines = [
            junction.ahead.stop_s
            for junction in self._road.junctions
            if junction.signal or junction.ahead.rule not in UNGUARDED
        ]
        return tuple(sorted(line for line in lines if line >= front - SAME_LINE))

    def _is_due(self, number: int, at: AtJunction, junction: JunctionAhead) -> bool:
        """Check whether it is time to decide, or was before the ego is through."""
        known = number in self._memory and at.rear < junction.exit_s
        return known or is_near(at, junction)

    def _at(self, s: float, ego: CartesianState) -> AtJunction:
        """Describe the ego."""
        task = self._task
        return AtJunction(
            front=s + task.vehicle.front_reach,
            rear=s - task.vehicle.rear_overhang,
            speed=max(ego.speed, 0.0),
            target_speed=task.target_speed,
            deceleration=COMFORTABLE_DECELERATION,
            emergency_deceleration=task.vehicle.limits.emergency_deceleration,
        )

    @staticmethod
    def _ahead(
        junction: RoadJunction, state: TrafficState, at: AtJunction
    ) -> JunctionAhead | None:
        """Return a junction with the rule that holds now; None if the ego goes first.

        So it does where a signal decides: its own stop line is closed or open. An ego
        that waits inside when its light turns red still gives way.
        """
        ahead = junction.ahead
        if not junction.signal:
            swept = any(zone.shortest > 0.0 for zone in junction.zones)
            return ahead if swept or ahead.rule not in UNGUARDED else None
        rule = OF_LETTER.get(_letter(junction, state))
        if RightOfWay._clears(junction, state, at):
            rule = Rule.MINOR
        return None if rule is None else replace(ahead, rule=rule)

    @staticmethod
    def _clears(junction: RoadJunction, state: TrafficState, at: AtJunction) -> bool:
        """Check whether the ego is inside a junction and its light has turned red.

        It leaves before those who are still at their lines, as their lights turn green.
        """
        closed = _letter(junction, state) in STOP | CLEARING
        return closed and at.front > junction.ahead.stop_s

    def _kept_clear(
        self,
        at: AtJunction,
        junction: JunctionAhead,
        vehicles: RoadUsers,
        decision: Permission,
    ) -> Permission:
        """Close the line if the ego would have to stop inside the junction."""
        slow = vehicles.among(vehicles.speed < QUEUE_SPEED)
        if not slow.ids:
            return decision
        s, l = self._road.path.project(slow.x, slow.y)
        rears = s - 0.5 * slow.length
        queue = (np.abs(l) < QUEUE_WIDTH) & (rears > junction.exit_s - BEHIND)
        if not queue.any():
            return decision
        first = int(np.argmin(np.where(queue, rears, np.inf)))
        room = float(rears[first]) - junction.exit_s
        way = junction.stop_s - at.front
        if room >= self._task.vehicle.length + FREE_ROOM:
            return decision
        if at.speed**2 > 2.0 * at.deceleration * max(way, 0.0):
            return decision
        why = f"{slow.ids[first]} behind the junction"
        return Permission(junction.stop_s, decision.memory._replace(goes=False), why)


def _letter(junction: RoadJunction, state: TrafficState) -> str:
    """Return what the ego's light at a junction shows, "" without one."""
    for signal in state.signals:
        near = abs(signal.stop_s - junction.ahead.stop_s) < SAME_LINE
        if near and signal.id == junction.signal:
            return signal.state
    return ""


def closed_lines(decided: Sequence[Permission]) -> tuple[float, ...]:
    """Return the arc lengths where the ego has to stop, growing [m]."""
    return tuple(sorted(x.stop_s for x in decided if x.stop_s is not None))
