"""`rearview sweep | rerun | cluster`: many runs, one again, workers."""

import shlex
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.cli.gate_options import Gate
from experiments.cli.option_group import with_options
from experiments.cli.report_commands import write_page
from experiments.cli.scenario_options import AllowPlanner
from experiments.cli.user_errors import (
    INTERRUPTED,
    OTHER_OUTCOME,
    report_user_errors,
)

if TYPE_CHECKING:
    from experiments.api.sweep_session import SweepSession

WITHOUT_YES = 20_000  # runs of a sweep that need no confirmation
SWEEPS = Path("sweeps")  # parent of the folders of sweeps


def add_to(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command()(sweep)
    app.command()(rerun)
    app.command()(cluster)


@dataclass(frozen=True, slots=True)
class Execution:
    """Where a sweep is executed, and how much of it."""

    workers: Annotated[
        int | None,
        typer.Option(
            min=0, help="Processes; 0: this one, not isolated.  [one per core]"
        ),
    ] = None
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler: tcp://...")
    ] = None
    limit: Annotated[
        int | None, typer.Option(min=1, help="Execute at most this many runs.")
    ] = None


@with_options("gate", Gate)
@with_options("execution", Execution)
def sweep(
    file: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="Shipped sweep, or a .yaml file.")
    ],
    *,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print the number of runs and an estimate."),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the sweep.  [sweeps/NAME]")
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help=f"Allow more than {WITHOUT_YES} runs.")
    ] = False,
    allow_planner: AllowPlanner = None,
    execution: Execution,
    gate: Gate,
) -> None:
    """Execute the missing runs of a sweep and collect the results.

    Examples: rearview sweep smoke --dry-run;
    rearview sweep smoke --fail-if "collisions > 0 or arrived < 0.95"

    Exit status: 0 all runs were executed, whatever their outcome, 1 a condition of
    --fail-if is met, 2 bad input, 130 Ctrl-C.
    """
    with report_user_errors():
        from experiments.api.sweep_session import SweepSession
        from experiments.config.sweep_file import load_sweep
        from experiments.errors import ConfigError

        conditions = gate.conditions()
        asked, document = load_sweep(file, allow_planner or ())
        if asked.count > WITHOUT_YES and not yes:
            raise ConfigError(
                f"{document.name}: makes {asked.count} runs; allowed without --yes: "
                f"{WITHOUT_YES}"
            )
        folder = (out or SWEEPS / asked.name).absolute()
        session = SweepSession(
            asked,
            document,
            folder,
            execution.workers,
            execution.cluster,
            execution.limit,
        )
        if dry_run:
            for line in session.preview():
                sys.stdout.write(f"{line}\n")
            return
        _drive(session, shlex.join(["rearview", *sys.argv[1:]]))
        if gate.is_set and not gate.passes(conditions, asked.name, session.rows()):
            raise typer.Exit(OTHER_OUTCOME)


def rerun(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    run_id: Annotated[
        str, typer.Argument(metavar="RUN_ID", help="Run id, or its beginning.")
    ],
    *,
    allow_planner: AllowPlanner = None,
    open_folder: Annotated[
        bool, typer.Option("--open", help="Open the new folder in the file manager.")
    ] = False,
) -> None:
    """Repeat one run of a sweep and compare the traces.

    Example: rearview rerun sweeps/smoke 3fa9

    Exit status: 0 the same trace, 1 another one, 2 bad input.
    """
    with report_user_errors():
        from experiments.sweep.rerun import repeat

        repeated = repeat(folder, run_id, allow_planner or ())
        sys.stdout.write(f"{repeated.verdict}\nrun folder: {repeated.folder}\n")
        page = write_page(repeated.folder)
        if page is not None:
            sys.stdout.write(f"report: {page}\n")
        if open_folder:
            typer.launch(str(repeated.folder))
        if not repeated.same:
            raise typer.Exit(OTHER_OUTCOME)


def cluster(
    *,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Worker processes.  [one per core]")
    ] = None,
    port: Annotated[
        int, typer.Option(help="Port of the scheduler; 0: any free one.")
    ] = 0,
    dashboard: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Of dask's page, which has no password; :PORT: all interfaces.",
        ),
    ] = "127.0.0.1:0",
) -> None:
    """Run a dask scheduler with workers on this machine until Ctrl-C.

    Example: rearview cluster --workers 2

    Exit status: 130 Ctrl-C, 2 bad input.
    """
    with report_user_errors():
        from experiments.sweep.executors.cluster import local_cluster
        from experiments.sweep.executors.local import cores

        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with local_cluster(workers or cores(), port, dashboard) as address:
            sys.stdout.write(
                f"{address}\nrearview sweep ... --cluster {address}; Ctrl-C ends it\n"
            )
            sys.stdout.flush()
            try:
                signal.pause()
            except KeyboardInterrupt:
                raise typer.Exit(INTERRUPTED) from None


def _drive(session: "SweepSession", again: str) -> None:
    """Execute a sweep, and print how to resume it if interrupted."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        for line in session.drive():
            sys.stdout.write(f"{line}\n")
            sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write(
            f"rearview: interrupted; finished runs are kept, resume with: {again}\n"
        )
        raise typer.Exit(INTERRUPTED) from None
