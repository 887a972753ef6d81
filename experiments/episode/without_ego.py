"""The run without the ego that belongs to an episode, as a table of vehicles."""

import json
import logging
import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from experiments.config import Scenario
from experiments.cosim.records import TrafficState
from experiments.cosim.sumo.without_ego import WithoutEgoWorld
from experiments.cosim.sumo.world import SumoWorld
from experiments.cosim.world import World
from experiments.errors import SimulationError
from experiments.trace.recording import vehicle_table
from experiments.trace.schema import Table, Trace
from experiments.world_setup.road import Layout
from experiments.world_setup.world import make_world_without_ego

log = logging.getLogger(__name__)

# Longer than this episode needs: one of another planner may take longer.
AHEAD: Final = 1.25


@dataclass(slots=True)
class SharedTraffic:
    """Runs without the ego that episodes of several planners have in common.

    Which planner drives the ego changes nothing in a run without it. Those of the same
    scenario and seed are therefore run once, as long as they follow each other: those
    of another one take their place.
    """

    _scenario: str = ""
    _runs: dict[Hashable, list[TrafficState]] = field(default_factory=dict)

    def drive(
        self, scenario: Scenario, world: WithoutEgoWorld, entry_steps: int, n_steps: int
    ) -> list[TrafficState]:
        """Return the moments of a run without the ego, with all vehicles.

        Args:
            scenario: Of the episode.
            world: Without the ego, of the same.
            entry_steps: See `WithoutEgoWorld.drive`.
            n_steps: Moments needed.

        Raises:
            SimulationError: If SUMO fails before the last of them.
        """
        written = scenario.resolved()
        same = {key: value for key, value in written.items() if key != "planner"}
        written_as = json.dumps(same, sort_keys=True)
        if written_as != self._scenario:
            self._runs.clear()
            self._scenario = written_as
        key = (world.traffic, entry_steps)
        moments = self._runs.get(key, [])
        if len(moments) < n_steps:
            moments = _as_far_as_it_goes(world, entry_steps, n_steps)
            self._runs[key] = moments
        return moments[:n_steps]


def _as_far_as_it_goes(
    world: WithoutEgoWorld, entry_steps: int, n_steps: int
) -> list[TrafficState]:
    """Drive somewhat longer than asked, unless SUMO fails beyond that."""
    moments: list[TrafficState] = []
    try:
        moments.extend(world.drive(entry_steps, math.ceil(AHEAD * n_steps)))
    except SimulationError:
        if len(moments) < n_steps:
            raise
    return moments


def vehicles_without_ego(
    scenario: Scenario,
    layout: Layout,
    trace: Trace,
    world: World,
    folder: Path,
    *,
    placebo: int | None = None,
    shared: SharedTraffic | None = None,
) -> Table | None:
    """Run the same seed without the ego, if the scenario asks for it.

    Args:
        scenario: Of the episode.
        layout: Of the episode.
        trace: Of the episode; the vehicles that the ego has seen are reported.
        world: Of the episode, closed.
        folder: Where its route file is.
        placebo: Which of the two placebos: other random numbers from the ego's entry
            on.
        shared: Of the episodes before this one.

    Returns:
        The vehicles at the moments of the trace. None if the scenario does not ask for
        it, the ego never entered, or the simulator fails where it did not with the ego.
    """
    n_steps = len(trace.steps["index"])
    simulation = scenario.simulation
    asked = simulation.without_ego if placebo is None else simulation.placebo
    if not asked or n_steps == 0:
        return None
    if not isinstance(world, SumoWorld):
        return None
    without_ego = make_world_without_ego(scenario, layout, folder, placebo=placebo)
    ids = set(trace.vehicles["id"].tolist())
    entry = world.entry_steps
    try:
        if shared is None:
            moments = list(without_ego.drive(entry, n_steps, ids))
        else:
            found = shared.drive(scenario, without_ego, entry, n_steps)
            moments = [_among(moment, ids) for moment in found]
        return vehicle_table(layout.road.path, list(enumerate(moments)))
    except SimulationError as error:
        log.warning("the run without the ego failed: %s", error)
        return None
    finally:
        without_ego.close()


def _among(moment: TrafficState, ids: set[str]) -> TrafficState:
    """Return a moment with the vehicles of these ids only."""
    there = np.array([name in ids for name in moment.vehicles.ids], dtype=np.bool_)
    return TrafficState(moment.time, moment.vehicles.among(there))
