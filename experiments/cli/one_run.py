"""One run from the command line: what is shown of it, and how it is reported."""

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from experiments.cli import report_commands
from experiments.cli.user_errors import ARRIVED, OTHER_OUTCOME, report_user_errors
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.config import Scenario
    from experiments.cosim.fleet.records import FleetStep
    from experiments.cosim.records import StepRecord
    from experiments.episode.run_folder import Outcome


def drive_and_report(
    scenario: "Scenario", out: Path, *, gui: bool, as_json: bool
) -> int:
    """Run an episode, display it, and return the exit status."""
    with report_user_errors():
        from experiments.cli.compile_notice import compilation_announced
        from experiments.cli.episode_progress import progress
        from experiments.cli.shown_log import shown_log
        from experiments.episode.drive import run_scenario
        from experiments.episode.run_folder import OutputOptions
        from experiments.interrupts import interrupts_between_steps
        from experiments.world_setup import scenario_network

        with (
            compilation_announced(
                [choice.name for _, choice in scenario.planner_choices()]
            ),
            _stdout_to_stderr(),
            shown_log(scenario_network.log),
            interrupts_between_steps() as check_interrupt,
            progress(scenario) as show,
        ):

            def on_step(record: "StepRecord | FleetStep") -> None:
                check_interrupt()
                show(record)

            outcome = run_scenario(
                scenario,
                out=out,
                gui=gui,
                on_step=on_step,
                output=OutputOptions(keeps_candidates=True),
            )
        return _report(outcome, as_json=as_json)


def say_which_problem(scenario: "Scenario") -> None:
    """Say which planning problem of a CommonRoad file is driven, if it has several."""
    network = scenario.network
    if scenario.world != "commonroad" or network is None or network.file is None:
        return
    from experiments.commonroad.read import read_commonroad

    names = [problem.id for problem in read_commonroad(Path(network.file)).problems]
    if network.planning_problem is None and len(names) > 1:
        listed = ", ".join(str(name) for name in names)
        sys.stderr.write(
            f"{scenario.name}: has planning problems {listed}; {names[0]} is driven; "
            f"another one: --set network.planning_problem={names[1]}\n"
        )


def record_death(
    scenario: "Scenario", out: Path, process: int, death: str, *, as_json: bool
) -> int:
    """Record an episode whose process died."""
    with report_user_errors():
        from experiments.episode.run import record_crash
        from experiments.storage.atomic_folder import remove_unfinished

        remove_unfinished(out, process)
        reason = f"the process of the episode {death}"
        return _report(record_crash(scenario, reason, out), as_json=as_json)


def end_with_window(episode: Callable[[], int]) -> NoReturn:
    """Run, then exit at once: SUMO's window would keep the process alive."""
    try:
        status = episode()
    except typer.Exit as stop:
        status = stop.exit_code
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def _report(outcome: "Outcome", *, as_json: bool) -> int:
    """Write the page, print the outcome and return the exit status."""
    trace = getattr(outcome, "trace", None)  # of many egos there is none
    page = report_commands.write_page(outcome.folder, trace)
    if as_json:
        row: dict[str, Any] = {
            **outcome.row,
            "reason": outcome.ending.reason,
            "trace_hash": outcome.trace_hash,
            "run_folder": str(outcome.folder),
            "report": None if page is None else str(page),
        }
        sys.stdout.write(json.dumps(row) + "\n")
    else:
        from experiments.cli.outcome_table import print_outcome

        print_outcome(outcome)
        if page is not None:
            sys.stdout.write(f"report: {page}\n")
    return ARRIVED if outcome.row["arrived"] else OTHER_OUTCOME


def require_display() -> None:
    """Reject --gui where no window can open."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise ConfigError(
            "--gui: there is no display (DISPLAY is not set); allowed: a desktop "
            "session, or xvfb-run -a rearview run ..."
        )


@contextmanager
def _stdout_to_stderr() -> Iterator[None]:
    """Redirect output of SUMO or a planner to stderr: stdout is for the outcome."""
    sys.stdout.flush()
    kept = os.dup(1)
    try:
        os.dup2(2, 1)
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
