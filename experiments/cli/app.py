"""The command line: `rearview run | report | sweep | results | ...`.

Exit status: 0 arrived (or done), 1 any other outcome of an episode, 2 bad input, 3 an
internal error, 130 Ctrl-C. Heavy modules are imported where they are needed, so that
`--help` is immediate.
"""

import inspect
import io
import json
import logging
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from experiments.cli import (
    before_run_commands,
    commonroad_commands,
    compare_runs_command,
    compile_command,
    events_command,
    evidence_command,
    r157_command,
    rate_command,
    replan_command,
    report_commands,
    results_commands,
    robustness_command,
    search_command,
    sweep_commands,
    thesis_command,
    tube_command,
)
from experiments.cli.garbage import look_for_garbage_less_often
from experiments.cli.scenario_options import (
    AllowPlanner,
    Overrides,
    PlannerName,
    ScenarioName,
    SeedNumber,
)
from experiments.cli.user_errors import (
    ARRIVED,
    BAD_INPUT,
    INTERRUPTED,
    OTHER_OUTCOME,
    TERMINATED,
    TerminatedError,
    end_on_sigterm,
    reader_may_leave,
    report_user_errors,
)
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.config import Scenario
    from experiments.cosim.fleet.records import FleetStep
    from experiments.cosim.records import StepRecord
    from experiments.episode.run_folder import Outcome

# typer bundles click and exports only some of its exceptions
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]

app = typer.Typer(
    help="Run trajectory planners in closed loop with SUMO traffic.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def main() -> None:
    """Run the command line; report usage errors in one line."""
    # What is imported makes no garbage: looking for it takes a tenth of the start.
    look_for_garbage_less_often()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # ASCII terminals cannot show ³
    end_on_sigterm()
    try:
        with reader_may_leave():
            status = app(prog_name="rearview", standalone_mode=False)
    except _UsageError as error:
        _show_usage_error(error)
        status = BAD_INPUT
    except typer.Exit as stop:
        status = stop.exit_code
    except typer.Abort:
        status = INTERRUPTED
    if status == INTERRUPTED and TerminatedError.raised:
        status = TERMINATED
    sys.exit(status)


def _print_version(*, asked: bool) -> None:
    """Print the version and exit if `--version` was given."""
    if asked:
        sys.stdout.write(f"rearview {metadata.version('rearview')}\n")
        raise typer.Exit


@app.callback()
def options(
    *,
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Print the version.",
            is_eager=True,
            callback=lambda asked: _print_version(asked=asked),
        ),
    ] = False,
) -> None:
    """Drives trajectory planners through SUMO traffic."""


def _with_verbose(command: Callable[..., None]) -> Callable[..., None]:
    """Add the option --verbose, which is about the log and not about the command."""
    verbose = inspect.Parameter(
        "verbose",
        inspect.Parameter.KEYWORD_ONLY,
        default=False,
        annotation=Annotated[
            bool,
            typer.Option("--verbose", "-v", help="Log to stderr, with tracebacks."),
        ],
    )

    @wraps(command)
    def logged(*arguments: Any, verbose: bool, **options: Any) -> None:
        logging.basicConfig(level=logging.DEBUG if verbose else logging.CRITICAL)
        for noisy in ("numba", "matplotlib"):
            logging.getLogger(noisy).setLevel(logging.WARNING)
        command(*arguments, **options)

    own = inspect.signature(command)
    parameters = [*own.parameters.values(), verbose]
    logged.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
    return logged


before_run_commands.add_to(app)


@app.command()
@_with_verbose
def run(
    scenario: ScenarioName,
    *,
    planner: PlannerName = None,
    seed: SeedNumber = None,
    overrides: Overrides = None,
    allow_planner: AllowPlanner = None,
    gui: Annotated[bool, typer.Option("--gui", help="Show SUMO's window.")] = False,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            help="Print the results row, reason, trace hash, folder and page as a "
            "line of JSON.",
        ),
    ] = False,
    out: Annotated[Path, typer.Option(help="Parent folder of run folders.")] = Path(
        "runs"
    ),
) -> None:
    """Run one episode and write its run folder.

    Example: rearview run lane_change --seed 4 --set traffic.density=dense

    Exit status: 0 the ego arrived, 1 any other outcome, 2 bad input.
    """
    with report_user_errors():
        from experiments.config.scenario_file import load_scenario

        if gui:
            _require_display()
        loaded = load_scenario(
            scenario,
            planner=planner,
            seed=seed,
            overrides=overrides or (),
            allow_planners=allow_planner or (),
        )

        _say_which_problem(loaded)

        def episode() -> int:
            return _episode(loaded, out, gui=gui, as_json=as_json)

        def crashed(process: int, death: str) -> int:
            return _crashed(loaded, out, process, death, as_json=as_json)

        if gui:  # a window belongs to the process that made it
            _end_with_window(episode)
        from experiments.cli.crash_guard import guarded

        raise typer.Exit(guarded(episode, crashed))


@app.command("list")
def list_() -> None:
    """List scenarios, networks, sweeps, searches and planners.

    Example: rearview list

    Exit status: 0 done.
    """
    with report_user_errors():
        from experiments.config.scenario_file import load_scenario, scenario_names
        from experiments.config.search_file import load_search, search_names
        from experiments.config.sweep_file import load_sweep, sweep_names
        from experiments.planners.registry import PLANNERS
        from sumo_nets.catalogue import networks

        _print_list(
            "scenarios", {n: load_scenario(n).purpose for n in scenario_names()}
        )
        _print_list("networks", {n: r.description for n, r in networks().items()})
        _print_list("sweeps", {n: load_sweep(n)[0].purpose for n in sweep_names()})
        _print_list("searches", {n: load_search(n)[0].purpose for n in search_names()})
        _print_list("planners", {n: known.purpose for n, known in PLANNERS.items()})


report_commands.add_to(app)
events_command.add_to(app)
replan_command.add_to(app)
sweep_commands.add_to(app)
search_command.add_to(app)
results_commands.add_to(app)
compare_runs_command.add_to(app)
r157_command.add_to(app)
tube_command.add_to(app)
robustness_command.add_to(app)
rate_command.add_to(app)
thesis_command.add_to(app)
evidence_command.add_to(app)
compile_command.add_to(app)
commonroad_commands.add_to(app)


@app.command()
def schema(
    *,
    sweep: Annotated[
        bool, typer.Option("--sweep", help="For sweep files instead of scenarios.")
    ] = False,
    search: Annotated[
        bool, typer.Option("--search", help="For search files instead of scenarios.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario, sweep or search files, for editors.

    Example: rearview schema --sweep

    Exit status: 0 done.
    """
    from experiments.config.scenario_file import schema_text
    from experiments.config.search_file import search_schema
    from experiments.config.sweep_file import sweep_schema

    if sweep and search:
        with report_user_errors():
            raise ConfigError("--search: is beside --sweep; allowed: one of them")
    wanted = sweep_schema() if sweep else search_schema() if search else None
    sys.stdout.write(schema_text(wanted))


def _show_usage_error(error: Any) -> None:
    """Report a usage error in one line; `rearview` alone shows the help."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return
    command = error.ctx.command_path if error.ctx else "rearview"
    words = " ".join(error.format_message().split())
    sys.stderr.write(f"rearview: {words.rstrip('.')}; see {command} --help\n")


def _episode(scenario: "Scenario", out: Path, *, gui: bool, as_json: bool) -> int:
    """Run an episode, display it, and return the exit status."""
    with report_user_errors():
        from experiments.cli.compile_notice import compilation_announced
        from experiments.cli.episode_progress import progress
        from experiments.cli.shown_log import shown_log
        from experiments.episode.drive import run_scenario
        from experiments.episode.run_folder import OutputOptions
        from experiments.interrupts import interrupts_between_steps
        from experiments.world_setup import road

        with (
            compilation_announced(
                [choice.name for _, choice in scenario.planner_choices()]
            ),
            _stdout_to_stderr(),
            shown_log(road.log),
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


def _say_which_problem(scenario: "Scenario") -> None:
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


def _crashed(
    scenario: "Scenario", out: Path, process: int, death: str, *, as_json: bool
) -> int:
    """Record an episode whose process died."""
    with report_user_errors():
        from experiments.episode.run import record_crash
        from experiments.storage.atomic_folder import remove_unfinished

        remove_unfinished(out, process)
        reason = f"the process of the episode {death}"
        return _report(record_crash(scenario, reason, out), as_json=as_json)


def _end_with_window(episode: Callable[[], int]) -> NoReturn:
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


def _print_list(title: str, lines: dict[str, str]) -> None:
    """Print names with one line each."""
    width = max((len(name) for name in lines), default=0)
    sys.stdout.write(f"{title}\n")
    for name, text in lines.items():
        sys.stdout.write(f"  {name:<{width}}  {text}\n")


def _require_display() -> None:
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
