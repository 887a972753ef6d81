"""`docs/robustness.md`: what imperfect vehicles and eyes cost, from a sweep."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.comparison.results import query
from experiments.errors import ConfigError

# axis of the sweep -> heading of its column
AXES = {
    "ego.plant": "plant",
    "ego.actuators": "actuators",
    "ego.tube": "tube",
    "ego.perception": "perception",
    "ego.perception.latency_s": "latency [s]",
    "ego.perception.position_noise_m": "position noise [m]",
    "ego.perception.range_m": "range [m]",
    "simulation.planning_delay_s": "planning delay [s]",
}
# heading -> SQL over the runs of a row, digits
MEASURES = {
    "runs": ("count(*)", 0),
    "arrived [%]": ("100.0 * avg(CAST(arrived AS INT))", 0),
    "collided [%]": ("100.0 * avg(CAST(collisions > 0 AS INT))", 0),
    "min clearance [m]": ("min(min_clearance_m)", 2),
    "RMS jerk [m/s³]": ("avg(rms_jerk_mps3)", 2),
    "lateral error [m]": ("max(tracking_lateral_max_m)", 2),
    "plans anew": ("sum(plans_anew)", 0),
}
HEAD = """# Robustness

What it costs the planners that the ego has mass, tyres, slow hands, eyes that miss
things and a planner that takes time. Each row is on the same seeds. Without a plant
the ego is where its plan says; `tube` tells whether plans keep the plant's measured
errors clear. `rearview robustness SWEEP -o FILE` writes this file from a sweep such
as `robustness`, `robustness_dense` or `perception`; clearance is the smallest of all
runs, the lateral error the largest, jerk the mean. [Vehicles and
eyes](vehicles_and_eyes.md) explains models and presets.
"""


def robustness_page(folders: Sequence[Path]) -> str:
    """Write the page of sweeps over plants, actuators and perception.

    Raises:
        ConfigError: If a sweep has none of `AXES`.
        ResultsError: If results cannot be read.
    """
    parts = [HEAD]
    for folder in folders:
        names = query(folder).columns
        axes = [axis for axis in AXES if axis in names]
        if not axes:
            raise ConfigError(
                f"{folder}: has no axis of vehicle or perception; allowed: a sweep "
                f"over {', '.join(AXES)}"
            )
        groups = query(
            folder, "SELECT DISTINCT scenario, planner FROM runs ORDER BY ALL"
        ).fetchall()
        for scenario, planner in groups:
            parts.append(f"\n## {scenario}, {planner}\n\n")
            parts.append(_table(folder, axes, scenario, planner))
    return "".join(parts)


def _table(folder: Path, axes: Sequence[str], scenario: str, planner: str) -> str:
    """Write the table of one scenario and planner."""
    keys = ", ".join(f'CAST("{axis}" AS VARCHAR)' for axis in axes)
    values = ", ".join(sql for sql, _ in MEASURES.values())
    where = f"scenario = '{scenario}' AND planner = '{planner}'"
    rows = query(
        folder,
        f"SELECT {keys}, {values} FROM runs WHERE {where} GROUP BY {keys} ORDER BY ALL",
    ).fetchall()
    heads = [*(AXES[axis] for axis in axes), *MEASURES]
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    digits = [digits for _, digits in MEASURES.values()]
    for row in rows:
        names = [str(cell) if cell is not None else "-" for cell in row[: len(axes)]]
        numbers = [
            _number(cell, n) for cell, n in zip(row[len(axes) :], digits, strict=True)
        ]
        lines.append(f"| {' | '.join([*names, *numbers])} |")
    return "\n".join(lines) + "\n"


def _number(value: Any, digits: int) -> str:
    """Format a number, - for none."""
    return "-" if value is None else f"{value:.{digits}f}"
