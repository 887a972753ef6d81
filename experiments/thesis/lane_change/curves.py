"""Study of [Thesis] 6.3.4: curve models for a lane change.

`python -m experiments.thesis.lane_change.curves` prints the table and the claims.
"""

import math

from rich.console import Console
from rich.table import Table

from experiments.thesis.lane_change.curve_comparison import (
    CurveComparison,
    LaneShift,
    compare_curves,
)

COLUMNS = (
    ("length", "length m", 3),
    ("jumps", "jumps of curvature inside", 0),
    ("largest_jump", "largest of them 1/m", 5),
    ("start_curvature", "curvature at the start 1/m", 5),
    ("end_curvature", "curvature at the end 1/m", 5),
    ("peak_curvature", "peak curvature 1/m", 5),
    ("peak_rate", "peak curvature rate 1/m²", 6),
    ("cost_printed", "eq. 6.11 without ds", 3),
    ("cost_turning", "eq. 6.11 with ds", 3),
    ("cost", "∫k² ds and length", 3),
)


def curve_table(comparison: CurveComparison, task: LaneShift) -> Table:
    """Tabulate the measures, one column a model."""
    title = (
        f"Lane change of {task.shift:g} m over {task.length:g} m, C at "
        f"{task.spline_c:g} m, Dubins R = {task.dubins_radius:g} m"
    )
    table = Table(title=title)
    table.add_column("")
    for name in comparison.measures:
        table.add_column(name, justify="right")
    for column, words, digits in COLUMNS:
        values = (getattr(m, column) for m in comparison.measures.values())
        table.add_row(words, *(_number(value, digits) for value in values))
    return table


def claim_table(comparison: CurveComparison) -> Table:
    """Tabulate the claims of 6.3.4."""
    table = Table(title="What 6.3.4 says")
    table.add_column("claim")
    table.add_column("holds")
    table.add_column("measured")
    for claim in comparison.claims:
        table.add_row(claim.text, "yes" if claim.holds else "no", claim.evidence)
    return table


def _number(value: float, digits: int) -> str:
    """Write a number; infinite where a jump leaves no rate."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "inf"


def main(console: Console | None = None) -> None:
    """Print the study."""
    console = console or Console(highlight=False, width=110)
    task = LaneShift()
    comparison = compare_curves(task)
    console.print(curve_table(comparison, task))
    console.print(
        f"As lines they are at most {comparison.apart:.2f} m apart (Fig. 6.2: no "
        "significant difference).\n"
    )
    console.print(claim_table(comparison))


if __name__ == "__main__":
    main()
