"""Run a scenario, with one ego or many."""

from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

from experiments.config import Scenario
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.records import StepRecord
from experiments.episode.newest_run import RUNS
from experiments.episode.run import run_episode
from experiments.episode.run_folder import Outcome, OutputOptions
from experiments.errors import ConfigError

OnAnyStep = Callable[[StepRecord | FleetStep], None]


def run_scenario(
    scenario: Scenario,
    *,
    out: Path = RUNS,
    gui: bool = False,
    on_step: OnAnyStep | None = None,
    output: OutputOptions | None = None,
) -> Outcome:
    """Run a scenario and write its run folder; see `run_episode` and `run_fleet`.

    Args:
        scenario: Checked.
        out: Where run folders go.
        gui: Show SUMO's window; of a single ego only.
        on_step: Called with every step, for a progress display.
        output: Another place or content of the run folder.

    Returns:
        The outcome, also if planner or simulator failed.

    Raises:
        ConfigError: If the scenario cannot be run as written.
        SimulationError: If the simulator cannot be loaded.
        ResultsError: If the run folder cannot be written.
    """
    with chdir(Path.cwd()):  # a planner may leave it, and folders may be relative
        if scenario.egos is None:
            return run_episode(
                scenario, out=out, gui=gui, on_step=on_step, output=output
            )
        from experiments.episode.fleet import run_fleet  # most runs have one ego

        if gui:
            raise ConfigError(
                "--gui: is for one ego; allowed: without it for many egos"
            )
        return run_fleet(scenario, out=out, on_step=on_step, output=output)
