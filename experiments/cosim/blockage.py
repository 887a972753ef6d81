"""Detects an ego that stands because there is no way on."""

import numpy as np

from experiments.cosim.passage import BodiesAlongPath, room_beside
from experiments.cosim.records import TrafficState
from planner.interface import PlanStats
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState, FrenetState
from planner.vehicle import Vehicle

STANDING = 0.1  # slower is standing [m/s]
WAITING_ROOM = 15.0  # from the front bumper to the line or vehicle one waits at [m]
QUEUE_WIDTH = 2.5  # lateral offset up to which a vehicle is in the ego's queue [m]
QUEUE_SPEED = 2.0  # slower vehicles before a closed line are its queue [m/s]
NEAR = 30.0  # a vehicle that moves within this may be what the ego gives way to [m]
SETS_OFF = 3.0  # so long after its line has opened the ego may stand still [s]
JUST_NOW = 0.5  # a line that was closed in the last steps still is, for words [s]
UNNAMED = 3.0  # patience with a planner that names no reason while others drive by [-]
NOTHING_AHEAD = ", and nothing stands ahead: its plans do not move off"
_TOLERANCE = 1e-9  # [s]


class BlockageDetector:
    """Distinguishes an ego that is blocked from one that waits.

    The ego is blocked if it has stood for `patience` before a static body, a vehicle
    that stood just as long, or for any other reason, also one that its planner does not
    name. An ego that stands at a closed stop line waits, and so does one behind a
    vehicle on the way to the line: the queue will move. Waiting does not count as
    standing; what was counted before counts on afterwards, until the ego moves.

    Args:
        patience: Time of standing after which the ego is blocked [s].
        vehicle: The ego's dimensions.
        path: Of the ego.
        obstacles: Static bodies.
        bounds: Edges of the road.
    """

    def __init__(
        self,
        patience: float,
        vehicle: Vehicle,
        path: ReferencePath,
        obstacles: Obstacles,
        bounds: RoadBounds,
    ) -> None:
        self._patience = patience
        self._front_reach = vehicle.front_reach
        self._width = vehicle.width
        self._path = path
        self._obstacles = obstacles
        self._bounds = bounds
        self._since: float | None = None  # the ego stands since then [s]
        self._stood = 0.0  # of this, the time that counts [s]
        self._counted_until: float | None = None  # None while the ego waits [s]
        self._quiet = 0.0  # counted time since a vehicle moved nearby [s]
        self._closed: tuple[float, float] | None = None  # line where it stood, when
        self._still: dict[str, float] = {}  # vehicle -> stood while time counted [s]

    def update(
        self,
        place: FrenetState,
        ego: CartesianState,
        traffic: TrafficState,
        stop_lines: tuple[float, ...],
        stats: PlanStats,
        queue_lines: tuple[float, ...] = (),
    ) -> str | None:
        """Update with one step.

        Args:
            place: Of the ego along its path.
            ego: The ego's state.
            traffic: All other vehicles, now.
            stop_lines: The closed ones ahead [m].
            stats: Of the last plan.
            queue_lines: Open ones at which vehicles ahead may have to give way [m].

        Returns:
            The reason why the ego is blocked and since when it stands, or None if it is
            not (yet).
        """
        now = traffic.time
        if abs(ego.speed) >= STANDING:
            self._forget()
            return None
        self._since = now if self._since is None else self._since
        front = place.s + self._front_reach
        if stop_lines and min(stop_lines) - front <= WAITING_ROOM:
            self._closed = min(stop_lines), now
        if self._waits(place, traffic, stop_lines, stats) or self._waits_in_queue(
            place, traffic, queue_lines
        ):
            self._counted_until = None
            return None
        passed = 0.0 if self._counted_until is None else now - self._counted_until
        self._counted_until = now
        self._stood += passed
        self._watch(ego, traffic, passed)
        if not self._is_blocked(traffic, stats):
            return None
        return (
            f"stood {now - self._since:.0f} s at s = {place.s:.1f} m, since "
            f"t = {self._since:.1f} s: {self._why(place, traffic, stats)}"
        )

    def standing(
        self,
        place: FrenetState,
        traffic: TrafficState,
        stats: PlanStats,
        gives_way_to: str | None = None,
    ) -> str | None:
        """Say since when the ego stands, and why; None if it moves.

        Args:
            place: Of the ego.
            traffic: All other vehicles.
            stats: Of the last plan.
            gives_way_to: For whom its line is closed now, which is why it stands.
        """
        if self._since is None:
            return None
        why = f"gives way to {gives_way_to}"
        if gives_way_to is None:
            named = stats.reason or stats.blocker  # then it is not the line alone
            line = "" if named else self._at_line(traffic.time)
            why = line or self._why(place, traffic, stats)
        return f"stands since t = {self._since:.1f} s: {why}"

    def _at_line(self, now: float) -> str:
        """Say that the ego stands at a line that is, or was just now, closed."""
        if self._closed is None or now - self._closed[1] > SETS_OFF:
            return ""
        line, last = self._closed
        until = f", closed until t = {last:.1f} s" if now - last > JUST_NOW else ""
        return f"waits at the line at s = {line:.1f} m, a red light or a sign{until}"

    def _forget(self) -> None:
        """Start again with an ego that moves."""
        self._since = self._counted_until = self._closed = None
        self._stood = self._quiet = 0.0
        self._still.clear()

    def _is_blocked(self, traffic: TrafficState, stats: PlanStats) -> bool:
        """Check whether the ego has stood for long enough."""
        patience = self._patience - _TOLERANCE
        if self._stood < patience:
            return False
        if stats.blocker in traffic.vehicles.ids:
            return self._still.get(stats.blocker or "", 0.0) >= patience
        if stats.blocker or stats.reason:
            return True
        return self._quiet >= patience or self._stood >= UNNAMED * patience

    def _waits(
        self,
        place: FrenetState,
        traffic: TrafficState,
        stop_lines: tuple[float, ...],
        stats: PlanStats,
    ) -> bool:
        """Check whether the ego stands because of a closed stop line."""
        if not stop_lines:
            return False
        line, front = min(stop_lines), place.s + self._front_reach
        if line - front <= WAITING_ROOM or stats.blocker in traffic.vehicles.ids:
            return True
        return self._queues(place.l, front, line, traffic)

    def _waits_in_queue(
        self, place: FrenetState, traffic: TrafficState, lines: tuple[float, ...]
    ) -> bool:
        """Check whether the ego stands behind others that give way at a junction."""
        front = place.s + self._front_reach
        ahead = [line for line in lines if line - front > WAITING_ROOM]
        near = [line for line in lines if 0.0 <= line - front <= WAITING_ROOM]
        if near:
            return self._stands_before(place.l, front, near[0], traffic)
        return bool(ahead) and self._queues(place.l, front, ahead[0], traffic)

    def _stands_before(
        self, l: float, front: float, line: float, traffic: TrafficState
    ) -> bool:
        """Check whether a vehicle is between the ego and a line close ahead."""
        users = traffic.vehicles
        s, offset = self._path.project(users.x, users.y)
        ahead = (np.abs(offset - l) <= QUEUE_WIDTH) & (s > front)
        rear = s - 0.5 * users.length
        return bool((ahead & (rear < line) & (users.speed < QUEUE_SPEED)).any())

    def _queues(
        self, l: float, front: float, line: float, traffic: TrafficState
    ) -> bool:
        """Check whether vehicles stand in a row from the ego to the line."""
        users = traffic.vehicles
        s, offset = self._path.project(users.x, users.y)
        ahead = (np.abs(offset - l) <= QUEUE_WIDTH) & (s > front) & (s < line)
        ahead &= users.speed < QUEUE_SPEED
        for index in np.flatnonzero(ahead)[np.argsort(s[ahead])].tolist():
            half = 0.5 * float(users.length[index])
            if float(s[index]) - half - front > WAITING_ROOM:
                return False
            front = float(s[index]) + half
            if line - front <= WAITING_ROOM:
                return True
        return False

    def _why(self, place: FrenetState, traffic: TrafficState, stats: PlanStats) -> str:
        """Return the planner's reason; without one, what stands ahead."""
        if stats.reason:
            return stats.reason
        bodies = BodiesAlongPath.of(
            self._path, self._obstacles, traffic.vehicles, STANDING
        )
        refused = _refused(stats) + _planned(stats)
        if stats.blocker:
            room = ""
            if stats.blocker in bodies.ids:
                room = self._room(bodies, bodies.ids.index(stats.blocker))
            return f"{stats.blocker} is in the way{room}{refused}"
        ahead = self._ahead(place, bodies)
        if ahead and refused:
            return f"{ahead}{refused}"
        if ahead:
            return f"the planner gives no reason; {ahead}"
        if refused:
            return f"nothing stands ahead, yet its plans do not move off{refused}"
        return f"the planner gives no reason{NOTHING_AHEAD}"

    def _ahead(self, place: FrenetState, bodies: BodiesAlongPath) -> str:
        """Describe the nearest body that stands before the ego; empty without one."""
        front = place.s + self._front_reach
        gap = bodies.s - bodies.half_length - front
        aside = np.abs(bodies.l - place.l)
        before = bodies.stands & (aside < bodies.half_width + 0.5 * self._width)
        before &= (gap < NEAR) & (bodies.s > front)
        if not before.any():
            return ""
        nearest = int(np.argmin(np.where(before, gap, np.inf)))
        room = self._room(bodies, nearest)
        name = bodies.ids[nearest]
        return f"{name} stands {max(float(gap[nearest]), 0.0):.1f} m ahead{room}"

    def _room(self, bodies: BodiesAlongPath, k: int) -> str:
        """Describe the room beside a body that stands; empty for one that drives."""
        if not bodies.stands[k]:
            return ""
        left, right = room_beside(bodies, k, self._bounds)
        return (
            f", with {left:.1f} m free on its left and {right:.1f} m on its right "
            f"for a body {self._width:.1f} m wide"
        )

    def _watch(self, ego: CartesianState, traffic: TrafficState, passed: float) -> None:
        """Record for how long each vehicle stands, and whether one moves nearby."""
        users = traffic.vehicles
        moving = users.speed >= STANDING
        near = np.hypot(users.x - ego.x, users.y - ego.y) <= NEAR
        self._quiet = 0.0 if bool((moving & near).any()) else self._quiet + passed
        for name, moves in zip(users.ids, moving.tolist(), strict=True):
            if moves:
                self._still.pop(name, None)
            else:
                known = self._still.get(name)
                self._still[name] = 0.0 if known is None else known + passed


def _refused(stats: PlanStats) -> str:
    """Say by which checks motions were removed; empty if the planner does not."""
    if not stats.removed:
        return ""
    checks = ", ".join(
        f"{name.replace('_', ' ')} {count}"
        for name, count in sorted(stats.removed.items(), key=lambda item: -item[1])
    )
    return f"; motions refused: {checks}"


def _planned(stats: PlanStats) -> str:
    """Say what the planner is about; empty if it does not tell."""
    return f"; its plan: {stats.explanation}" if stats.explanation else ""
