"""`rearview commonroad`: solutions, their official check, and export of runs."""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from experiments.cli.user_errors import ARRIVED, OTHER_OUTCOME, report_user_errors
from experiments.commonroad.solution import CostFunction

commands = typer.Typer(
    help="Solutions of CommonRoad scenarios, their official check, and export.\n\n"
    "Example: rearview commonroad check runs/ZAM_CutIn_1_1_T_1-cruise-0-1a2b3c4d\n\n"
    "Exit status: 0 done, 1 not accepted, 2 bad input.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Cost = Annotated[CostFunction, typer.Option(help="What the solution is rated by.")]


def add_to(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.add_typer(commands, name="commonroad")


@commands.command()
def solution(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="A run for each planning problem."),
    ],
    *,
    cost: Cost = CostFunction.SM1,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File; default: solution.xml in the run."),
    ] = None,
) -> None:
    """Write what a run drove as a solution of its scenario.

    Example: rearview commonroad solution runs/ZAM_CutIn_1_1_T_1-cruise-0-1a2b3c4d

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        file, missing = _write_solution(runs, cost, out)
        if missing:
            names = ", ".join(str(name) for name in missing)
            sys.stderr.write(f"rearview: planning problems {names} are not solved\n")
        sys.stdout.write(f"solution: {file}\n")


def _write_solution(
    runs: list[Path], cost: CostFunction, out: Path | None
) -> tuple[Path, tuple[int, ...]]:
    """Write the solution; returns its file and the problems that stay unsolved."""
    from experiments.episode.commonroad_solution import read_solved_run, solution_of
    from experiments.errors import ResultsError

    text, missing = solution_of([read_solved_run(run) for run in runs], cost)
    file = out or runs[0] / "solution.xml"
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"{file}: cannot be written: {error.strerror}") from error
    return file, missing


@commands.command()
def check(
    checked: Annotated[
        Path, typer.Argument(metavar="RUN|SOLUTION", help="Run folder, or a file.")
    ],
    scenario: Annotated[
        Path | None,
        typer.Argument(help="Scenario of a solution file; a run knows its own."),
    ] = None,
    *,
    cost: Cost = CostFunction.SM1,
    python: Annotated[
        Path | None,
        typer.Option(help="Python of the checker; default: .venv-commonroad."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON.")
    ] = False,
) -> None:
    """Ask the official checker: feasible, no collision, on the road, at the goal.

    Example: rearview commonroad check runs/ZAM_CutIn_1_1_T_1-cruise-0-1a2b3c4d

    Exit status: 0 accepted, 1 rejected, 2 bad input.
    """
    with report_user_errors():
        from experiments.commonroad.checker import check_solution, find_python
        from experiments.commonroad.read import read_commonroad
        from experiments.episode.commonroad_solution import read_solved_run
        from experiments.errors import ConfigError

        found = find_python(python)
        with TemporaryDirectory() as folder:
            file = checked
            if checked.is_dir():
                scenario = read_solved_run(checked).file.file
                file, _ = _write_solution([checked], cost, Path(folder) / "s.xml")
            elif scenario is None:
                problem = "is a file; allowed: a run folder, or a file and its scenario"
                raise ConfigError(f"{checked}: {problem}")
            else:
                read_commonroad(scenario)
            report = check_solution(scenario, file, found)
        if as_json:
            words = {"accepted": report.is_accepted, "checks": dict(report.checks)}
            sys.stdout.write(json.dumps({**words, "cost": report.cost}) + "\n")
        else:
            for name, wrong in report.checks.items():
                sys.stdout.write(f"{name}: {wrong or 'ok'}\n")
            rated = report.cost_error if report.cost is None else f"{report.cost:.6g}"
            sys.stdout.write(f"cost {cost}: {rated}\n")
            verdict = "accepted" if report.is_accepted else "rejected"
            sys.stdout.write(f"{verdict} by the official checker\n")
        raise typer.Exit(ARRIVED if report.is_accepted else OTHER_OUTCOME)


@commands.command()
def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder.")],
    *,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File; default: its benchmark id, here."),
    ] = None,
) -> None:
    """Write a recorded run as a CommonRoad scenario: its traffic becomes a replay.

    Example: rearview commonroad export runs/intersection-cruise-0-1a2b3c4d -o left.xml

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.commonroad.write import write_commonroad
        from experiments.episode.commonroad_export import exported_scenario

        made = exported_scenario(run)
        file = out or Path(f"{made.benchmark_id}.xml")
        write_commonroad(made, file)
        sys.stdout.write(f"scenario: {file}\n")
