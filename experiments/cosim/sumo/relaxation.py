"""Relaxation: a driver who is cut in accepts a short gap and opens it over seconds.

SUMO's followers want their own time gap back at once and brake for it, harder than
people do (observed: 10 to 30 s until the usual gap is there again). With relaxation a
follower's wished time gap becomes the one that it was left with, and returns to its own
linearly. What a follower brakes for beyond that is what safety asks for.
"""

from dataclasses import dataclass

from experiments.cosim.sumo.libsumo_api import Libsumo

SHORTEST_GAP = 0.3  # that a driver ever accepts [s]
WALKING = 1.5  # slower followers open no gap [m/s]
REACH = 100.0  # followers farther behind are not looked at [m]


@dataclass(frozen=True, slots=True)
class _Relaxing:
    """A follower whose gap is opening."""

    began: float  # [s]
    accepted: float  # time gap at that moment [s]
    own: float  # that it wishes otherwise [s]


class Relaxation:
    """Adapts the time gap of whoever gets a new leader: the ego or its ghost.

    Args:
        sumo: Running.
        duration: Until the own time gap is wished again [s].
    """

    def __init__(self, sumo: Libsumo, duration: float) -> None:
        self._sumo = sumo
        self._duration = duration
        self._follower: dict[str, str] = {}  # of each leader
        self._relaxing: dict[str, _Relaxing] = {}

    def update(self, time: float, leaders: tuple[str, ...]) -> None:
        """Look who follows now; called before each step.

        Args:
            time: [s].
            leaders: Ids of vehicles that are the ego's: itself and its ghost.
        """
        now = {}
        for leader in leaders:
            follower, gap = self._sumo.vehicle.getFollower(leader, REACH)
            now[leader] = follower
            if not follower or follower in leaders or follower in self._relaxing:
                continue
            if follower != self._follower.get(leader):
                self._begin(time, follower, gap)
        self._follower = now
        self._go_on(time)

    def _begin(self, time: float, follower: str, gap: float) -> None:
        """Let a follower accept its gap [m], which excludes the one at standstill."""
        vehicle = self._sumo.vehicle
        speed, own = vehicle.getSpeed(follower), vehicle.getTau(follower)
        if speed < WALKING:
            return
        accepted = max(gap / speed, SHORTEST_GAP)
        if accepted < own:
            self._relaxing[follower] = _Relaxing(time, accepted, own)

    def _go_on(self, time: float) -> None:
        """Set the present time gap of everybody who relaxes."""
        if not self._relaxing:
            return
        vehicle = self._sumo.vehicle
        present = set(vehicle.getIDList())
        for name, state in list(self._relaxing.items()):
            share = (time - state.began) / self._duration
            if name not in present or share >= 1.0:
                del self._relaxing[name]
                if name in present:
                    vehicle.setTau(name, state.own)
                continue
            wished = state.accepted + share * (state.own - state.accepted)
            vehicle.setTau(name, wished)
