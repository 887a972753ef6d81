"""Any planner, and a way out where it stands before what never moves."""

from dataclasses import dataclass, replace

import numpy as np

from planner.bodies import Bodies, bodies_of
from planner.contact_check import contacts_of
from planner.interface import Planner, PlanResult, PlanStatus
from planner.scene import Scene
from planner.states import Trajectory
from planner.vehicle import body_scale
from planner.way_out.way import Way, drive_along, way_from

STANDING = 0.1  # [m/s]
SLOW = 0.6  # so does one who creeps up to an obstacle, until there is no room [m/s]
STOOD = 2.0  # after so much standing a way out is looked for [s]
AGAIN = 4.0  # and so long after the last look [s]
DRIVES_ON = 4.0  # a plan that drives farther gets on by itself [m],
BELIEVED = 0.3  # of the time that the ego stands with such plans counts [-]
BESIDE = 0.3  # what is this near the ego's corridor is in it [m]
AHEAD = 25.0  # of the front, where an obstacle may be in the way [m]
REACH = 14.0  # of a way for a car, longer for a long body [m]
FREE = 8.0  # before the front at its end, the same [m]
PASSED = 3.0  # behind the rear, an obstacle is passed [m]
FARTHEST = 70.0  # that a way leads [m]
SPEED = 2.0  # on a way [m/s]
PACE = 0.8  # acceleration on it [m/s²]
GAP = 0.05  # kept to all on a way [m]
LONGEST = 5.0  # of its trajectories [s]


@dataclass(frozen=True, slots=True, eq=False)
class WayOutMemory:
    """What the planner remembers, and the way out that is driven."""

    inner: object
    way: Way | None = None
    stood: float = 0.0  # [s]


@dataclass(frozen=True, slots=True, eq=False)
class WayOutPlanner:
    """Let a planner drive; find the ego a way where it stands for good."""

    planner: Planner

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        last = memory if isinstance(memory, WayOutMemory) else WayOutMemory(memory)
        if last.way is not None:
            on_way = _go_on(scene, last, last.way)
            if on_way is not None:
                return on_way
        result = self.planner.plan(scene, last.inner)
        stood = _stood(scene, result, last)
        if stood >= STOOD:
            stood -= AGAIN
            for reach in reaches(scene):
                found = way_from(scene, reach)
                if found is None:
                    continue
                begun = WayOutMemory(result.memory, found)
                on_way = _go_on(scene, begun, found)
                if on_way is not None:
                    return on_way
        kept = WayOutMemory(result.memory, None, stood)
        return replace(result, memory=kept)


def _stood(scene: Scene, result: PlanResult, last: WayOutMemory) -> float:
    """Return for how long the ego has stood before what never moves [s]."""
    way = result.trajectory
    if way is None or scene.ego.speed >= SLOW:
        return 0.0
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    if not obstacle_within(scene, front + AHEAD):
        return 0.0
    # a plan that would get on, and a queue, are believed for a while
    waits = result.status is PlanStatus.OK and way.s[-1] - way.s[0] > DRIVES_ON
    waits = waits or queues(scene, front + AHEAD)
    return last.stood + scene.step * (BELIEVED if waits else 1.0)


def queues(scene: Scene, reach: float) -> bool:
    """Check whether what is next ahead in the ego's corridor is a vehicle.

    Args:
        scene: Of this cycle.
        reach: Up to where [m].
    """
    fixed, users, ego = scene.obstacles, scene.vehicles, scene.ego_frenet
    ahead, half = users.prediction, 0.5 * scene.vehicle.width + BESIDE
    s, l = scene.path.project(fixed.x, fixed.y)
    size = np.hypot(0.5 * fixed.length, 0.5 * fixed.width) + fixed.radius
    standing = s[(s > ego.s) & (np.abs(l - ego.l) < half + size)]
    s, l = ahead.s[:, 0], ahead.l[:, 0]
    others = s[(s > ego.s) & (np.abs(l - ego.l) < half + 0.5 * users.width)]
    nearest = others.min(initial=np.inf)
    return bool(nearest < reach and nearest < standing.min(initial=np.inf))


def reaches(scene: Scene) -> tuple[float, ...]:
    """Return how far a way may lead [m], the best first.

    Best it does not end close before the next obstacle; else it is past the first.

    Args:
        scene: Of this cycle.
    """
    vehicle, begin = scene.vehicle, scene.ego_frenet.s
    scale = max(body_scale(vehicle), 1.0)
    s, _ = scene.path.project(scene.obstacles.x, scene.obstacles.y)
    ends = np.sort(s[s > begin]) - begin + vehicle.rear_overhang + PASSED
    reach = REACH * scale
    for end in ends.tolist():
        if reach < end < reach + vehicle.length + FREE * scale:
            reach = end
    return tuple(x for x in (min(reach, FARTHEST), *ends[:1].tolist()) if x > 0.0)


def obstacle_within(scene: Scene, reach: float) -> bool:
    """Check for an obstacle before the ego, nearer than any closed line.

    Args:
        scene: Of this cycle.
        reach: Up to where [m].
    """
    fixed = scene.obstacles
    if not fixed.ids:
        return False
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    s, _ = scene.path.project(fixed.x, fixed.y)
    lines = [line for line in scene.stop_lines if line > front]
    until = min([reach, *lines])
    return bool(np.any((s > scene.ego_frenet.s) & (s < until)))


def _go_on(scene: Scene, last: WayOutMemory, way: Way) -> PlanResult | None:
    """Drive on along a way out; None where it is over, left or blocked for good."""
    along = way.along(scene.ego)
    if along is None or (way.length - along < 0.3 and scene.ego.speed < STANDING):
        return None
    ahead = scene.vehicles.prediction
    horizon = min(LONGEST, ahead.step * max(ahead.x.shape[1] - 1, 10))
    bodies = bodies_of(scene, max(ahead.x.shape[1], 2), ahead.step)
    going = drive_along(scene, way, along, (SPEED, PACE), horizon)
    blocker = _touched(scene, going, bodies)
    stood = 0.0
    if blocker is not None:
        stood = last.stood + scene.step
        hard = 0.5 * scene.vehicle.limits.max_deceleration
        touches: str | None = blocker
        for pace in (PACE, hard):
            if touches is not None:
                going = drive_along(scene, way, along, (0.0, pace), horizon)
                touches = _touched(scene, going, bodies)
        # one that moves stops on its way whatever comes: beside it there is no room
        stands = scene.ego.speed < STANDING
        if stands and (touches is not None or stood > STOOD):
            return None
    stats_now = "way out: past what stands, at walking speed"
    memory = WayOutMemory(last.inner, way, stood)
    result = PlanResult(PlanStatus.OK, going, memory)
    stats = replace(
        result.stats, candidates=1, survivors=1, blocker=blocker, explanation=stats_now
    )
    return replace(result, stats=stats)


def _touched(scene: Scene, going: Trajectory, bodies: Bodies) -> str | None:
    """Return what a trajectory touches, closed lines included."""
    front = going.s[-1] + scene.vehicle.front_reach
    now = scene.ego_frenet.s + scene.vehicle.front_reach
    if any(now <= line < front for line in scene.stop_lines):
        return "stop line"
    hits = contacts_of(going, scene.vehicle, bodies, bodies.table.follower, GAP)
    return hits[0].id if hits else None
