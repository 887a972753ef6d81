"""Study of [Thesis] 6.4: the speed plan of cases 1 and 2.

`python -m experiments.thesis.lane_change.speed_study` prints the figures;
with `-o FILE` it also draws
the s-T picture with both regions and the courses of speed, acceleration and jerk.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from experiments.thesis.lane_change.published_cases import (
    VARIANTS,
    SpeedCase,
    solve_case,
)
from planner.lane_change.speed.passing_orders import Side

FORMATS = (".svg", ".png", ".pdf")
START_SPEEDS = (9.0, 15.0)  # of cases 1 and 2 [m/s]
EXPECTED = ("B: 9, 7.5, 12.0, 11.6", "A: 15, 12.5, 14.0")  # of these parameters


def case_table(variants: Mapping[str, Sequence[SpeedCase]]) -> Table:
    """Tabulate both cases in every variant of the margins."""
    table = Table(title="Cases 1 and 2: one car from behind at 14 m/s")
    for name in (
        "margins",
        "case",
        "region",
        "v at the start, least, greatest after it, end m/s",
        "expected",
        "largest |a| m/s²",
        "largest |jerk| m/s³",
        "cost A / B",
        "area A / B before t0 m s (6.18)",
    ):
        table.add_column(name)
    for name, cases in variants.items():
        for number, case in enumerate(cases):
            table.add_row(name, str(number + 1), *_cells(case, EXPECTED[number]))
    return table


def _cells(case: SpeedCase, expected: str) -> tuple[str, ...]:
    """Write what one case came to."""
    profile = case.plan.profile
    if profile is None:
        return ("none", case.plan.reason, expected, *("-",) * 4)
    v = profile.speed
    least = int(v.argmin())
    return (
        case.region,
        f"{v[0]:.2f}, {v[least]:.2f}, {v[least:].max():.2f}, {v[-1]:.2f}",
        expected,
        f"{abs(profile.acceleration).max():.2f}",
        f"{abs(profile.jerk).max():.2f}",
        f"{_cost(case, Side.BEFORE)} / {_cost(case, Side.AFTER)}",
        f"{case.area_a:.1f} / {case.area_b:.1f}",
    )


def _cost(case: SpeedCase, side: Side) -> str:
    """Write the cost of one side; a lower bound where it was given up."""
    for alternative in case.plan.alternatives:
        if alternative.sides[0][1] is side:
            return ("" if alternative.exact else "> ") + f"{alternative.cost:.1f}"
    return "not reachable"


def main(
    arguments: Sequence[str] | None = None, console: Console | None = None
) -> None:
    """Print the study, and draw it if a file is given."""
    parser = argparse.ArgumentParser(description="Cases 1 and 2 of [Thesis] ch. 6.")
    parser.add_argument("-o", "--output", type=Path, help="picture: .svg, .png, .pdf")
    file = parser.parse_args(arguments).output
    if file is not None and file.suffix not in FORMATS:
        parser.error(f"{file} has no known suffix; allowed: {', '.join(FORMATS)}")
    console = console or Console(highlight=False, width=150)
    variants = {
        name: [solve_case(speed, settings) for speed in START_SPEEDS]
        for name, settings in VARIANTS.items()
    }
    console.print(case_table(variants))
    if file is not None:
        from experiments.thesis.lane_change.st_figure import (
            save_cases,  # needs matplotlib
        )

        save_cases(next(iter(variants.values())), file)
        console.print(f"picture: {file}")


if __name__ == "__main__":
    main()
