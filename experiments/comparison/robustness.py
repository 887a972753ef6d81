"""`docs/robustness.md`: what imperfect vehicles and eyes cost, from a sweep."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.comparison.inference import tango
from experiments.comparison.results import Row, axis_columns, query, rows
from experiments.errors import ConfigError
from experiments.metrics.verdict.records import Fault

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
EGO_FAULT = (str(Fault.EGO), str(Fault.SHARED))
# heading -> SQL over the runs of a row, digits
MEASURES = {
    "runs": ("count(*)", 0),
    "arrived [%]": ("100.0 * avg(CAST(arrived AS INT))", 0),
    "collided [%]": ("100.0 * avg(CAST(collisions > 0 AS INT))", 0),
    "its fault": (f"count(*) FILTER (verdict IN {EGO_FAULT})", 0),
    "min clearance [m]": ("min(min_clearance_m)", 2),
    "RMS jerk [m/s³]": ("avg(rms_jerk_mps3)", 2),
    "lateral error [m]": ("max(tracking_lateral_max_m)", 2),
    "plans anew": ("sum(plans_anew)", 0),
}
# headings over all roads; the difference is that of arrivals on common runs
IN_ALL = ("runs", "arrived", "difference [pp], 95 %", "collided", "its fault")
PERFECT = {"-", "perfect", "0"}  # what an axis says of a perfect vehicle or eyes
Point = tuple[str, ...]
Pair = tuple[Any, ...]
LEAST_VALUES = 3  # of an axis over which a curve is drawn


@dataclass(frozen=True, slots=True)
class DegradationCurve:
    """What wears off along one axis, all other axes at their most frequent value."""

    axis: str
    scenario: str
    planner: str
    values: tuple[float, ...]  # on the axis, rising
    measures: tuple[tuple[Any, ...], ...]  # of each value, in the order of MEASURES


HEAD = """# Robustness

What it costs the planners that the ego has mass, tyres, slow hands, eyes that miss
things and a planner that takes time. Each row is on the same seeds. Without a plant
the ego is where its plan says; `tube` tells whether plans keep the plant's measured
errors clear. `rearview robustness SWEEP -o FILE` writes this file from a sweep such
as `robustness`, `robustness_dense` or `perception`; clearance is the smallest of all
runs, the lateral error the largest, jerk the mean. *Its fault* counts the runs whose
first contact the ego could have avoided and had to, alone or with the other, and those
in which it left the road. [Vehicles and eyes](vehicles_and_eyes.md) explains models and
presets.
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
        parts.append(_in_all(folder, axes, names))
        groups = query(
            folder, "SELECT DISTINCT scenario, planner FROM runs ORDER BY ALL"
        ).fetchall()
        for scenario, planner in groups:
            own = [
                curve
                for curve in degradation_curves(folder)
                if (curve.scenario, curve.planner) == (scenario, planner)
            ]
            if own:
                parts.append(f"\n## One axis at a time: {scenario}, {planner}\n")
                parts += [_curve_table(curve) for curve in own]
            else:
                parts.append(f"\n## {scenario}, {planner}\n\n")
                parts.append(_table(folder, axes, scenario, planner))
    return "".join(parts)


def _in_all(folder: Path, axes: Sequence[str], names: Sequence[str]) -> str:
    """Compare every point of a sweep with perfect vehicle and eyes, over all roads.

    Args:
        folder: Of the sweep.
        axes: Of it, those of `AXES`.
        names: Of all columns.

    Returns:
        A table, or nothing if the sweep has no runs with perfect ones.
    """
    others = [name for name in axis_columns(names) if name not in axes]
    shared = ["scenario", "label", "seed", *others]
    points: dict[Point, dict[Pair, Row]] = {}
    for row in rows(folder):
        if row["arrived"] is None:  # lost before it had metrics
            continue
        point = tuple(_point_word(row[axis]) for axis in axes)
        pair = tuple(row[name] for name in shared)
        points.setdefault(point, {})[pair] = row
    base = next((point for point in points if set(point) <= PERFECT), None)
    if base is None:
        return ""
    heads = [*(AXES[axis] for axis in axes), *IN_ALL]
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    for point in sorted(points, key=lambda p: (p != base, p)):
        cells = [*point, *_against(points[base], points[point])]
        lines.append(f"| {' | '.join(cells)} |")
    return f"\n## {folder.name}, in all\n\n" + "\n".join(lines) + "\n"


def _point_word(value: Any) -> str:
    """Return the value of an axis in words, - for none."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return "-" if value is None else f"{value:g}" if is_number else str(value)


def _against(perfect: Mapping[Pair, Row], runs: Mapping[Pair, Row]) -> list[str]:
    """Return the cells of `IN_ALL`: runs of a point beside the perfect ones."""
    common = perfect.keys() & runs.keys()
    both = [(bool(perfect[k]["arrived"]), bool(runs[k]["arrived"])) for k in common]
    gained, lost = both.count((False, True)), both.count((True, False))
    difference = "-"
    if common and perfect is not runs:
        found = tango(gained, lost, len(common))
        difference = (
            f"{100 * found.value:+.1f} [{100 * found.low:.1f}, {100 * found.high:.1f}]"
        )
    arrived = sum(bool(row["arrived"]) for row in runs.values())
    hit = sum((row["collisions"] or 0) > 0 for row in runs.values())
    fault = sum(row["verdict"] in EGO_FAULT for row in runs.values())
    share = f"{arrived} ({100 * arrived / len(runs):.1f} %)"
    return [str(len(runs)), share, difference, str(hit), str(fault)]


def degradation_curves(folder: Path) -> list[DegradationCurve]:
    """Compute how each numeric axis of a sweep wears on the measures.

    Along an axis, the others are at their most frequent value: at the point from which
    a sweep such as `perception` varies one at a time. Curves are there only where no
    other axis is without numbers.

    Raises:
        ResultsError: If results cannot be read.
    """
    names = query(folder).columns
    axes = [axis for axis in AXES if axis in names]
    found = rows(folder)
    numeric = all(
        isinstance(row[axis], int | float) and not isinstance(row[axis], bool)
        for axis in axes
        for row in found
    )
    if not (axes and found and numeric):
        return []
    base = {
        axis: Counter(row[axis] for row in found).most_common(1)[0][0] for axis in axes
    }
    groups = sorted({(str(row["scenario"]), str(row["planner"])) for row in found})
    curves = [
        _curve(folder, axis, base, group)
        for group in groups
        for axis in axes
        if len({row[axis] for row in found}) >= LEAST_VALUES
    ]
    return [curve for curve in curves if len(curve.values) > 1]


def _curve(
    folder: Path, axis: str, base: Row, group: tuple[str, str]
) -> DegradationCurve:
    """Compute one curve."""
    scenario, planner = group
    values = ", ".join(sql for sql, _ in MEASURES.values())
    others = "".join(f' AND "{k}" = {v!r}' for k, v in base.items() if k != axis)
    found = query(
        folder,
        f"SELECT \"{axis}\", {values} FROM runs WHERE scenario = '{scenario}' "
        f"AND planner = '{planner}'{others} GROUP BY \"{axis}\" ORDER BY ALL",
    ).fetchall()
    return DegradationCurve(
        axis,
        scenario,
        planner,
        tuple(float(row[0]) for row in found),
        tuple(tuple(row[1:]) for row in found),
    )


def _curve_table(curve: DegradationCurve) -> str:
    """Write the table of one curve."""
    digits = [digits for _, digits in MEASURES.values()]
    lines = [
        f"| {' | '.join([AXES[curve.axis], *MEASURES])} |",
        f"|{'---|' * (1 + len(MEASURES))}",
    ]
    for value, measures in zip(curve.values, curve.measures, strict=True):
        numbers = [_number(m, n) for m, n in zip(measures, digits, strict=True)]
        lines.append(f"| {' | '.join([f'{value:g}', *numbers])} |")
    return "\n" + "\n".join(lines) + "\n"


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
