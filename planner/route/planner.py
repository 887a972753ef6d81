"""The route planner: follow a lane, change it for the route or the speed, go round."""

from dataclasses import dataclass, field, replace

import numpy as np

from planner.cruise import CruisePlanner
from planner.cruise.planner import CruiseMemory
from planner.dense import proposed as dense_proposed
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.lane_change.lane_choice import bodies_on_road, lane_at
from planner.lane_change.phases.memory import (
    Phase,
    about_to_enter,
)
from planner.route.changes import (
    OVER_ROOM,
    STANDING,
    Look,
    ahead_in,
    goes_over,
    has_room,
    is_late,
    is_over,
    kept,
    lane_end,
    name_of,
)
from planner.route.gaps import gap_beside, grows_calm, seeking_speed
from planner.route.lane_corridor import LaneCorridor, corridor
from planner.route.lane_frame import (
    LaneFrame,
    coincides,
    in_frame,
    lane_frame,
    narrows_bends,
    reference_frame,
    seen_from,
    without_inner_sides,
)
from planner.route.lane_need import (
    lane_ends,
    lanes_to_follow,
    wish,
)
from planner.route.memory import Driver, LaneManoeuvre, RouteMemory
from planner.route.open_road import obstacle_ahead, opens_at
from planner.route.outcome import keeping_open, told
from planner.route.settings import RouteSettings
from planner.route.standing import (
    gets_on,
    gets_on_faster,
    has_no_way,
    is_caught,
    is_caught_in_bend,
    is_held,
    is_slowed,
    is_stuck,
)
from planner.scene import Scene
from planner.scene_checks import invalid

MOST_FRAMES = 6  # kept
ROUND = 40.0  # for which the road stays open round what stands [m]
CRAWLING = 1.0  # slower, the dense family does not get on either [m/s]
CRAWLED = 4.0  # after so much of it cruising is tried again [s]
# From what stands beside the way of an ego that is caught; the discs that cover the
# ego reach over its sides, so that about 0.3 m remain [m] ...
CLOSE = 0.0
CLOSE_TO_EDGE = 0.03  # and from the road's edge [m] ...
OVER_EDGE = 0.25  # over which it may reach where nothing else moves it off [m]
CLOSE_WAY = 15.0  # for so long [m] ...
CLOSE_SPEED = 2.0  # at this speed [m/s]
OVER_TIME = 3.5  # after so much way a change has left its lane [s]


@dataclass(frozen=True, slots=True, eq=False)
class RoutePlanner:
    """Choose a lane, then drive along it; `plan` is pure."""

    settings: RouteSettings
    _cruise: CruisePlanner = field(init=False, repr=False)
    _close: CruisePlanner = field(init=False, repr=False)  # past what leaves no margin

    def __post_init__(self) -> None:
        """Make the families."""
        cruise = self.settings.cruise
        margins = min(cruise.margin, CLOSE), min(cruise.road_margin, CLOSE_TO_EDGE)
        close = replace(
            cruise,
            margin=margins[0],
            road_margin=margins[1],
            starting_excess=OVER_EDGE,
        )
        object.__setattr__(self, "_cruise", CruisePlanner(cruise))
        object.__setattr__(self, "_close", CruisePlanner(close))

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = _after_a_crawl(memory) if isinstance(memory, RouteMemory) else None
        given = scene.lanes
        if last is not None and last.given is given and last.followed is not None:
            scene = replace(scene, lanes=last.followed)
        else:
            scene = replace(scene, lanes=lanes_to_follow(scene))
        look = self._look(scene, last)
        result = self._chosen(look, last)
        if isinstance(result.memory, RouteMemory):
            memory_now = replace(result.memory, given=given, followed=scene.lanes)
            return replace(result, memory=memory_now)
        return result

    def _chosen(self, look: Look, last: RouteMemory | None) -> PlanResult:
        """Let the family drive whose situation this is."""
        scene = look.scene
        by_dense = self._dense(look, last)
        if by_dense is not None:
            return by_dense
        if lane_at(scene.lanes, scene.ego_frenet.s, scene.ego_frenet.l) < 0:
            return self._without_lanes(look, last)
        manoeuvre, speed = self._decide(look, last)
        return self._drive(look, last, manoeuvre, speed)

    def _look(self, scene: Scene, last: RouteMemory | None) -> Look:
        """Compute what the cycle sees."""
        ego = scene.ego_frenet
        stands = scene.ego.speed < STANDING
        stood = last.stood + scene.step if last is not None and stands else 0.0
        until = 0.0 if last is None else last.round_until
        front = ego.s + scene.vehicle.front_reach
        # what stands before a line or a junction is a queue, not in the way
        waits = [*scene.stop_lines, *(x.stop_s for x in scene.junctions)]
        held = any(front - 1.0 < x < front + self.settings.quiet for x in waits)
        if stood >= self.settings.patience and not held:
            until = ego.s + ROUND
        ends, close = lane_ends(scene.lanes, ego.s), 0.0
        if last is not None:
            close = last.close_until
        return Look(scene, bodies_on_road(scene), ends, stood, until, close)

    # lanes

    def _decide(
        self, look: Look, last: RouteMemory | None
    ) -> tuple[LaneManoeuvre, float]:
        """Decide which lane is followed, and how fast at most [m/s]."""
        scene, ego = look.scene, look.scene.ego_frenet
        now = kept(look, last)
        if now.phase in (Phase.CHANGE, Phase.COMMITTED) and now.target is not None:
            going = self._go_on(look, now, now.target)
            if going is not None:
                return going, scene.target_speed
            now = LaneManoeuvre(lane_at(scene.lanes, ego.s, ego.l))
        wanted = wish(scene, look.bodies, now.lane, look.ends, self.settings)
        if wanted is None:
            return LaneManoeuvre(now.lane), scene.target_speed
        gap = gap_beside(scene, look.bodies, wanted.lane, self.settings.manoeuvre)
        # who stands too near to the end of its lane has no choice but to try
        stuck = wanted.forced and look.stood >= self.settings.stuck_after
        room = float(look.ends[now.lane]) - look.front
        waits = wanted.forced and grows_calm(scene, look.bodies, wanted.lane, room)
        fits = stuck or has_room(look, now.lane, wanted.lane)
        if gap.is_safe and fits and not waits:
            begun = LaneManoeuvre(now.lane, Phase.CHANGE, wanted.lane, wanted.why)
            return begun, scene.target_speed
        speed = scene.target_speed
        if wanted.forced:
            speed = seeking_speed(scene, look.bodies, gap, room)
        beside = name_of(scene, gap.because_of)
        seeks = LaneManoeuvre(now.lane, Phase.SEEK, wanted.lane, wanted.why, beside)
        return seeks, speed

    def _go_on(
        self, look: Look, now: LaneManoeuvre, target: int
    ) -> LaneManoeuvre | None:
        """Continue a change; None where it is given up.

        It binds while the body reaches over the line; one that came back behind the
        line, because the lane beside filled up, needs a gap again.
        """
        scene = look.scene
        if look.ends[target] < scene.ego_frenet.s:
            return None
        if is_over(scene, now.lane, target) or self._goes_on_over(look, target):
            return LaneManoeuvre(target)
        enters = about_to_enter(scene, now.lane, target, scene.step)
        if not (enters and now.phase is Phase.COMMITTED):
            gap = gap_beside(scene, look.bodies, target, self.settings.manoeuvre)
            if not gap.is_safe:
                return None
        return replace(now, phase=Phase.COMMITTED if enters else Phase.CHANGE)

    def _goes_on_over(self, look: Look, target: int) -> bool:
        """Check whether an ego that stands in its new lane has to leave that, too.

        Where both end there is no way left on which the first change could be ended.
        """
        scene, ego = look.scene, look.scene.ego_frenet
        ends = look.ends[target] - look.front < OVER_ROOM
        stands = look.stood >= self.settings.stuck_after
        return bool(ends) and stands and lane_at(scene.lanes, ego.s, ego.l) == target

    # driving

    def _drive(
        self,
        look: Look,
        last: RouteMemory | None,
        manoeuvre: LaneManoeuvre,
        speed: float,
    ) -> PlanResult:
        """Let `cruise` drive along the lane that is followed."""
        changes = manoeuvre.phase in (Phase.CHANGE, Phase.COMMITTED)
        lane = manoeuvre.target if changes else manoeuvre.lane
        assert lane is not None  # noqa: S101 - a change has a target
        result = self._along(look, last, manoeuvre, lane, speed)
        if has_no_way(look, manoeuvre, self.settings) and not gets_on(result):
            # in a sharp turn nothing but the path itself may fit the body
            by_path = self._along(look, last, manoeuvre, lane, speed, by_path=True)
            if gets_on(by_path):
                return by_path
        slow = look.scene.ego.speed < CRAWLING and not is_held(look)
        if slow and not gets_on(result):
            eased = result
            if narrows_bends(_frame_of(look.scene, lane, last)[0]):
                # whoever has stopped at the inner side of a bend has to get out of it
                eased = self._along(look, last, manoeuvre, lane, speed, eased=True)
            if not gets_on(eased) and is_caught_in_bend(
                look, manoeuvre.lane, self.settings
            ):
                # for the rest there is the road
                now = replace(look, round_until=np.inf)
                eased = self._along(now, last, manoeuvre, lane, speed)
                eased = keeping_open(eased, look.round_until)
            result = eased if gets_on(eased) else result
        settings = self.settings
        if look.stood >= settings.patience and not gets_on(result):
            result = self._past_closely(look, last, manoeuvre, lane, speed, result)
        # who has stood, or has no lane left, goes over as far as there is road
        has_to = look.stood >= self.settings.stuck_after or is_late(look, manoeuvre)
        if (
            manoeuvre.phase is Phase.CHANGE
            and not has_to
            and not goes_over(look, result, lane)
        ):
            beside = name_of(look.scene, ahead_in(look, lane))
            back = replace(manoeuvre, phase=Phase.SEEK, beside=beside)
            return self._along(look, last, back, back.lane, speed)
        return result

    def _past_closely(
        self,
        look: Look,
        last: RouteMemory | None,
        manoeuvre: LaneManoeuvre,
        lane: int,
        speed: float,
        otherwise: PlanResult,
    ) -> PlanResult:
        """Creep past what stands beside the way and leaves room, but no margin.

        Two that have stopped beside each other in a junction would wait for ever.
        """
        if not is_caught(look, manoeuvre.lane, self.settings):
            return otherwise
        near = replace(look, close_until=look.scene.ego_frenet.s + CLOSE_WAY)
        result = self._along(near, last, manoeuvre, lane, speed)
        return result if gets_on(result) else otherwise

    def _along(
        self,
        look: Look,
        last: RouteMemory | None,
        manoeuvre: LaneManoeuvre,
        lane: int,
        speed: float,
        *,
        by_path: bool = False,
        eased: bool = False,
    ) -> PlanResult:
        """Plan along one lane, or `by_path` along the scene's own path.

        With `eased` the inner side of bends is open.
        """
        scene = look.scene
        frame, frames = _frame_of(scene, lane, last)
        origin = manoeuvre.lane if lane != manoeuvre.lane else None
        kind = LaneCorridor.LANE if origin is None else LaneCorridor.CHANGE
        if is_late(look, manoeuvre) or scene.ego_frenet.s < look.round_until:
            kind = LaneCorridor.ROAD
        room = self.settings.end_room if origin is None else 0.0
        lines = (*scene.stop_lines, *lane_end(look, lane, room))
        until = look.front + max(OVER_ROOM, OVER_TIME * scene.ego.speed)
        opened = opens_at(scene, look.bodies, frame.lane)
        within = without_inner_sides(frame) if eased else frame
        road = corridor(scene.lanes, within, kind, origin, (until, opened))
        if opened <= look.front:
            kind = LaneCorridor.ROAD
        seen = None
        if not by_path:
            seen = seen_from(scene, frame, road, tuple(sorted(lines)))
        if seen is None:
            frame = reference_frame(scene, lane)
            seen = replace(scene, stop_lines=tuple(sorted(lines)))
        seen = replace(seen, target_speed=min(speed, seen.target_speed))
        before = None
        if last is not None:
            before = CruiseMemory(in_frame(frame, last.trajectory))
        result = self._cruise.plan(seen, before)
        closely = scene.ego_frenet.s < look.close_until
        if closely and gets_on(result):  # it is past what stood there
            look, closely = replace(look, close_until=0.0), False
        if closely:
            slow = min(CLOSE_SPEED, seen.target_speed)
            result = self._close.plan(replace(seen, target_speed=slow), before)
        how = "round what stands" if kind is LaneCorridor.ROAD else ""
        how = "closely past what stands" if closely else how
        how = "along the planned path" if by_path else how
        return told(look, result, manoeuvre, frame, frames, how)

    def _without_lanes(self, look: Look, last: RouteMemory | None) -> PlanResult:
        """Let `cruise` drive where nothing is marked."""
        before = None if last is None else CruiseMemory(last.trajectory)
        result = self._cruise.plan(look.scene, before)
        if result.trajectory is None:
            return result
        memory = RouteMemory(LaneManoeuvre(0), result.trajectory, stood=look.stood)
        return replace(result, memory=memory)

    # the dense family

    def _dense(self, look: Look, last: RouteMemory | None) -> PlanResult | None:
        """Let `dense` drive where obstacles leave cruising no way; None elsewhere.

        It takes no queue for obstacles, and gives way to cruising again where it does
        not get on: it changes no lanes.
        """
        if last is None or not obstacle_ahead(look.scene, look.bodies):
            return None
        dense_drives = last.driver is Driver.DENSE
        step = look.scene.step
        stuck = is_stuck(look, self.settings)
        if not (dense_drives or stuck or is_slowed(look, last.trajectory)):
            return None
        planner = dense_proposed(self.settings.dense)
        result = planner.plan(look.scene, last.dense if dense_drives else None)
        way = result.trajectory
        if result.status is not PlanStatus.OK or way is None:
            return None
        if not dense_drives and not (
            gets_on(result) and (stuck or gets_on_faster(way, last.trajectory, step))
        ):
            return None
        why = "dense: gets on better than cruising between the obstacles"
        scene = look.scene
        crawls = scene.ego.speed < CRAWLING
        memory = replace(
            last,
            trajectory=way,
            driver=Driver.DENSE,
            stood=look.stood,
            crawled=last.crawled + scene.step if crawls else 0.0,
            dense=result.memory,
        )
        stats = replace(result.stats, explanation=why)
        return replace(result, memory=memory, stats=stats)


def _after_a_crawl(last: RouteMemory) -> RouteMemory:
    """Let cruising have a try, from new, after `dense` has not got on."""
    if last.driver is Driver.DENSE and last.crawled >= CRAWLED:
        return replace(last, driver=Driver.CRUISE, stood=0.0, crawled=0.0, dense=None)
    return last


def _frame_of(
    scene: Scene, lane: int, last: RouteMemory | None
) -> tuple[LaneFrame, dict[tuple[int, bool], LaneFrame]]:
    """Return the frame of a lane, and all that are kept."""
    frames = {} if last is None else dict(last.frames)
    frames = {k: x for k, x in frames.items() if x.reference is scene.path}
    along = coincides(scene, lane)
    found = frames.get((lane, along))
    if found is not None and not found.begin - 1.0 <= scene.ego_frenet.s <= found.end:
        found = None
    if found is None:
        made = None if along else lane_frame(scene, lane)
        found = reference_frame(scene, lane) if made is None else made
        while len(frames) >= MOST_FRAMES:
            frames.pop(next(iter(frames)))
        frames[lane, along] = found
    return found, frames
