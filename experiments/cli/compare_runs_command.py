"""`rearview compare-runs`: a page on which runs are replayed over each other."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.scenario_options import AllowPlanner
from experiments.cli.user_errors import report_user_errors
from experiments.errors import ConfigError

PAGE_SUFFIXES = (".html", ".htm")


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command("compare-runs")(compare_runs)


def compare_runs(
    places: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN RUN...|SWEEP [RUN_ID]...",
            help="2 to 8 run folders; or a sweep and ids of its runs, or --seed.",
        ),
    ],
    *,
    seed: Annotated[
        int | None, typer.Option(help="Of a sweep: the runs with this seed.")
    ] = None,
    where: Annotated[
        str | None,
        typer.Option(metavar="SQL", help="Of these: scenario = 'curved'"),
    ] = None,
    worst: Annotated[
        str | None,
        typer.Option(
            metavar="METRIC",
            help="Of a sweep: the seed that loses most against the first planner.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="An .html file.  [comparison.html beside]"),
    ] = None,
    allow_planner: AllowPlanner = None,
) -> None:
    """Write a page that replays runs over each other, with curves and differences.

    Runs of a sweep that kept no trace are repeated first.

    Examples: rearview compare-runs runs/one runs/other -o page.html;
    rearview compare-runs sweeps/mine --worst travel_time_s

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.report.compared.page import COMPARISON_FILE, save_comparison
        from experiments.sweep.folder import is_sweep

        if output is not None and output.suffix.lower() not in PAGE_SUFFIXES:
            raise ConfigError(f"-o: {output}: allowed: {', '.join(PAGE_SUFFIXES)}")
        first = Path(places[0])
        if is_sweep(first):
            from experiments.cli.sweep_runs import chosen_runs, with_traces

            chosen = chosen_runs(first, places[1:], seed, where, worst)
            folders = with_traces(first, chosen, allow_planner or ())
            beside = first
        else:
            for option, value in (("--seed", seed), ("--where", where)):
                if value is not None:
                    raise ConfigError(f"{option}: {first} is not a sweep's folder")
            if worst is not None:
                raise ConfigError(f"--worst: {first} is not a sweep's folder")
            folders = [Path(place) for place in places]
            beside = first.absolute().parent
        page, left_out = save_comparison(folders, output or beside / COMPARISON_FILE)
        for words in left_out:
            sys.stderr.write(f"rearview: left out: {words}\n")
        sys.stdout.write(f"{page}\n")
