"""`rearview thesis`: recompute the published claims."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.user_errors import INTERRUPTED, report_user_errors

OUT = Path("runs/thesis")


class ChapterName(StrEnum):
    """Chapters that can be recomputed."""

    CRUISE = "cruise"
    DENSE = "dense"
    LANE_CHANGE = "lane_change"


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(thesis)


def thesis(
    chapters: Annotated[
        list[ChapterName] | None,
        typer.Argument(metavar="[CHAPTER]...", help="Chapters to recompute.  [all]"),
    ] = None,
    *,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few layouts, no SUMO; under a minute.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Output folder.  [runs/thesis; with --quick runs/thesis_quick]"
        ),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 2,
) -> None:
    """Recompute the published claims of the thesis.

    Example: rearview thesis --quick

    Exit status: 0 done, 2 bad input, 130 Ctrl-C; the same command resumes.
    """
    with report_user_errors():
        from experiments.report.figures.save import require_matplotlib
        from experiments.sweep.processes.parallel import in_processes
        from experiments.thesis.chapters import CHAPTERS, chapter_data, kept_chapters
        from experiments.thesis.effort import FULL, QUICK
        from experiments.thesis.reproduction import write_reproduction

        require_matplotlib("thesis")
        asked = [str(name) for name in chapters or ChapterName]
        effort = QUICK if quick else FULL
        folder = out or (OUT.with_name("thesis_quick") if quick else OUT)
        folder.mkdir(parents=True, exist_ok=True)
        try:
            with in_processes(workers) as work:
                for name in asked:
                    work.part = name
                    _, new = chapter_data(name, effort, work, folder)
                    words = "computed" if new else "kept from an earlier run"
                    sys.stderr.write(f"{name}: {words}\n")
        except KeyboardInterrupt:
            sys.stderr.write(
                f"interrupted; finished chapters are kept in {folder}, the same "
                "command resumes\n"
            )
            raise typer.Exit(INTERRUPTED) from None
        found = kept_chapters(list(CHAPTERS), effort, folder)
        page = write_reproduction(found, folder, quick=quick)
        for chapter in found:
            for words in chapter["missing"]:
                sys.stdout.write(f"not measured: {words}\n")
        sys.stdout.write(f"report: {page}\n")
