"""`rearview search`: look for what breaks a planner."""

import shlex
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.scenario_options import AllowPlanner
from experiments.cli.user_errors import INTERRUPTED, report_user_errors

SEARCHES = Path("searches")  # parent of the folders of searches


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(search)


def search(
    file: Annotated[
        str,
        typer.Argument(metavar="NAME|FILE", help="Shipped search, or a .yaml file."),
    ],
    *,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the file; run nothing.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the search.  [searches/NAME]")
    ] = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Execute at most this many runs.")
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="random", help="Search once more at random, to compare."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0, help="Processes; 0: this one, not isolated.  [one per core]"
        ),
    ] = None,
    allow_planner: AllowPlanner = None,
) -> None:
    """Search a scenario's parameters for what breaks a planner; resume a search.

    Example: rearview search cut_in_search --against random

    Exit status: 0 the search ended, whatever it found, 2 bad input, 130 Ctrl-C.
    """
    with report_user_errors():
        from experiments.api.search_session import SearchSession
        from experiments.config.search_file import load_search, searched_against

        asked, document = load_search(file, allow_planner or ())
        if against is not None:
            asked = searched_against(asked, against)
        folder = (out or SEARCHES / asked.name).absolute()
        session = SearchSession(asked, document, folder, workers, limit)
        if dry_run:
            sys.stdout.write(f"{session.preview()}\n")
            return
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            for line in session.drive():
                sys.stdout.write(f"{line}\n")
                sys.stdout.flush()
        except KeyboardInterrupt:
            again = shlex.join(["rearview", *sys.argv[1:]])
            sys.stderr.write(
                f"rearview: interrupted; finished runs are kept, resume with: {again}\n"
            )
            raise typer.Exit(INTERRUPTED) from None
