"""The command line: `rearview run | report | sweep | results | ...`.

Exit status: 0 arrived (or done), 1 any other outcome of an episode, 2 bad input, 3 an
internal error, 130 Ctrl-C. Heavy modules are imported where they are needed, so that
`--help` is immediate.
"""

import inspect
import io
import logging
import sys
from collections.abc import Callable
from functools import wraps
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

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
from experiments.cli.one_run import (
    drive_and_report,
    end_with_window,
    record_death,
    require_display,
    say_which_problem,
)
from experiments.cli.scenario_options import (
    AllowPlanner,
    Overrides,
    PlannerName,
    ScenarioName,
    SeedNumber,
)
from experiments.cli.user_errors import (
    BAD_INPUT,
    INTERRUPTED,
    TERMINATED,
    TerminatedError,
    end_on_sigterm,
    reader_may_leave,
    report_user_errors,
)
from experiments.errors import ConfigError

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
            require_display()
        loaded = load_scenario(
            scenario,
            planner=planner,
            seed=seed,
            overrides=overrides or (),
            allow_planners=allow_planner or (),
        )

        say_which_problem(loaded)

        def episode() -> int:
            return drive_and_report(loaded, out, gui=gui, as_json=as_json)

        def crashed(process: int, death: str) -> int:
            return record_death(loaded, out, process, death, as_json=as_json)

        if gui:  # a window belongs to the process that made it
            end_with_window(episode)
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


def _print_list(title: str, lines: dict[str, str]) -> None:
    """Print names with one line each."""
    width = max((len(name) for name in lines), default=0)
    sys.stdout.write(f"{title}\n")
    for name, text in lines.items():
        sys.stdout.write(f"  {name:<{width}}  {text}\n")
