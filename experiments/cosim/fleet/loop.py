"""The closed loop of many egos: one snapshot a step, every ego plans on it.

Each ego is an `EgoDriver` of its own and sees the others as strangers. All egos of a
step plan on the same snapshot and are moved together, so that their order means
nothing.
"""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from time import thread_time

import numpy as np

from experiments.cosim.collision_monitor import StepCheck
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.fleet.batch import plan_together
from experiments.cosim.fleet.contacts import CheckedEgo, FleetMonitor
from experiments.cosim.fleet.egos import FleetEgo, FleetMoment, SeenEgo
from experiments.cosim.fleet.kept_step import kept_step
from experiments.cosim.fleet.records import (
    HUMAN,
    EgoStep,
    FleetSnapshot,
    FleetStep,
    Leaving,
)
from experiments.cosim.fleet.selection import EgoSelection
from experiments.cosim.fleet.sight import FleetSight
from experiments.cosim.fleet.takeover import FleetGroup, Takeover
from experiments.cosim.fleet.ways import WayFinder
from experiments.cosim.fleet.world import FleetWorld
from experiments.cosim.planning import PlannedCycle
from experiments.cosim.plant import PlannerOutputError
from experiments.cosim.records import (
    Ending,
    EpisodeStatus,
    StepRecord,
    TrafficState,
)
from experiments.cosim.waiting_lines import is_before_line
from experiments.errors import SimulationError
from planner.states import CartesianState

log = logging.getLogger(__name__)

GONE = "gone"  # SUMO has removed the ego


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
        self._takeover = Takeover(world, groups, selection, find_way, options)
        self._duration = options.duration
        self._on_step = on_step
        self._monitor = FleetMonitor()
        self._egos: dict[str, FleetEgo] = {}
        self.worst: Ending | None = None  # of the egos that failed

    @property
    def refused(self) -> Mapping[str, str]:
        """Why vehicles are no egos, by their type and route."""
        return self._takeover.refused

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
        self._egos.update((x.id, x) for x in self._takeover.entered(snapshot))
        egos = self._in_order()
        for ego in egos:
            if ego.index:
                ego.place = ego.driver.place(ego.state, ego.place)
            self._takeover.renew(ego)
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
        started, index, of = thread_time(), moment.index, self._takeover.groups
        ids = moment.snapshot.users.ids
        group = np.array([of.get(x, HUMAN) for x in ids], np.int64)
        steps, moves, failures = self._drive(moment)
        ended = any(
            x.how != EpisodeStatus.ARRIVED and self._groups[of[x.id]].ends_run
            for x in failures
        )
        n_steps = round(self._duration / self._world.step)
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
        n_egos = sum(group != HUMAN for group in self._takeover.groups.values())
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
        planned = plan_together(moment.egos, self._groups)
        for seen in moment.egos:
            ego = seen.ego
            record, after, ending = self._step(seen, planned.get(ego.id))
            steps.append(kept_step(ego, record))
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
            vehicles = seen.vehicles() if planned is None else None
            record, after = ego.driver.drive(record, vehicles, planned)
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
