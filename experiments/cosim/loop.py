"""The closed loop: observe, check, plan, track, advance.

The loop uses a `World`, not a simulator. Its caller owns the world and closes it.
"""

import logging
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from time import perf_counter, thread_time

from experiments.cosim.blockage import BlockageDetector
from experiments.cosim.collision_monitor import CollisionMonitor
from experiments.cosim.execution import PlanExecution, PlanTiming
from experiments.cosim.perception.perceive import Perception, reckoned
from experiments.cosim.plant import PlannerOutputError, Plant
from experiments.cosim.records import (
    Ending,
    EpisodeStatus,
    PlanningTime,
    PlanStart,
    PlanStartKind,
    StepRecord,
    TrafficState,
)
from experiments.cosim.right_of_way import JunctionTraffic, RightOfWay, closed_lines
from experiments.cosim.road import EgoTask
from experiments.cosim.scene_builder import Outlook, build_scene
from experiments.cosim.signals import closed_stop_lines
from experiments.cosim.world import World
from experiments.errors import EntryError, SimulationError, described
from experiments.interrupts import is_interrupt
from planner.errors import OutsidePathDomainError
from planner.interface import Planner, PlanResult, PlanStats
from planner.prediction import Predictor, constant_speed
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import CartesianState, FrenetState
from planner.vehicle import Vehicle

log = logging.getLogger(__name__)

TIME_TOLERANCE = 1e-9  # [s]
TO_MS = 1e3  # from seconds
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


def run_loop(
    world: World,
    planner: Planner,
    plant: Plant,
    task: EgoTask,
    options: EpisodeOptions,
    on_step: Callable[[StepRecord], None],
) -> Ending:
    """Run one episode from entering to its end.

    Args:
        world: Not entered yet; the caller closes it afterwards.
        planner: Called once a step.
        plant: Moves the ego along the trajectory.
        task: The ego's goal and body.
        options: Duration, patience and predictions.
        on_step: Called with every step in order. In the last one nothing was planned,
            or nothing that could be driven: its plan is None. If the simulator fails
            there is no such last step.

    Returns:
        How the episode ended. Failures of planner and simulator are endings too;
        only errors of this package are raised.
    """
    try:
        ego = world.enter()
        return _Episode(world, planner, plant, task, options, on_step).run(ego)
    except EntryError as error:
        return Ending(EpisodeStatus.NO_ROOM, str(error))
    except SimulationError as error:
        log.warning("simulator failed: %s", error)
        return Ending(EpisodeStatus.SIMULATOR_FAILED, str(error))


@contextmanager
def failures_of_the_planner() -> Iterator[None]:
    """Turn whatever a planner raises into a PlannerOutputError.

    A planner may be anyone's code, and what it returns too: it may raise SystemExit,
    CancelledError or an exception of its own that has no text.
    """
    try:
        yield
    except PlannerOutputError:
        raise
    except BaseException as error:
        if is_interrupt(error):
            raise
        log.warning("the planner raised", exc_info=True)
        raise PlannerOutputError(described(error)) from error


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
    return replace(traffic, vehicles=users, ways=ways)


class _Episode:
    """The state that a running episode carries from step to step."""

    def __init__(
        self,
        world: World,
        planner: Planner,
        plant: Plant,
        task: EgoTask,
        options: EpisodeOptions,
        on_step: Callable[[StepRecord], None],
    ) -> None:
        vehicle, road = task.vehicle, world.road
        self._world = world
        self._planner = planner
        self._execution = PlanExecution(plant, road.path, world.step, options.timing)
        self._task = replace(task, vehicle=options.planned_body or vehicle)
        self._options = options
        self._on_step = on_step
        self._road = road
        self._outlook = Outlook(
            self._execution.period,
            options.horizon,
            options.predictor,
            options.full_statistics,
        )
        self._monitor = CollisionMonitor(road, vehicle)
        self._blockage = BlockageDetector(
            options.blocked_after, vehicle, road.path, road.obstacles
        )
        self._right_of_way: RightOfWay | None = None
        if road.junctions and isinstance(world, JunctionTraffic):
            self._right_of_way = RightOfWay(road, self._task, world, world.step)
        self._closed_lights: tuple[float, ...] = ()  # in the cycle before
        self._memory: object = None
        self._stats = PlanStats()
        self._off_road_steps = 0
        self._farthest = -math.inf  # along the path [m]
        self._process = os.getpid()

    def run(self, ego: CartesianState) -> Ending:
        """Step until something ends the episode."""
        record = self._observe(0, ego, None)
        while True:
            ending = self._ending(record)
            if ending is None:
                try:
                    record, ego = self._drive(record)
                except PlannerOutputError as error:
                    ending = Ending(EpisodeStatus.PLANNER_FAILED, str(error))
            self._on_step(record)
            if ending is not None:
                return ending
            ego = self._world.advance(ego)
            record = self._observe(record.index + 1, ego, record.ego_frenet)

    def _observe(
        self, index: int, ego: CartesianState, before: FrenetState | None
    ) -> StepRecord:
        """Observe the world and check the step that led here."""
        traffic = self._world.observe()
        near = None if before is None else before.s
        try:
            frenet = cartesian_to_frenet_one(self._road.path, ego, near)
        except OutsidePathDomainError:
            frenet = None
        s = frenet.s if frenet is not None else near or 0.0
        check = self._monitor.check(ego, traffic.vehicles, s)
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

    def _ending(self, record: StepRecord) -> Ending | None:
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
        if frenet.s >= self._task.goal:
            return self._arrival(time)
        if record.time >= self._options.duration - TIME_TOLERANCE:
            stands = self._blockage.standing(frenet, record.traffic, self._stats)
            words = f"s = {frenet.s:.1f} m of {self._task.goal:.1f} m {time}"
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

    def _arrival(self, time: str) -> Ending:
        """Return the ending of an ego that has reached its goal."""
        steps = self._off_road_steps
        if steps == 0:
            return Ending(EpisodeStatus.ARRIVED, f"arrived {time}")
        return Ending(
            EpisodeStatus.OFF_ROAD,
            f"arrived {time}, but over the road's edge in {steps} steps",
        )

    def _drive(self, record: StepRecord) -> tuple[StepRecord, CartesianState]:
        """Plan from a record; return it with its plan, and the ego's next state.

        Raises:
            PlannerOutputError: If there is nothing that can be driven.
        """
        if record.ego_frenet is None:
            raise PlannerOutputError("there is no way to plan off the reference path")
        execution, time = self._execution, record.time
        start = execution.start(record.index, time, record.ego, record.ego_frenet)
        if start is not None:
            plan, timing = self._plan(record, start)
            with failures_of_the_planner():
                execution.accept(plan, start, time, timing.wall_ms)
            self._memory, self._stats = plan.memory, plan.stats
            shown = None if start.kind is PlanStartKind.EGO else start
            record = record.with_plan(plan, timing, shown)
        with failures_of_the_planner():
            return record, execution.advance(time, record.ego)

    def _plan(
        self, record: StepRecord, start: PlanStart
    ) -> tuple[PlanResult, PlanningTime]:
        """Call the planner and measure its time."""
        scene = build_scene(
            self._road,
            self._task,
            self._outlook,
            believed(record, start.lead),
            start.state,
            start.frenet,
            record.stop_lines,
        )
        started, cpu_started = perf_counter(), thread_time()
        try:
            with failures_of_the_planner():
                plan: object = self._planner.plan(scene, self._memory)
        finally:
            if os.getpid() != self._process:  # plan() forked: end the copy of the run
                os._exit(0)
        timing = PlanningTime(
            (perf_counter() - started) * TO_MS, (thread_time() - cpu_started) * TO_MS
        )
        if not isinstance(plan, PlanResult):
            raise PlannerOutputError(f"plan() returned {type(plan).__name__}")
        return plan, timing
