"""The closed loop of many egos: one snapshot a step, every ego plans on it.

Each ego is an `EgoDriver` of its own and sees the others as strangers. All egos of a
step plan on the same snapshot and are moved together, so that their order means
nothing.
"""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import thread_time
from typing import Protocol

import numpy as np

from experiments.cosim.collision_monitor import StepCheck
from experiments.cosim.ego_driver import EgoDriver, EpisodeOptions
from experiments.cosim.fleet.batch import plan_batch
from experiments.cosim.fleet.contacts import CheckedEgo, FleetMonitor
from experiments.cosim.fleet.records import (
    HUMAN,
    EgoStep,
    EnteredVehicle,
    FleetSnapshot,
    FleetStep,
    Leaving,
)
from experiments.cosim.fleet.selection import EgoSelection
from experiments.cosim.fleet.sight import FleetSight
from experiments.cosim.fleet.world import FleetWorld
from experiments.cosim.planning import PlannedCycle
from experiments.cosim.plant import PerfectTracking, PlannerOutputError
from experiments.cosim.records import (
    Ending,
    EpisodeStatus,
    StepRecord,
    TrafficState,
)
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.waiting_lines import is_before_line
from experiments.errors import ExperimentError, SimulationError
from planner.interface import BatchPlanner, Planner, PlanResult
from planner.reference_path.frenet import state_on_path
from planner.scene import Scene, Vehicles
from planner.states import CartesianState, FrenetState

log = logging.getLogger(__name__)

SHOWN_AHEAD = (1.0, 2.0, 3.0)  # of a plan, for pictures [s]
GONE = "gone"  # SUMO has removed the ego
TURNED_AT_MOST = 0.3  # from the path, of a vehicle that is taken over [rad]


class NoWayError(ExperimentError):
    """A vehicle cannot be an ego: its route has no path for its body."""


@dataclass(frozen=True, slots=True)
class FleetGroup:
    """How the egos of a group are driven."""

    planner: Planner | None  # None: by SUMO, and counted apart
    ends_run: bool = False  # a failed ego ends the run instead of being handed back


@dataclass(frozen=True, slots=True, eq=False)
class EgoWay:
    """The road of an ego as far as it is laid out, and its task there."""

    road: Road
    task: EgoTask
    renew_at: float = math.inf  # arc length from where on the next part is needed [m]


class WayFinder(Protocol):
    """Lays out the roads of egos."""

    def __call__(self, vehicle: EnteredVehicle, group: int) -> EgoWay:
        """Return the way of a vehicle from its present edge on.

        Raises:
            NoWayError: If it cannot be driven.
        """
        ...


@dataclass(slots=True)
class FleetEgo:
    """One ego."""

    id: str
    group: int
    way: EgoWay
    driver: EgoDriver
    state: CartesianState
    place: FrenetState | None = None
    index: int = 0  # steps since it was taken over

    @property
    def s(self) -> float:
        """Arc length that stands for its place [m]."""
        return 0.0 if self.place is None else self.place.s


@dataclass(frozen=True, slots=True, eq=False)
class SeenEgo:
    """One ego at a moment: what it sees, and whether it has ended."""

    ego: FleetEgo
    record: StepRecord
    ending: Ending | None
    sight: FleetSight
    number: int  # in the sight

    def vehicles(self) -> Vehicles | None:
        """Return the others with their predictions; None where each ego makes its own.

        At junctions they are predicted along their ways, which not all egos know.
        """
        known = self.record.traffic.ways is None
        return self.sight.predicted(self.number) if known else None

    def scene(self) -> Scene | None:
        """Return the scene that its planner gets; None off its path."""
        return self.ego.driver.scene(self.record, self.vehicles())


@dataclass(frozen=True, slots=True, eq=False)
class FleetMoment:
    """A moment that was looked at, before anybody moves on."""

    index: int
    snapshot: FleetSnapshot
    gone: list[Leaving]
    egos: list[SeenEgo]  # in the order of their ids
    cpu_s: float  # of looking [s]


class FleetLoop:
    """A running simulation with many egos.

    Args:
        world: Not entered yet; the caller closes it afterwards.
        groups: How each is driven.
        selection: Which vehicles belong to them.
        find_way: Lays out the roads.
        options: Duration, patience and predictions.
        on_step: Called with every step in order.
    """

    def __init__(
        self,
        world: FleetWorld,
        groups: Sequence[FleetGroup],
        selection: EgoSelection,
        find_way: WayFinder,
        options: EpisodeOptions,
        on_step: Callable[[FleetStep], None],
    ) -> None:
        self._world = world
        self._groups = groups
        self._selection = selection
        self._find_way = find_way
        self._options = options
        # of each ego: what ends a run, and statistics for it, are for one alone
        self._own_options = replace(options, duration=math.inf, full_statistics=False)
        self._on_step = on_step
        self._monitor = FleetMonitor()
        self._egos: dict[str, FleetEgo] = {}
        self._group: dict[str, int] = {}  # of every vehicle that was seen
        self.refused: dict[str, str] = {}  # type and route of no ego -> why
        self.worst: Ending | None = None  # of the egos that failed

    def run(self) -> Ending:
        """Step until the time is over, or an ego's failure ends the run.

        Returns:
            How it ended. Failures of the simulator are an ending too.
        """
        try:
            self._world.enter()
            index = 0
            while not self.move(self.look(index)):
                index += 1
            return self._ending()
        except SimulationError as error:
            log.warning("simulator failed: %s", error)
            return Ending(EpisodeStatus.SIMULATOR_FAILED, str(error))

    def look(self, index: int) -> FleetMoment:
        """Observe a step: who is there, who of them is an ego, and how it fares.

        Args:
            index: Of the step, 0 for the first; the world has been entered.

        Raises:
            SimulationError: If the simulator fails.
        """
        started = thread_time()
        snapshot = self._world.observe()
        gone = self._note_gone(index, snapshot)
        self._note_entered(snapshot)
        egos = self._in_order()
        for ego in egos:
            if ego.index:
                ego.place = ego.driver.place(ego.state, ego.place)
            self._renew(ego)
        checks = self._monitor.check(
            [
                CheckedEgo(x.id, x.state, x.way.task.vehicle, x.way.road, x.s)
                for x in egos
            ],
            snapshot.users,
        )
        sight = FleetSight(
            snapshot.users,
            [(x.id, x.state, x.way.road, x.driver.outlook) for x in egos],
        )
        seen = [
            self._seen(ego, sight, k, check)
            for k, (ego, check) in enumerate(zip(egos, checks, strict=True))
        ]
        return FleetMoment(index, snapshot, gone, seen, thread_time() - started)

    def move(self, moment: FleetMoment) -> bool:
        """Let every ego plan on a moment, and the world go one step on.

        Returns:
            Whether it was the last step: the time is over, or an ego's failure ends
            the run.

        Raises:
            SimulationError: If the simulator fails.
        """
        started, index, of = thread_time(), moment.index, self._group
        ids = moment.snapshot.users.ids
        group = np.array([of.get(x, HUMAN) for x in ids], np.int64)
        steps, moves, failures = self._drive(moment)
        ended = any(
            x.how != EpisodeStatus.ARRIVED and self._groups[of[x.id]].ends_run
            for x in failures
        )
        n_steps = round(self._options.duration / self._world.step)
        last = ended or index >= n_steps
        if not last:
            self._world.advance(moves, self._waiting(moment))
        leavings = [*moment.gone, *failures]
        self._let_go(leavings)
        spent = moment.cpu_s + thread_time() - started
        self._on_step(
            FleetStep(index, moment.snapshot, group, steps, tuple(leavings), spent)
        )
        return last

    def _ending(self) -> Ending:
        """Return the worst that has happened to an ego."""
        if self.worst is not None:
            return self.worst
        n_egos = sum(group != HUMAN for group in self._group.values())
        some = "1 ego" if n_egos == 1 else f"{n_egos} egos"
        words = f"the time is over: {some}, no contact"
        if self.refused:
            words += f"; {len(self.refused)} kinds of vehicles could not be egos"
        words += "".join(f"; {one}" for one in self._selection.never_met())
        return Ending(EpisodeStatus.ARRIVED, words)

    def _note_gone(self, index: int, snapshot: FleetSnapshot) -> list[Leaving]:
        """Forget egos that SUMO has removed."""
        there = set(snapshot.users.ids)
        lost = [name for name in self._egos if name not in there]
        for name in lost:
            del self._egos[name]
            self._world.forget(name)
        return [Leaving(index, name, GONE, "SUMO has removed it") for name in lost]

    def _note_entered(self, snapshot: FleetSnapshot) -> None:
        """Take over those of the vehicles that have entered which are egos."""
        for name, lane in zip(snapshot.users.ids, snapshot.lane.tolist(), strict=True):
            if name in self._group or lane < 0:
                continue
            entered = self._world.describe(name)
            group = self._selection.choose(name, entered.type)
            self._group[name] = group
            if group == HUMAN or self._groups[group].planner is None:
                continue
            try:
                way = self._find_way(entered, group)
            except NoWayError as error:
                key = f"{entered.type} on {' '.join(entered.route[entered.edge :])}"
                if key not in self.refused:
                    log.warning("%s is no ego: %s", key, error)
                self.refused[key] = str(error)
                self._group[name] = HUMAN
                self._selection.release(group)
                continue
            state = self._world.take_over(name, way.task.vehicle)
            state = _on_path(way, state)
            driver = self._driver(group, way)
            ego = FleetEgo(name, group, way, driver, state)
            ego.place = driver.place(state, None)
            self._egos[name] = ego

    def _driver(self, group: int, way: EgoWay) -> EgoDriver:
        """Make the driver of an ego."""
        planner, world = self._groups[group].planner, self._world
        assert planner is not None  # noqa: S101 - else nobody is taken over
        return EgoDriver(
            planner,
            PerfectTracking(),
            way.road,
            way.task,
            self._own_options,
            world.step,
            world.junction_traffic(way.road) if way.road.junctions else None,
        )

    def _drive(
        self, moment: FleetMoment
    ) -> tuple[tuple[EgoStep, ...], Mapping[str, CartesianState], list[Leaving]]:
        """Let every ego plan.

        Returns:
            The steps of the egos, where they go, and those that are egos no more.
        """
        steps: list[EgoStep] = []
        moves: dict[str, CartesianState] = {}
        leavings: list[Leaving] = []
        planned = self._plan_together(moment)
        for seen in moment.egos:
            ego = seen.ego
            record, after, ending = self._step(seen, planned.get(ego.id))
            steps.append(_ego_step(ego, record))
            if ending is not None:
                left = Leaving(moment.index, ego.id, ending.status, ending.reason)
                leavings.append(left)
            moves[ego.id] = ego.state = after
            ego.index += 1
        steps.sort(key=lambda step: step.id)
        leavings.sort(key=lambda leaving: leaving.id)
        return tuple(steps), moves, leavings

    def _waiting(self, moment: FleetMoment) -> frozenset[str]:
        """Return the egos that are before a line of their road after this step."""
        egos, step = [seen.ego for seen in moment.egos], self._world.step
        return frozenset(
            ego.id
            for ego in egos
            if is_before_line(
                ego.way.road,
                ego.s + ego.way.task.vehicle.front_reach + ego.state.speed * step,
                ego.state.speed,
            )
        )

    def _plan_together(
        self, moment: FleetMoment
    ) -> Mapping[str, PlannedCycle | PlannerOutputError]:
        """Let planners that plan for many at once do so; what came of it, by ego."""
        planned: dict[str, PlannedCycle | PlannerOutputError] = {}
        for number, group in enumerate(self._groups):
            planner = group.planner
            if not isinstance(planner, BatchPlanner):
                continue
            scenes = {
                seen.ego.id: (scene, seen.ego.driver.memory)
                for seen in moment.egos
                if seen.ego.group == number and seen.ending is None
                if (scene := seen.scene()) is not None
            }
            planned |= plan_batch(planner, scenes)
        return planned

    def _in_order(self) -> list[FleetEgo]:
        """Return the egos in the order in which they plan, which means nothing."""
        return [self._egos[name] for name in sorted(self._egos)]

    def _seen(
        self, ego: FleetEgo, sight: FleetSight, k: int, check: StepCheck
    ) -> SeenEgo:
        """Observe one ego."""
        world = self._world
        traffic = TrafficState(
            ego.index * world.step,
            sight.seen(k),
            world.signals(ego.way.road),
            world.ghost(ego.id),
        )
        place = (ego.place, ego.s)
        record = ego.driver.observe(ego.index, ego.state, place, traffic, check)
        return SeenEgo(ego, record, ego.driver.ending(record), sight, k)

    def _step(
        self, seen: SeenEgo, planned: PlannedCycle | PlannerOutputError | None
    ) -> tuple[StepRecord, CartesianState, Ending | None]:
        """Plan and drive one ego, unless it was `planned` already.

        Returns:
            Its record, where it goes, and how it has ended. One that has ended rolls
            on in this step, so that SUMO knows where to go on.
        """
        ego, record = seen.ego, seen.record
        if seen.ending is not None:
            return record, self._coasting(ego), seen.ending
        try:
            if isinstance(planned, PlannerOutputError):
                raise planned
            record, after = ego.driver.drive(record, seen.vehicles(), planned)
        except PlannerOutputError as error:
            ending = Ending(EpisodeStatus.PLANNER_FAILED, str(error))
            return record, self._coasting(ego), ending
        return record, after, None

    def _coasting(self, ego: FleetEgo) -> CartesianState:
        """Return where an ego without a plan is a step on: straight ahead."""
        state, driven = ego.state, max(ego.state.speed, 0.0) * self._world.step
        return CartesianState(
            state.x + driven * math.cos(state.heading),
            state.y + driven * math.sin(state.heading),
            state.heading,
            state.curvature,
            state.speed,
            0.0,
        )

    def _renew(self, ego: FleetEgo) -> None:
        """Lay out the next part of an ego's way once its road comes to an end."""
        if ego.s < ego.way.renew_at:
            return
        vehicle = self._world.describe(ego.id)
        try:
            way = self._find_way(vehicle, ego.group)
        except NoWayError:
            return  # inside a junction: on the next edge there is one
        driver = self._driver(ego.group, way)
        place = driver.place(ego.state, None)
        if place is None:
            return
        ego.way, ego.driver, ego.place = way, driver, place

    def _let_go(self, leavings: Sequence[Leaving]) -> None:
        """Remove arrived egos, hand all others back, remember the worst."""
        for leaving in leavings:
            if leaving.how == GONE:
                continue
            del self._egos[leaving.id]
            if leaving.how == EpisodeStatus.ARRIVED:
                self._world.take_out(leaving.id)
                continue
            self._world.hand_back(leaving.id)
            ending = Ending(
                EpisodeStatus(leaving.how), f"{leaving.id}: {leaving.reason}"
            )
            if self.worst is None or _rank(ending) < _rank(self.worst):
                self.worst = ending


# how a run has ended if egos have ended in different ways, the worst first
_WORST_FIRST = (
    EpisodeStatus.COLLISION,
    EpisodeStatus.OFF_ROAD,
    EpisodeStatus.PLANNER_FAILED,
    EpisodeStatus.BLOCKED,
)


def _rank(ending: Ending) -> int:
    """Return the place of an ending among the worst ones."""
    if ending.status in _WORST_FIRST:
        return _WORST_FIRST.index(ending.status)
    return len(_WORST_FIRST)


def _on_path(way: EgoWay, state: CartesianState) -> CartesianState:
    """Return a state with the path's heading and curvature, at its offset.

    SUMO's vehicles turn at their front bumpers; where one comes in askew it stays so.
    """
    path = way.road.path
    s, l = path.project_one(state.x, state.y, None)
    along = state_on_path(path, s, l, state.speed)
    turned = math.remainder(along.heading - state.heading, 2.0 * math.pi)
    return along if abs(turned) < TURNED_AT_MOST else state


def plan_ahead(plan: PlanResult | None) -> tuple[float, ...]:
    """Return x, y of a plan at the times that are kept of it; its end where it ends."""
    if plan is None or plan.trajectory is None:
        return ()
    way = plan.trajectory
    return tuple(
        float(np.interp(time, way.t, axis))
        for time in SHOWN_AHEAD
        for axis in (way.x, way.y)
    )


def _ego_step(ego: FleetEgo, record: StepRecord) -> EgoStep:
    """Return what is kept of a step of an ego."""
    plan, planning = record.plan, record.planning
    return EgoStep(
        ego.id,
        ego.group,
        record.ego,
        "" if plan is None else str(plan.status),
        record.clearance,
        record.off_road,
        record.contacts,
        math.nan if planning is None else planning.cpu_ms,
        plan_ahead(plan),
    )
