"""`rearview replan`: plan a recorded cycle again and compare."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.scenario_options import AllowPlanner
from experiments.cli.user_errors import (
    OTHER_OUTCOME,
    report_user_errors,
)


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(replan)


def replan(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    *,
    step: Annotated[int, typer.Option(help="Which step, from 0 on.")],
    allow_planner: AllowPlanner = None,
) -> None:
    """Plan a recorded step again, and print whether the plan is the same.

    Example: rearview replan runs/some --step 120

    Exit status: 0 the same plan, 1 another one, 2 bad input.
    """
    with report_user_errors():
        from experiments.cli.compile_notice import compilation_announced
        from experiments.episode.replan import replan as plan_again

        with compilation_announced():
            found = plan_again(run, step, allow_planner or ())
    for line in found or ("same plan",):
        sys.stdout.write(f"{line}\n")
    if found:
        raise typer.Exit(OTHER_OUTCOME)
