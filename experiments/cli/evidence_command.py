"""`rearview evidence`: run the published sweeps and write the results page."""

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.cli.user_errors import INTERRUPTED, report_user_errors

if TYPE_CHECKING:
    from experiments.evidence.published_sweeps import PublishedSweep

OUT = Path("runs/results")


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(evidence)


def evidence(
    sweeps: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SWEEP]...", help="Published sweeps.  [all]"),
    ] = None,
    *,
    quick: Annotated[
        bool, typer.Option("--quick", help="One seed of one road; about a minute.")
    ] = False,
    seeds: Annotated[
        int | None,
        typer.Option(min=1, help="The first seeds of each sweep only.  [all]"),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="One value of an axis, or scenario=NAME; may be repeated.  [all]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Output folder.  [runs/results; with --quick runs/results_quick]"
        ),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 2,
) -> None:
    """Run the published sweeps, and write the results page from them.

    Example: rearview evidence lane_change_paired --seeds 20

    Exit status: 0 done, 2 bad input, 130 interrupted.
    """
    with report_user_errors():
        from experiments.evidence.numbers import kept_claims, write_evidence
        from experiments.evidence.published_sweeps import (
            Reduction,
            published_names,
            published_sweeps,
        )
        from experiments.storage.atomic_folder import make_folder

        folder = (out or (OUT.with_name("results_quick") if quick else OUT)).absolute()
        reduction = Reduction(seeds, tuple(only or ()), quick)
        published = published_sweeps(sweeps or (), reduction)
        make_folder(folder)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            for one in published:
                _drive(one, folder, workers)
            studied = _study(folder, workers, quick=quick)
        except KeyboardInterrupt:
            sys.stderr.write(
                f"interrupted; finished runs are kept in {folder}, the same command "
                "resumes\n"
            )
            raise typer.Exit(INTERRUPTED) from None
        claims = kept_claims(published_names(), folder)
        page = write_evidence(claims, studied, folder, quick=quick)
        sys.stdout.write(f"results: {page}\n")


def _drive(published: "PublishedSweep", folder: Path, workers: int) -> None:
    """Run what is missing of a sweep, and keep its numbers."""
    from experiments.api.sweep_session import SweepSession
    from experiments.evidence.claims import claim_data
    from experiments.evidence.numbers import keep_claim

    place = folder / published.sweep.name
    session = SweepSession(published.sweep, published.document, place, workers)
    for line in session.drive():
        sys.stderr.write(f"{line}\n")
    keep_claim(claim_data(published, place), folder)


def _study(folder: Path, workers: int, *, quick: bool) -> dict[str, Any]:
    """Compute what needs no sweep, or read it if it has been."""
    from experiments.evidence.numbers import STUDIES, study_data
    from experiments.sweep.processes.parallel import in_processes

    studied = {}
    with in_processes(workers) as work:
        for name in STUDIES:
            work.part = name
            studied[name], new = study_data(name, work, folder, quick=quick)
            words = "computed" if new else "kept from an earlier call"
            sys.stderr.write(f"{name}: {words}\n")
    return studied
