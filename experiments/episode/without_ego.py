"""The run without the ego that belongs to an episode, as a table of vehicles."""

import logging
from pathlib import Path

from experiments.config import Scenario
from experiments.cosim.sumo.world import SumoWorld
from experiments.cosim.world import World
from experiments.errors import SimulationError
from experiments.trace.recording import vehicle_table
from experiments.trace.schema import Table, Trace
from experiments.world_setup.road import Layout
from experiments.world_setup.world import make_world_without_ego

log = logging.getLogger(__name__)


def vehicles_without_ego(
    scenario: Scenario,
    layout: Layout,
    trace: Trace,
    world: World,
    folder: Path,
    *,
    placebo: int | None = None,
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
    try:
        moments = without_ego.drive(world.entry_steps, n_steps, ids)
        return vehicle_table(layout.road.path, list(enumerate(moments)))
    except SimulationError as error:
        log.warning("the run without the ego failed: %s", error)
        return None
    finally:
        without_ego.close()
