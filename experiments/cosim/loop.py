"""The closed loop: observe, check, plan, track, advance.

The loop uses a `World`, not a simulator. Its caller owns the world and closes it.
"""

import logging
from collections.abc import Callable

from experiments.cosim.collision_monitor import CollisionMonitor
from experiments.cosim.ego_driver import EgoDriver, EpisodeOptions
from experiments.cosim.plant import PlannerOutputError, Plant
from experiments.cosim.records import Ending, EpisodeStatus, StepRecord
from experiments.cosim.right_of_way import JunctionTraffic
from experiments.cosim.road import EgoTask
from experiments.cosim.world import SeesIndicator, World
from experiments.errors import EntryError, SimulationError
from planner.interface import Planner
from planner.scene import Scene
from planner.states import CartesianState, FrenetState

log = logging.getLogger(__name__)


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
        return RunningEpisode(world, planner, plant, task, options, on_step).run(ego)
    except EntryError as error:
        return Ending(EpisodeStatus.NO_ROOM, str(error))
    except SimulationError as error:
        log.warning("simulator failed: %s", error)
        return Ending(EpisodeStatus.SIMULATOR_FAILED, str(error))


class RunningEpisode:
    """A running episode: `begin`, then `drive` and `advance` until it has an ending."""

    def __init__(
        self,
        world: World,
        planner: Planner,
        plant: Plant,
        task: EgoTask,
        options: EpisodeOptions,
        on_step: Callable[[StepRecord], None],
    ) -> None:
        knows = world if isinstance(world, JunctionTraffic) else None
        self._world = world
        self._driver = EgoDriver(
            planner, plant, world.road, task, options, world.step, knows
        )
        # asked once: it takes long to find out whether a world has a method
        self._sees = world if isinstance(world, SeesIndicator) else None
        self._monitor = CollisionMonitor(world.road, task.vehicle)
        self._on_step = on_step

    def run(self, ego: CartesianState) -> Ending:
        """Step until something ends the episode."""
        record = self.begin(ego)
        while True:
            ending = self.ending(record)
            if ending is None:
                try:
                    record, ego = self.drive(record)
                except PlannerOutputError as error:
                    ending = Ending(EpisodeStatus.PLANNER_FAILED, str(error))
            self._on_step(record)
            if ending is not None:
                return ending
            record = self.advance(record, ego)

    def begin(self, ego: CartesianState) -> StepRecord:
        """Observe the first step, the world entered."""
        return self._observe(0, ego, None)

    def advance(self, record: StepRecord, ego: CartesianState) -> StepRecord:
        """Move the world one step on, the ego to `ego`, and observe it."""
        ego = self._world.advance(ego)
        return self._observe(record.index + 1, ego, record.ego_frenet)

    def ending(self, record: StepRecord) -> Ending | None:
        """Return how the episode has ended, the worst ending first, or None."""
        return self._driver.ending(record)

    def drive(self, record: StepRecord) -> tuple[StepRecord, CartesianState]:
        """Plan from a record; return it with its plan, and the ego's next state.

        Raises:
            PlannerOutputError: If there is nothing that can be driven.
        """
        record, ego = self._driver.drive(record)
        if self._sees is not None and record.plan is not None:
            self._sees.indicate(record.plan.indicator)
        return record, ego

    def scene(self, record: StepRecord) -> Scene | None:
        """Return the scene that a plan is made for; None if none is made now."""
        return self._driver.scene(record)

    def _observe(
        self, index: int, ego: CartesianState, before: FrenetState | None
    ) -> StepRecord:
        """Observe the world and check the step that led here."""
        traffic = self._world.observe()
        frenet = self._driver.place(ego, before)
        s = frenet.s if frenet is not None else before.s if before is not None else 0.0
        check = self._monitor.check(ego, traffic.vehicles, s)
        return self._driver.observe(index, ego, (frenet, s), traffic, check)
