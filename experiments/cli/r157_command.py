"""`rearview r157`: the picture of UN Regulation 157."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.cli.user_errors import INTERRUPTED, report_user_errors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from experiments.cosim.plants.tracked import PlantSettings
    from experiments.evidence.r157.grids import Density
    from experiments.evidence.r157.planner_runs import RunSettings
    from experiments.evidence.r157.summary import KindStudy
    from experiments.sweep.processes.parallel import InProcesses

OUT = Path("runs/r157")
NO_PLANNER = "none"
OUR_PLANNERS = ("cruise", "lane_change")


class KindName(StrEnum):
    """Kinds of conflicts, or all of them."""

    CUT_IN = "cut_in"
    CUT_OUT = "cut_out"
    BRAKING = "braking"
    ALL = "all"


class ProfileName(StrEnum):
    """Lateral motion of a vehicle that cuts in."""

    LINEAR = "linear"
    QUINTIC = "quintic"


class PlantName(StrEnum):
    """How the ego follows its plans."""

    PERFECT = "perfect"
    KINEMATIC = "kinematic"
    DYNAMIC = "dynamic"


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(r157)


def r157(
    *,
    planner: Annotated[
        list[str] | None,
        typer.Option(
            help="Registered planner, or module:factory; several are allowed. none: "
            "the reference drivers alone."
        ),
    ] = None,
    kind: Annotated[KindName, typer.Option(help="Kind of conflict.")] = KindName.CUT_IN,
    full: Annotated[
        bool, typer.Option("--full", help="All cells instead of every second value.")
    ] = False,
    profile: Annotated[
        ProfileName, typer.Option(help="Lateral motion of a cut-in.")
    ] = ProfileName.LINEAR,
    follower: Annotated[
        bool, typer.Option("--follower", help="With a reacting vehicle behind the ego.")
    ] = False,
    plant: Annotated[
        PlantName,
        typer.Option(
            help="Model of the ego's motion, with the actuators autoware; the body "
            "that planners keep clear grows by its measured errors."
        ),
    ] = PlantName.PERFECT,
    out: Annotated[Path, typer.Option(help="Output folder.")] = OUT,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 2,
) -> None:
    """Compare planners with the reference drivers of UN Regulation 157.

    Example: rearview r157 --planner cruise

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.cosim.conflicts import LateralProfile
        from experiments.evidence.r157.grids import ConflictKind, Density
        from experiments.evidence.r157.planner_runs import RunSettings
        from experiments.evidence.r157.study import check_planner
        from experiments.evidence.r157.summary import study_kind
        from experiments.report.figures.save import require_matplotlib
        from experiments.storage.atomic_folder import make_folder

        require_matplotlib("r157")
        planners = list(dict.fromkeys(planner or OUR_PLANNERS))
        if planners == [NO_PLANNER]:
            planners = []
        for name in planners:
            check_planner(name)
        make_folder(out)
        density = Density.FULL if full else Density.THINNED
        motion = LateralProfile(profile.value)
        settings = RunSettings(
            profile=motion, follower=follower, plant=_plant_settings(plant)
        )
        kinds = list(ConflictKind) if kind is KindName.ALL else [ConflictKind(kind)]

        def study_all(work: "InProcesses") -> "Iterator[KindStudy]":
            for each in kinds:
                work.part = str(each)
                yield study_kind(each, planners, density, settings, out, work)

        _report(_in_processes(study_all, workers, out), density, settings, out)


def _report(
    studies: "list[KindStudy]", density: "Density", settings: "RunSettings", out: Path
) -> None:
    """Write the page of all studies and print their headlines."""
    from experiments.evidence.r157.document import write_study

    page = write_study(studies, density, settings, out)
    for study in studies:
        _print_headlines(study)
    sys.stdout.write(f"report: {page}\n")


def _in_processes(
    study: "Callable[[InProcesses], Iterable[KindStudy]]", workers: int, out: Path
) -> "list[KindStudy]":
    """Make all studies in worker processes; say what is kept if interrupted."""
    from experiments.sweep.processes.parallel import in_processes

    try:
        with in_processes(workers) as work:
            return list(study(work))
    except KeyboardInterrupt:
        sys.stderr.write(
            f"interrupted; finished panels are kept in {out}, the same command "
            "resumes\n"
        )
        raise typer.Exit(INTERRUPTED) from None


def _plant_settings(name: PlantName) -> "PlantSettings | None":
    """Return the settings of a car with the wheelbase of the study's ego."""
    if name is PlantName.PERFECT:
        return None
    from experiments.config.vehicle_model import ActuatorsConfig, PlantConfig
    from experiments.cosim.conflicts import Sizes
    from experiments.evidence.r157.planner_runs import ACTUATORS, WHEELBASE_SHARE
    from experiments.world_setup.vehicle_model import model_settings

    wheelbase = WHEELBASE_SHARE * Sizes().ego_length
    actuators = ActuatorsConfig(preset=ACTUATORS)
    model = PlantConfig.model_validate({"model": name.value})
    return model_settings(model, actuators, None, wheelbase)


def _print_headlines(study: "KindStudy") -> None:
    """Print one line a planner."""
    for found in study.headlines():
        sys.stdout.write(
            f"{study.kind}: {found.planner}: {found.preventable} collisions that the "
            f"careful human prevents; {found.survived} of his {found.unpreventable} "
            f"survived; {found.failed} failed\n"
        )
