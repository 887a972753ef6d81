"""One ego through an episode: what it sees, whether it has ended, plan, motion.

The same class drives the ego of an episode and each of many in one simulation: it knows
no world. Whoever drives it observes the world, gives it the traffic, and moves it.
"""

import math
from dataclasses import dataclass, field, replace

from experiments.cosim.blockage import WAITING_ROOM, BlockageDetector
from experiments.cosim.collision_monitor import StepCheck
from experiments.cosim.execution import PlanExecution, PlanTiming
from experiments.cosim.perception.perceive import Perception, reckoned
from experiments.cosim.planning import (
    FAILURES_OF_THE_PLANNER,
    PlannedCycle,
    plan_once,
)
from experiments.cosim.plant import PlannerOutputError, Plant
from experiments.cosim.records import (
    Ending,
    EpisodeStatus,
    PlanStart,
    PlanStartKind,
    StepRecord,
    TrafficState,
)
from experiments.cosim.right_of_way import JunctionTraffic, RightOfWay, closed_lines
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.scene_builder import Outlook, build_scene
from experiments.cosim.signals import closed_stop_lines
from planner.errors import OutsidePathDomainError
from planner.interface import Planner, PlanStats
from planner.prediction import Predictor, constant_speed
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.scene import OFF_ROAD_TOLERANCE, Scene, Vehicles
from planner.states import CartesianState, FrenetState
from planner.vehicle import Vehicle

TIME_TOLERANCE = 1e-9  # [s]
BACKWARD_ROOM = 1.0  # that an ego may lose along the road, as when rolling back [m]


@dataclass(frozen=True, slots=True)
class EpisodeOptions:
    """When an episode ends, and what its planner foresees."""

    duration: float = 90.0  # [s]
    blocked_after: float = 20.0  # of standing without a way on [s]
    horizon: float = 5.0  # of the predictions [s]
    predictor: Predictor = constant_speed
    full_statistics: bool = True  # of the candidates, see `Scene`
    timing: PlanTiming = field(default_factory=PlanTiming)
    perception: Perception | None = None  # of the episode; None: all is seen as it is
    planned_body: Vehicle | None = None  # that plans keep clear; None: the ego's


def believed(record: StepRecord, lead: float) -> TrafficState:
    """Return the traffic that a plan is made for.

    Args:
        record: Of the present step.
        lead: How much later the plan begins [s].
    """
    traffic, seen = record.traffic, record.seen
    if seen is None and lead == 0.0:
        return traffic
    users = reckoned(traffic.vehicles if seen is None else seen, lead)
    ways = traffic.ways
    if ways is not None:
        ways = ways.renamed(traffic.vehicles.ids, users.ids).later(users.speed * lead)
    future = None if traffic.future is None else traffic.future.later(lead)
    return replace(traffic, vehicles=users, ways=ways, future=future)


class EgoDriver:
    """The state that one ego carries from step to step.

    Args:
        planner: Called once a planning cycle.
        plant: Moves the ego along the trajectory.
        road: Of the ego.
        task: Its goal and body.
        options: Duration, patience and predictions.
        step: Of the loop [s].
        junctions: Who is on the way over the road's junctions, if that is known.
    """

    def __init__(
        self,
        planner: Planner,
        plant: Plant,
        road: Road,
        task: EgoTask,
        options: EpisodeOptions,
        step: float,
        junctions: JunctionTraffic | None,
    ) -> None:
        vehicle = task.vehicle
        self._planner = planner
        self._execution = PlanExecution(plant, road.path, step, options.timing)
        self._task = replace(task, vehicle=options.planned_body or vehicle)
        self._body = vehicle
        self._options = options
        self._road = road
        self._outlook = Outlook(
            self._execution.period,
            options.horizon,
            options.predictor,
            options.full_statistics,
        )
        self._blockage = BlockageDetector(
            options.blocked_after,
            vehicle,
            road.path,
            road.obstacles,
            road.bounds,
        )
        self._right_of_way: RightOfWay | None = None
        if junctions is not None:
            self._right_of_way = RightOfWay(road, self._task, junctions, step)
        self._closed_lights: tuple[float, ...] = ()  # in the cycle before
        self._memory: object = None
        self._stats = PlanStats()
        self._off_road_steps = 0
        self._farthest = -math.inf  # along the path [m]
        self._kept: tuple[StepRecord, Scene] | None = None

    @property
    def outlook(self) -> Outlook:
        """How other vehicles are predicted."""
        return self._outlook

    @property
    def memory(self) -> object:
        """What the planner has left for its next cycle; None before the first."""
        return self._memory

    def place(
        self, ego: CartesianState, before: FrenetState | None
    ) -> FrenetState | None:
        """Return where the ego is along its path, None where it has left the path.

        Args:
            ego: Its state.
            before: Where it was a step ago.
        """
        near = None if before is None else before.s
        try:
            return cartesian_to_frenet_one(self._road.path, ego, near)
        except OutsidePathDomainError:
            return None

    def observe(
        self,
        index: int,
        ego: CartesianState,
        place: tuple[FrenetState | None, float],
        traffic: TrafficState,
        check: StepCheck,
    ) -> StepRecord:
        """Make the record of a step.

        Args:
            index: Of the step.
            ego: Its state.
            place: Along the path, and the arc length that stands for it where there is
                none [m].
            traffic: All others.
            check: Of the step that led here.
        """
        frenet, s = place
        traffic, lines, gives_way_to = self._closed_lines(traffic, s, ego)
        self._off_road_steps += check.off_road > OFF_ROAD_TOLERANCE
        perception = self._options.perception
        return StepRecord(
            index,
            traffic.time,
            ego,
            frenet,
            traffic,
            lines,
            None,
            None,
            check.contacts,
            check.clearance,
            check.nearest,
            check.off_road,
            gives_way_to,
            self._execution.report if index else None,
            None if perception is None else perception.perceive(traffic, ego),
        )

    def _closed_lines(
        self, traffic: TrafficState, s: float, ego: CartesianState
    ) -> tuple[TrafficState, tuple[float, ...], str | None]:
        """List the lines that the front bumper must not pass now.

        Returns:
            The traffic with what was read of the junctions, the lines, and whom the
            ego gives way to.
        """
        task = self._task
        front = s + task.vehicle.front_reach
        limits = task.vehicle.limits
        lines = closed_stop_lines(
            traffic.signals, front, ego.speed, limits, self._closed_lights
        )
        self._closed_lights = lines
        if self._right_of_way is None:
            return traffic, lines, None
        traffic, decided = self._right_of_way.update(traffic, s, ego)
        return (
            traffic,
            tuple(sorted({*lines, *closed_lines(decided)})),
            next((x.because_of for x in decided if x.because_of), None),
        )

    def ending(self, record: StepRecord) -> Ending | None:
        """Return how the episode has ended, the worst ending first, or None."""
        frenet, time = record.ego_frenet, f"at t = {record.time:.1f} s"
        if record.contacts:
            hit = ", ".join(record.contacts)
            return Ending(EpisodeStatus.COLLISION, f"touched {hit} {time}")
        if frenet is None:
            where = f"({record.ego.x:.1f}, {record.ego.y:.1f})"
            return Ending(
                EpisodeStatus.OFF_ROAD,
                f"at {where} m the ego has no place on the reference path, {time}",
            )
        ending = self._goal_ending(record, frenet, time)
        if ending is not None:
            return ending
        if record.time >= self._options.duration - TIME_TOLERANCE:
            stands = self._standing(record, frenet)
            region = self._task.region
            words = (
                f"s = {frenet.s:.1f} m of {self._task.goal:.1f} m {time}"
                if region is None
                else region.not_met(frenet.s, record.ego, record.time)
            )
            words = words if stands is None else f"{words}, {stands}"
            return Ending(EpisodeStatus.TIMEOUT, words)
        self._farthest = max(frenet.s, self._farthest)
        if frenet.s < self._farthest - BACKWARD_ROOM:
            return Ending(
                EpisodeStatus.PLANNER_FAILED,
                f"drove against the road's direction, from s = {self._farthest:.1f} m "
                f"back to {frenet.s:.1f} m {time}",
            )
        queue_lines: tuple[float, ...] = ()
        if self._right_of_way is not None:
            queue_lines = self._right_of_way.lines_ahead(frenet.s)
        reason = self._blockage.update(
            frenet,
            record.ego,
            record.traffic,
            record.stop_lines,
            self._stats,
            queue_lines,
        )
        return None if reason is None else Ending(EpisodeStatus.BLOCKED, reason)

    def _standing(self, record: StepRecord, frenet: FrenetState) -> str | None:
        """Say since when the ego stands, and why; None if it moves."""
        front = frenet.s + self._task.vehicle.front_reach
        at_line = any(0.0 <= x - front <= WAITING_ROOM for x in record.stop_lines)
        waits = at_line and self._stats.blocker is None
        return self._blockage.standing(
            frenet,
            record.traffic,
            self._stats,
            record.gives_way_to if waits else None,
        )

    def _goal_ending(
        self, record: StepRecord, frenet: FrenetState, time: str
    ) -> Ending | None:
        """Return the ending of an ego that has reached or missed its goal, or None."""
        region = self._task.region
        if region is None:
            return self._arrival(time) if frenet.s >= self._task.goal else None
        if region.is_reached(record.ego, self._body, record.time):
            return self._arrival(time)
        missed = region.why_missed(frenet.s, record.ego, record.time)
        if missed is None:
            return None
        stands = self._standing(record, frenet)
        words = missed if stands is None else f"{missed}, {stands}"
        return Ending(EpisodeStatus.TIMEOUT, words)

    def _arrival(self, time: str) -> Ending:
        """Return the ending of an ego that has reached its goal."""
        steps = self._off_road_steps
        if steps == 0:
            return Ending(EpisodeStatus.ARRIVED, f"arrived {time}")
        return Ending(
            EpisodeStatus.OFF_ROAD,
            f"arrived {time}, but over the road's edge in {steps} steps",
        )

    def drive(
        self,
        record: StepRecord,
        vehicles: Vehicles | None = None,
        planned: PlannedCycle | None = None,
    ) -> tuple[StepRecord, CartesianState]:
        """Plan from a record; return it with its plan, and the ego's next state.

        Args:
            record: Of the present step.
            vehicles: All others with their predictions, if these are known already.
            planned: For its `scene` and the `memory`, if that was done already.

        Raises:
            PlannerOutputError: If there is nothing that can be driven.
        """
        if record.ego_frenet is None:
            raise PlannerOutputError("there is no way to plan off the reference path")
        execution, time = self._execution, record.time
        start = self._start(record, record.ego_frenet)
        if start is not None:
            if planned is None:
                scene = self._scene(record, start, vehicles)
                planned = plan_once(self._planner, scene, self._memory)
            plan, timing = planned.plan, planned.timing
            with FAILURES_OF_THE_PLANNER:
                execution.accept(plan, start, time, timing.wall_ms)
            self._memory, self._stats = plan.memory, plan.stats
            shown = None if start.kind is PlanStartKind.EGO else start
            record = record.with_plan(plan, timing, shown)
        with FAILURES_OF_THE_PLANNER:
            return record, execution.advance(time, record.ego)

    def scene(
        self, record: StepRecord, vehicles: Vehicles | None = None
    ) -> Scene | None:
        """Return the scene that a plan is made for; None if none is made now.

        Args:
            record: Of the present step.
            vehicles: All others with their predictions, if these are known already.
        """
        if record.ego_frenet is None:
            return None
        start = self._start(record, record.ego_frenet)
        return None if start is None else self._scene(record, start, vehicles)

    def _start(self, record: StepRecord, place: FrenetState) -> PlanStart | None:
        """Return where a plan begins; None if none is made now."""
        return self._execution.start(record.index, record.time, record.ego, place)

    def _scene(
        self, record: StepRecord, start: PlanStart, vehicles: Vehicles | None
    ) -> Scene:
        """Return the scene of a record; that of the last one is kept."""
        if self._kept is not None and self._kept[0] is record:
            return self._kept[1]
        scene = build_scene(
            self._road,
            self._task,
            self._outlook,
            believed(record, start.lead),
            start.state,
            start.frenet,
            record.stop_lines,
            vehicles if start.lead == 0.0 and record.seen is None else None,
        )
        self._kept = (record, scene)
        return scene
