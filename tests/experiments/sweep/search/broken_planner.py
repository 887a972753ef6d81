"""A lane keeper with a defect planted in it, for searches to find.

It keeps its lane and brakes for what is in its way so that it stops behind it, with 6
m/s² at most: simple enough that without a defect it fails nowhere in the spaces of the
tests.
"""

from dataclasses import dataclass

import numpy as np

from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.states import Trajectory

POINTS = 11
HARDEST, WEAK = 6.0, 1.0  # braking [m/s²]
MARGIN = 4.0  # bumper to bumper, at which it wants to stop [m]


@dataclass(frozen=True, slots=True)
class Thresholds:
    """From where on a defect shows."""

    long: float = 15.0  # length from which a vehicle is a lorry [m]
    left: float = 1.5  # offset from which an obstacle is left [m]
    fast: float = 26.0  # [m/s]
    window: tuple[float, float] = (14.0, 42.0)  # gaps at which it sees nothing [m]
    late: float = 2.4  # [s]


USUAL = Thresholds()
RARE = Thresholds(long=15.7, left=1.65, fast=27.2, window=(16.0, 34.0), late=1.2)


@dataclass(frozen=True, slots=True)
class Broken:
    """Drives along the path; `defect` says what is wrong."""

    defect: str = "none"
    at: Thresholds = USUAL

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        asked = list(memory) if isinstance(memory, tuple) else []
        asked.append(self._braking(scene))
        late = self.defect == "late" and scene.ego.speed > self.at.fast
        delay = round(self.at.late / scene.step) if late else 0
        braking = asked[max(len(asked) - 1 - delay, 0)] if len(asked) > delay else 0.0
        if self.defect == "weak" and scene.ego.speed > self.at.fast:
            braking = min(braking, WEAK)
        trajectory = straight_on(scene, braking)
        stats = PlanStats(candidates=1, survivors=1, costs={"jerk_integral": 0.0})
        return PlanResult(PlanStatus.OK, trajectory, tuple(asked[-40:]), stats)

    def _braking(self, scene: Scene) -> float:
        """Return the braking that stops, or follows, behind what is in the way."""
        speed = scene.ego.speed
        most = 0.0
        for gap, other in self._in_the_way(scene):
            closing = speed**2 - other**2
            if other >= speed or gap > 0.5 * closing / HARDEST * 1.6 + 2.0 * MARGIN:
                continue
            most = max(most, closing / (2.0 * max(gap - MARGIN, 0.1)))
        return min(most, HARDEST)

    def _in_the_way(self, scene: Scene):
        """Yield gap [m] and speed [m/s] of what the lane keeper would touch."""
        front = scene.ego_frenet.s + scene.vehicle.front_reach
        l, half = scene.ego_frenet.l, 0.5 * scene.vehicle.width + 0.3
        users = scene.vehicles
        places = zip(*scene.path.project(users.x, users.y), strict=True)
        for k, (s, at) in enumerate(places):
            gap = s - 0.5 * users.length[k] - front
            if abs(at - l) < half + 0.5 * users.width[k] and gap > -users.length[k]:
                if self.defect == "lorries" and users.length[k] > self.at.long:
                    continue
                near, far = self.at.window
                if self.defect == "window" and near < gap < far:
                    continue
                yield max(gap, 0.0), users.speed[k]
        bodies = scene.obstacles
        places = zip(*scene.path.project(bodies.x, bodies.y), strict=True)
        for k, (s, at) in enumerate(places):
            gap = s - bodies.radius[k] - front
            if abs(at - l) < half + bodies.radius[k] and gap > 0.0:
                if self.defect == "left" and at > self.at.left:
                    continue
                yield gap, 0.0


def straight_on(scene: Scene, braking: float) -> Trajectory:
    """Return the way along the path at a constant offset."""
    t = scene.step * np.arange(POINTS)
    start, l = scene.ego.speed, scene.ego_frenet.l
    stop = start / braking if braking > 0.0 else np.inf
    moving = np.minimum(t, stop)
    s = scene.ego_frenet.s + start * moving - 0.5 * braking * moving**2
    at = scene.path.at(s)
    return Trajectory(
        t=t,
        x=at.x - l * at.sin_heading,
        y=at.y + l * at.cos_heading,
        heading=at.heading,
        curvature=at.curvature,
        speed=np.maximum(start - braking * t, 0.0),
        acceleration=np.where(t < stop, -braking, 0.0),
        s=s,
        l=np.full(POINTS, l),
    )


def make(defect: str = "none", *, rare: bool = False) -> Broken:
    return Broken(defect, RARE if rare else USUAL)
