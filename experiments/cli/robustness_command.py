"""`rearview robustness`: tables of sweeps over vehicles and perception."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.user_errors import report_user_errors
from experiments.cli.written_or_printed import write_or_print


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(robustness)


def robustness(
    sweeps: Annotated[
        list[Path], typer.Argument(metavar="SWEEP...", help="Folders of sweeps.")
    ],
    *,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Markdown file; default: print.")
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(help="Curves over latency, noise and range: .svg, .pdf, .png."),
    ] = None,
) -> None:
    """Write what imperfect vehicles and eyes cost, from finished sweeps.

    Example: rearview robustness sweeps/perception -o robustness.md --figure f.svg

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.comparison.robustness import robustness_page

        page = robustness_page(sweeps)
        if figure is not None:
            from experiments.comparison.robustness import degradation_curves
            from experiments.report.figures.degradation import draw_degradation
            from experiments.report.figures.save import save_picture

            curves = [curve for sweep in sweeps for curve in degradation_curves(sweep)]
            save_picture("robustness", figure, lambda: draw_degradation(curves))
        write_or_print(page, out)
