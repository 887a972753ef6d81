"""The lane-change planner: keep, seek a gap, change, and turn back while one can."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from planner.fallback import fallback
from planner.geometry.clearance import gaps_to
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.lane_change.lane_choice import (
    BodiesAhead,
    bodies_on_road,
    lane_at,
    lane_worths,
    wanted_lane,
)
from planner.lane_change.manoeuvre import (
    COMMIT_MARGIN,
    Change,
    Memory,
    Phase,
    about_to_enter,
    lane_line,
    progress_on,
    reaches_over,
    rest_of,
    settled,
)
from planner.lane_change.path import (
    ChangePath,
    best_change,
    lane_keeping_path,
)
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed import SpeedPlan, SpeedTask, plan_speed, soft_speed
from planner.lane_change.surroundings import behind_ego, in_lane, road_users
from planner.motion.path_speed import trajectory_on
from planner.scene import Scene, Vehicles
from planner.states import BoolArray, FloatArray, Path, Trajectory
from planner.validity import invalid

BESIDE_THE_WAY = 60.0  # added to the path that the fastest drive needs [m]
STANDSTILL_ROOM = 0.05  # a program needs some room, also to stand still [m]
HARD_GAP = 0.05  # least distance to a body that a fallback may leave [m]


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """What one cycle sees, worked out once."""

    scene: Scene
    users: Vehicles
    bodies: BodiesAhead
    behind: BoolArray  # wholly behind the ego
    worths: FloatArray  # of the lanes [m/s]
    lasting: FloatArray  # of the lanes, were there only what never moves [m/s]
    total: float  # length of paths [m]


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """One way to go on and its speed plan."""

    phase: Phase
    lane: int
    path: Path
    speed: SpeedPlan
    change: Change | None = None
    start_s: float | None = None
    status: PlanStatus = PlanStatus.OK
    why: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LaneChangePlanner:
    """Plans path and speed of keeping and changing lanes; `plan` is pure."""

    settings: LaneChangeSettings

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if (
            reason is None
            and lane_at(scene.lanes, scene.ego_frenet.s, scene.ego_frenet.l) < 0
        ):
            reason = "the road has no marked lanes"
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = memory if isinstance(memory, Memory) else None
        situation = _look(scene, self.settings)
        tally = Tally()
        attempt = _decide(situation, last, self.settings, tally)
        if attempt is None:
            return _fall_back(situation, last, self.settings, tally)
        return _result(attempt, last, tally)


@dataclass(slots=True)
class Tally:
    """What was tried in a cycle."""

    candidates: int = 0
    survivors: int = 0
    removed: dict[str, int] = field(default_factory=dict)

    def paths(self, refused: Mapping[str, int]) -> None:
        """Count the paths that were refused."""
        for reason, number in refused.items():
            self.removed[reason] = self.removed.get(reason, 0) + number

    def speeds(self, plan: SpeedPlan) -> None:
        """Count the orders of one speed plan."""
        self.candidates += max(len(plan.alternatives), 1)
        solved = sum(math.isfinite(a.cost) for a in plan.alternatives)
        self.survivors += solved
        lost = max(len(plan.alternatives), 1) - solved
        if lost:
            self.removed["speed"] = self.removed.get("speed", 0) + lost


def _look(scene: Scene, settings: LaneChangeSettings) -> Situation:
    """Work out what every branch needs."""
    bodies = bodies_on_road(scene)
    fastest = max(scene.target_speed, scene.ego.speed)
    return Situation(
        scene,
        road_users(scene),
        bodies,
        behind_ego(scene, bodies),
        lane_worths(scene, bodies, settings.speed.front_gap),
        lane_worths(scene, bodies.static(), settings.speed.front_gap),
        fastest * settings.speed.duration + BESIDE_THE_WAY,
    )


def _decide(
    here: Situation, last: Memory | None, settings: LaneChangeSettings, tally: Tally
) -> Attempt | None:
    """Go through the phases; None if nothing can be planned."""
    scene = here.scene
    if last is not None and last.change is not None:
        attempt = _go_on(here, last, last.change, settings, tally)
        if attempt is not None:
            return attempt
        if last.phase is Phase.COMMITTED:
            return None
    ego = scene.ego_frenet
    lane = last.lane if last is not None else lane_at(scene.lanes, ego.s, ego.l)
    if not np.isfinite(here.worths[min(lane, here.worths.size - 1)]):
        lane = lane_at(scene.lanes, ego.s, ego.l)
    seeking = last is not None and last.phase is not Phase.KEEP
    gain = 0.3 * settings.manoeuvre.gain if seeking else settings.manoeuvre.gain
    target = wanted_lane(here.lasting, lane, gain)  # queues dissolve, walls do not
    if target is None:
        target = wanted_lane(here.worths, lane, gain)
        if target is not None and here.lasting[target] + gain < here.lasting[lane]:
            target = None
    if target is not None:
        found = _seek(here, last, lane, target, settings, tally)
        if found is not None:
            return found
    return _keep(here, lane, target, settings, tally)


def _task(here: Situation, end: float = math.inf) -> SpeedTask:
    """Say what a speed plan is for; closed stop lines end every path."""
    scene = here.scene
    ego = scene.ego_frenet
    lines = [line for line in scene.stop_lines if line > ego.s]
    if lines:
        end = min(end, min(lines) - ego.s - scene.vehicle.front_reach)
    return SpeedTask(
        scene.ego.speed, scene.ego.acceleration, scene.target_speed, max(end, 0.0)
    )


def _room_before(here: Situation, lane: int, room: float) -> tuple[float, float]:
    """How far the ego may go in a lane that something standing blocks.

    It waits where it can still pull out, or as near to that as it can stop.

    Returns:
        (to the place to wait, to the blockage) [m]; inf if there is none.
    """
    scene, bodies = here.scene, here.bodies
    ego, lanes = scene.ego_frenet, scene.lanes
    centre = np.interp(bodies.s, lanes.s, lanes.centre[lane])
    reach = bodies.half_width + 0.5 * scene.vehicle.width
    front = ego.s + scene.vehicle.front_reach
    blocks = (
        (np.abs(bodies.l - centre) < reach)
        & (np.arange(bodies.s.size) < bodies.n_static)
        & (bodies.s > ego.s)
    )
    if not blocks.any():
        return math.inf, math.inf
    wall = float((bodies.s - bodies.half_length)[blocks].min()) - front
    stop = 0.5 * scene.ego.speed + scene.ego.speed**2 / (
        1.4 * scene.vehicle.limits.max_deceleration
    )
    place = max(wall - room, stop + STANDSTILL_ROOM)
    return (place if place < wall else math.inf), wall


def _keep(
    here: Situation,
    lane: int,
    target: int | None,
    settings: LaneChangeSettings,
    tally: Tally,
) -> Attempt | None:
    """Stay in the lane behind whoever is ahead."""
    scene = here.scene
    centre = float(
        np.interp(scene.ego_frenet.s, scene.lanes.s, scene.lanes.centre[lane])
    )
    path = lane_keeping_path(
        scene.path, scene.ego_frenet, centre, here.total, settings.path
    )
    if path is None:
        return None
    phase = Phase.KEEP if target is None else Phase.SEEK
    why = "" if target is None else "no gap yet"
    wait, wall = _room_before(here, lane, settings.manoeuvre.pull_out_room)
    rooms = [math.inf]
    if math.isfinite(wait):
        rooms = [wait, 0.5 * (wait + wall), math.inf]
    considered = ~here.behind
    for room in rooms:
        task = _task(here, room)
        speed = plan_speed(
            path, scene.vehicle, here.users, considered, task, settings.speed
        )
        tally.speeds(speed)
        if speed.profile is not None:
            return Attempt(phase, lane, path, speed, why=why)
    return _soften(here, Attempt(phase, lane, path, speed, why=why), settings)


def _soften(
    here: Situation, attempt: Attempt, settings: LaneChangeSettings
) -> Attempt | None:
    """Plan with bounds that may be exceeded; None if even that does not work."""
    speed = soft_speed(
        attempt.path,
        here.scene.vehicle,
        attempt.speed.graph,
        _task(here),
        settings.speed,
    )
    if speed.profile is None or speed.slack > settings.speed.along_margin:
        return None
    return replace(attempt, speed=speed, why=f"bounds exceeded by {speed.slack:.2f} m")


def _seek(
    here: Situation,
    last: Memory | None,
    lane: int,
    target: int,
    settings: LaneChangeSettings,
    tally: Tally,
) -> Attempt | None:
    """Look for the cheapest change, now or farther on."""
    scene = here.scene
    ego = scene.ego_frenet
    centre = float(np.interp(ego.s, scene.lanes.s, scene.lanes.centre[target]))
    best: tuple[float, float, ChangePath, SpeedPlan] | None = None
    followers = in_lane(scene, here.bodies, here.users, lane) & here.behind
    for start in _starts(ego.s, last, settings):
        change, refused = best_change(
            scene.path, ego, centre, start, here.total, scene.vehicle, settings.path
        )
        tally.paths(refused)
        if change is None:
            continue
        speed = plan_speed(
            change.path,
            scene.vehicle,
            here.users,
            ~followers,
            _task(here),
            settings.speed,
        )
        tally.speeds(speed)
        if _runs_into_blockage(here, change, speed):
            tally.removed["blockage"] = tally.removed.get("blockage", 0) + 1
            continue
        cost = speed.cost + change.cost + settings.manoeuvre.start_weight * start
        if speed.profile is not None and (best is None or cost < best[0]):
            best = cost, start, change, speed
    if best is None:
        return None
    _, start, change, speed = best
    if start > 0.0:
        return Attempt(
            Phase.SEEK,
            lane,
            change.path,
            speed,
            start_s=ego.s + start,
            why=f"gap behind {speed.ahead}, ahead of {speed.behind}",
        )
    begun = Change(lane, target, change.path, change.end, speed.order)
    return Attempt(
        Phase.CHANGE,
        lane,
        change.path,
        speed,
        begun,
        why=f"gap behind {speed.ahead}, ahead of {speed.behind}",
    )


def _runs_into_blockage(here: Situation, change: ChangePath, speed: SpeedPlan) -> bool:
    """Tell whether something that stands is on the path before the change is over."""
    graph = speed.graph
    n_static = len(here.scene.obstacles.ids)
    return any(
        index < n_static and float(graph.lower[k, 0]) < change.end
        for k, index in enumerate(graph.index)
    )


def _starts(
    s: float, last: Memory | None, settings: LaneChangeSettings
) -> tuple[float, ...]:
    """Where a change may begin: now, where it was to begin, and one more place.

    The further places take turns, so that a cycle stays short and none is forgotten.
    """
    grid = settings.manoeuvre.starts
    if last is None or last.phase is Phase.KEEP:
        return grid
    turn = grid[1 + last.cycle % max(len(grid) - 1, 1)] if len(grid) > 1 else grid[0]
    kept = () if last.start_s is None else (max(last.start_s - s, 0.0),)
    return tuple(sorted({0.0, *(k for k in kept if k > 1.0), turn}))


def _go_on(
    here: Situation,
    last: Memory,
    change: Change,
    settings: LaneChangeSettings,
    tally: Tally,
) -> Attempt | None:
    """Continue a change; None if it is over, or has to be given up."""
    scene = here.scene
    place = progress_on(change.path, scene)
    rest = rest_of(change.path, place) if place is not None else None
    if place is None or rest is None:
        return None
    if place >= change.end - 1e-6 and settled(scene, change.target):
        return _keep(here, change.target, None, settings, tally)
    path = _extended(here, rest, settings)
    committed = last.phase is Phase.COMMITTED
    followers = here.behind & in_lane(scene, here.bodies, here.users, change.lane)
    speed = plan_speed(
        path, scene.vehicle, here.users, ~followers, _task(here), settings.speed
    )
    tally.speeds(speed)
    entering = about_to_enter(scene, change.lane, change.target, scene.step)
    if not committed and entering:
        if speed.profile is None or not _gap_is_safe(here, change.target, settings):
            waiting = Attempt(Phase.CHANGE, change.lane, path, speed, change)
            return _wait_at_line(here, waiting, followers, settings, tally)
        committed = True
    phase = Phase.COMMITTED if committed else Phase.CHANGE
    going = replace(change, order=speed.order)
    attempt = Attempt(phase, change.lane, path, speed, going)
    if speed.profile is not None:
        return attempt
    if not committed:
        return _wait_at_line(here, attempt, followers, settings, tally)
    speed = plan_speed(
        path, scene.vehicle, here.users, ~here.behind, _task(here), settings.speed
    )
    tally.speeds(speed)
    if speed.profile is not None:
        return replace(attempt, speed=speed, why="those behind have to react")
    return _soften(here, replace(attempt, speed=speed), settings)


def _wait_at_line(
    here: Situation,
    attempt: Attempt,
    followers: BoolArray,
    settings: LaneChangeSettings,
    tally: Tally,
) -> Attempt | None:
    """Stop on the way over, before the body enters the target lane.

    Only where turning back would lead into a blockage; None says to turn back.
    """
    scene, change = here.scene, attempt.change
    room = settings.manoeuvre.pull_out_room
    _, wall = _room_before(here, attempt.lane, room)
    if change is None or wall > 2.0 * room:
        return None
    line = lane_line(scene, change.lane, change.target)
    side = 1 if change.target > change.lane else -1
    path = attempt.path
    slope = np.gradient(path.l, path.s)
    over = [
        reaches_over(scene.vehicle, float(l), float(rise), line, side)
        for l, rise in zip(path.l, slope, strict=True)
    ]
    entered = np.flatnonzero(np.array(over) > -COMMIT_MARGIN)
    end = float(path.distance[max(int(entered[0]) - 1, 0)]) if entered.size else 0.0
    task = _task(here, max(end, STANDSTILL_ROOM))
    speed = plan_speed(
        path, scene.vehicle, here.users, ~followers, task, settings.speed
    )
    tally.speeds(speed)
    if speed.profile is None:
        return None
    return replace(attempt, phase=Phase.CHANGE, speed=speed, why="waits at the line")


def _extended(here: Situation, rest: Path, settings: LaneChangeSettings) -> Path:
    """Lengthen what is left of a change where it has become too short to plan on."""
    scene = here.scene
    need = max(scene.target_speed, scene.ego.speed) * settings.speed.duration
    if rest.distance[-1] >= need:
        return rest
    centre = float(rest.l[-1])
    end = replace(
        scene.ego_frenet, s=float(rest.s[-1]), l=centre, l_prime=0.0, l_second=0.0
    )
    tail = lane_keeping_path(scene.path, end, centre, here.total, settings.path)
    if tail is None:
        return rest
    joined = (
        np.concatenate([getattr(rest, name), getattr(tail, name)[1:]])
        for name in ("x", "y", "heading", "curvature", "s", "l")
    )
    distance = np.concatenate([rest.distance, rest.distance[-1] + tail.distance[1:]])
    return Path(distance, *joined)


def _gap_is_safe(here: Situation, target: int, settings: LaneChangeSettings) -> bool:
    """Check the gap in the target lane by RSS before the body enters it.

    The driver behind reacts after `reaction` and brakes with `rear_braking`; the ego
    promises to brake no harder than its service braking. To whoever is ahead the ego
    itself keeps a distance from which it can stop, its reaction being one step.
    """
    scene, bodies = here.scene, here.bodies
    ego, vehicle = scene.ego_frenet, scene.vehicle
    there = in_lane(scene, bodies, here.users, target)
    limits, speed = vehicle.limits, scene.ego.speed
    rear_gap = ego.s - vehicle.rear_overhang - (bodies.s + bodies.half_length)
    behind = there & (bodies.s < ego.s)
    need = rss_distance(
        np.maximum(bodies.speed, 0.0),
        np.full(bodies.speed.shape, speed),
        settings.manoeuvre.reaction,
        settings.manoeuvre.rear_braking,
        limits.max_deceleration,
    )
    if np.any(rear_gap[behind] < need[behind]):
        return False
    front_gap = bodies.s - bodies.half_length - (ego.s + vehicle.front_reach)
    ahead = there & (bodies.s >= ego.s)
    need = rss_distance(
        np.full(bodies.speed.shape, speed),
        np.maximum(bodies.speed, 0.0),
        scene.step,
        limits.emergency_deceleration,
        limits.emergency_deceleration,
    )
    return not np.any(front_gap[ahead] < need[ahead])


def rss_distance(
    rear: FloatArray,
    front: FloatArray,
    reaction: float,
    rear_braking: float,
    front_braking: float,
) -> FloatArray:
    """Distance that a follower needs (Shalev-Shwartz et al. 2017, longitudinal) [m].

    The follower keeps its speed for `reaction`, then both brake to a stand.
    """
    need = rear * reaction + rear**2 / (2.0 * rear_braking)
    return np.asarray(np.maximum(need - front**2 / (2.0 * front_braking), 0.0))


def _result(attempt: Attempt, last: Memory | None, tally: Tally) -> PlanResult:
    """Turn an attempt into what the caller gets."""
    profile = attempt.speed.profile
    assert profile is not None  # noqa: S101 - attempts without one are never returned
    trajectory = trajectory_on(attempt.path, profile)
    lane = attempt.lane
    memory = Memory(
        attempt.phase,
        lane,
        trajectory,
        attempt.change,
        attempt.start_s,
        0 if last is None else last.cycle + 1,
    )
    stats = PlanStats(
        candidates=tally.candidates,
        survivors=max(tally.survivors, 1),
        removed=tally.removed,
        costs={"speed": attempt.speed.cost},
        blocker=attempt.speed.ahead,
        explanation=f"{attempt.phase}: {attempt.why}" if attempt.why else attempt.phase,
    )
    return PlanResult(attempt.status, trajectory, memory, stats)


def _fall_back(
    here: Situation, last: Memory | None, settings: LaneChangeSettings, tally: Tally
) -> PlanResult:
    """Nothing can be planned: go down the ladder and say why."""
    scene, users = here.scene, here.users
    extents = np.column_stack(
        [0.5 * users.length, 0.5 * users.width, np.zeros(len(users.ids))]
    )
    ahead = users.prediction
    poses = np.stack(
        [ahead.x, ahead.y, np.cos(ahead.heading), np.sin(ahead.heading)], axis=1
    )

    def blocker(trajectory: Trajectory) -> str | None:
        n = min(poses.shape[2], trajectory.t.size)
        points = np.array(
            [
                trajectory.x,
                trajectory.y,
                np.cos(trajectory.heading),
                np.sin(trajectory.heading),
            ]
        )[:, :n]
        vehicle = scene.vehicle
        gaps = gaps_to(
            points,
            poses[:, :, :n],
            extents,
            np.array(vehicle.disc_offsets),
            vehicle.disc_radius,
        )
        hits = np.flatnonzero((gaps < HARD_GAP) & ~here.behind)
        return users.ids[int(hits[np.argmin(gaps[hits])])] if hits.size else None

    driven = None if last is None else last.trajectory
    status, trajectory = fallback(scene, driven, blocker, settings.speed.duration)
    ego = scene.ego_frenet
    lane = lane_at(scene.lanes, ego.s, ego.l)
    phase, change = Phase.KEEP, None
    if last is not None and last.phase is Phase.COMMITTED:
        phase, change, lane = last.phase, last.change, last.lane
    memory = Memory(
        phase, lane, trajectory, change, None, 0 if last is None else last.cycle + 1
    )
    stats = PlanStats(
        reason=f"no speed plan on any path ({tally.candidates} tried)",
        candidates=tally.candidates,
        removed=tally.removed,
        blocker=blocker(trajectory),
    )
    return PlanResult(status, trajectory, memory, stats)
