"""`rearview report | figure | video`: pages, figures and films of runs and sweeps."""

import math
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.cli.user_errors import report_user_errors
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.trace.schema import Trace

PAGE_SUFFIXES = (".html", ".htm")
_FOLDER_HELP = "Folder of a run or a sweep.  [newest run in runs]"


class MetricKind(StrEnum):
    """How one metric of a sweep is drawn."""

    MEANS = "means"
    PAIRS = "pairs"
    ECDF = "ecdf"
    HEAT = "heat"


def add_to(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command()(report)
    app.command()(figure)
    app.command()(video)


def report(
    folder: Annotated[
        Path | None, typer.Argument(metavar="RUN|SWEEP", help=_FOLDER_HELP)
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="An .html file.  [FOLDER/report.html]"),
    ] = None,
    runs: Annotated[
        bool,
        typer.Option(
            "--runs", help="For a sweep: also write the page of each run with a trace."
        ),
    ] = False,
) -> None:
    """Write the self-contained HTML page of a run or a sweep.

    Example: rearview report sweeps/smoke --runs

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.episode.newest_run import newest_run
        from experiments.report.run.facts import is_run
        from experiments.report.run.page import save_run_page
        from experiments.report.sweep.page import save_run_pages, save_sweep_page
        from experiments.sweep.folder import is_sweep

        folder = folder or newest_run()
        if output is not None and output.suffix.lower() not in PAGE_SUFFIXES:
            raise ConfigError(f"-o: {output}: allowed: {', '.join(PAGE_SUFFIXES)}")
        if is_run(folder) or not is_sweep(folder):
            sys.stdout.write(f"{save_run_page(folder, output)}\n")
            return
        if runs:
            sys.stdout.write(f"{save_run_pages(folder)} pages of runs\n")
        sys.stdout.write(f"{save_sweep_page(folder, output)}\n")


def figure(
    folder: Annotated[
        Path | None, typer.Argument(metavar="RUN|SWEEP", help=_FOLDER_HELP)
    ] = None,
    *,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help=".png, .svg or .pdf  [FOLDER/figure.png]"),
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option(help="Of a sweep: one metric or rate, as wide as a column."),
    ] = None,
    kind: Annotated[
        MetricKind, typer.Option(help="How the metric is drawn.")
    ] = MetricKind.MEANS,
    where: Annotated[
        str | None,
        typer.Option(metavar="SQL", help="With --metric: scenario = 'curved'"),
    ] = None,
) -> None:
    """Draw a figure of a run or a sweep for a paper.

    With --metric the numbers in the figure are written beside it as .csv.

    Examples: rearview figure runs/some -o run.pdf;
    rearview figure sweeps/smoke --metric travel_time_s --kind pairs

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.episode.newest_run import newest_run
        from experiments.report.figures.save import save_figure, save_metric_figure
        from experiments.report.figures.sweep_metric import FigureKind

        if metric is not None:
            if folder is None:
                raise ConfigError("--metric: allowed with the folder of a sweep")
            drawn = save_metric_figure(folder, metric, FigureKind(kind), where, output)
            sys.stdout.write("".join(f"{file}\n" for file in drawn))
            return
        if where is not None:
            raise ConfigError("--where: allowed with --metric")
        sys.stdout.write(f"{save_figure(folder or newest_run(), output)}\n")


def video(
    run_folder: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help="Run folder.  [newest run in runs]"),
    ] = None,
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="An .mp4 or .gif file.")
    ],
    speed: Annotated[
        float, typer.Option(help="Playback speed relative to real time.")
    ] = 1.0,
    begin: Annotated[
        float, typer.Option("--from", metavar="SECONDS", help="Where it begins.")
    ] = 0.0,
    end: Annotated[
        float,
        typer.Option(
            "--to",
            metavar="SECONDS",
            help="Where it ends.  [the end]",
            show_default=False,
        ),
    ] = math.inf,
) -> None:
    """Film a run in top view: road, vehicles, ego and plan.

    Example: rearview video runs/some -o run.gif --from 30 --to 42

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.episode.newest_run import newest_run
        from experiments.report.figures.video import save_film

        film = save_film(run_folder or newest_run(), output, speed, (begin, end))
        sys.stdout.write(f"{film}\n")


def write_page(folder: Path, trace: "Trace | None" = None) -> Path | None:
    """Write the page of a run that has just ended.

    Args:
        folder: Of the run.
        trace: Of the run, if it is at hand.

    Returns:
        The page's file; None if it cannot be written, which is said on stderr: the run
        itself is whole.
    """
    from experiments.errors import ResultsError
    from experiments.report.run.page import save_run_page

    try:
        return save_run_page(folder, trace=trace)
    except ResultsError as error:
        sys.stderr.write(f"rearview: no page written: {error}\n")
        return None
