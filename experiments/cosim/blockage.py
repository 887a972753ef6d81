"""Detects an ego that stands because there is no way on."""

from experiments.cosim.records import TrafficState
from planner.interface import PlanStats

STANDING = 0.1  # slower is standing [m/s]
WAITING_ROOM = 15.0  # from the front bumper to the line one waits at [m]


class BlockageDetector:
    """Distinguishes an ego that is blocked from one that waits.

    The ego is blocked if it has stood for `patience` while the planner named a static
    body, a vehicle that stood just as long, or only a reason. An ego that stands at a
    closed stop line waits, and so does one behind a vehicle on the way to the line:
    the queue will move. Waiting does not count as standing.

    Args:
        patience: Time of standing after which the ego is blocked [s].
        front_reach: From the ego's rear axle to its front bumper [m].
    """

    def __init__(self, patience: float, front_reach: float) -> None:
        self._patience = patience
        self._front_reach = front_reach
        self._since: float | None = None  # the ego stands since then [s]
        self._still: dict[str, float] = {}  # vehicle -> stands since then [s]

    def update(
        self,
        s: float,
        speed: float,
        traffic: TrafficState,
        stop_lines: tuple[float, ...],
        stats: PlanStats,
    ) -> str | None:
        """Update with one step.

        Args:
            s: Of the ego's rear axle [m].
            speed: Of the ego [m/s].
            traffic: All other vehicles, now.
            stop_lines: The closed ones ahead [m].
            stats: Of the last plan.

        Returns:
            The reason why the ego is blocked, or None if it is not (yet).
        """
        if abs(speed) >= STANDING or self._waits(s, traffic, stop_lines, stats):
            self._since = None
            self._still.clear()
            return None
        since = self._since = traffic.time if self._since is None else self._since
        self._watch(traffic)
        if traffic.time - since < self._patience - 1e-9:
            return None
        cause = stats.blocker or stats.reason
        if not cause or not self._stands_as_long(traffic, stats.blocker):
            return None
        why = stats.reason or f"{cause} is in the way"
        return f"stood {traffic.time - since:.0f} s at s = {s:.1f} m: {why}"

    def _waits(
        self,
        s: float,
        traffic: TrafficState,
        stop_lines: tuple[float, ...],
        stats: PlanStats,
    ) -> bool:
        """Check whether the ego stands because of a closed stop line."""
        if not stop_lines:
            return False
        at_line = min(stop_lines) - s - self._front_reach <= WAITING_ROOM
        return at_line or stats.blocker in traffic.vehicles.ids

    def _watch(self, traffic: TrafficState) -> None:
        """Record since when each vehicle stands."""
        users = traffic.vehicles
        for name, speed in zip(users.ids, users.speed.tolist(), strict=True):
            if speed < STANDING:
                self._still.setdefault(name, traffic.time)
            else:
                self._still.pop(name, None)

    def _stands_as_long(self, traffic: TrafficState, blocker: str | None) -> bool:
        """Check that the blocker is static or has stood for as long as the ego."""
        if blocker not in traffic.vehicles.ids:
            return True  # a static body, or no body at all
        since = self._still.get(blocker or "", traffic.time)
        return traffic.time - since >= self._patience - 1e-9
