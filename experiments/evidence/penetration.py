"""The document `penetration.md`: what egos make of traffic, from finished sweeps.

`python -m experiments.evidence.penetration FOLDER... -o docs/penetration.md` reads the
folders of sweeps whose planners are penetrations, and runs nothing.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from experiments.comparison.compare import Line, Question, compare
from experiments.comparison.results import rows
from experiments.errors import ConfigError
from experiments.evidence.differences import difference_words
from experiments.evidence.document_command import write_document
from experiments.metrics.catalogue import METRICS
from experiments.sweep.folder import load_sweep_copy

SHOWN = (
    "all_mean_speed_mps",
    "all_speed_deviation_mps",
    "flow_veh_per_h",
    "all_delay_s_per_km",
    "all_stops_per_km",
    "all_hard_brakings_per_km",
    "all_string_ratio",
    "all_fuel_g_per_km",
    "egos_failed",
)
# sweep -> what was published about such an experiment; figures, and where they stand
PUBLISHED = {
    "penetration_ring": "Stern et al. 2018 (arXiv:1705.01693) report for one "
    "automated car on a circle of 260 m: standard deviation of speed -80.8 %, fuel "
    "-42.5 %, hard brakings -98.6 %, flow +14.1 %. Sugiyama et al. 2008: 22 cars on "
    "230 m make waves.",
    "penetration_platoon": "Gunter et al. 2019 (arXiv:1902.04983) find commercial ACC "
    "string unstable: a ratio above 1.",
    "penetration_bottleneck": "Calvert et al. 2017 (JAT 3082781) find a small negative "
    "effect of low shares of low-level automation, and a gain only above 70 %.",
    "penetration_merge": "Treiber and Helbing 2002 find, with 20 % of assisted IDM "
    "cars on the A8, hardly any congestion left.",
}
INTRODUCTION = """# Many egos: what a planner makes of traffic

Written by `python -m experiments.evidence.penetration` (`make penetration-docs`) from
finished sweeps; nothing is typed in by hand. Each line is the mean over the seeds;
*difference* is that from the runs without an ego on the same seeds, with its 95 %
interval. How the columns are defined stands in [Metrics](reference/metrics.md), how a
scenario says which vehicles are egos in [Scenario
files](reference/scenario_files.md#many-egos).
"""


def document(folders: Sequence[Path]) -> str:
    """Write the document.

    Args:
        folders: Of sweeps, in order.

    Raises:
        ConfigError: If a folder is of no sweep with a baseline, or has no runs.
        ResultsError: If a folder cannot be read.
    """
    parts = [INTRODUCTION]
    for folder in folders:
        parts += _chapter(folder)
    return "\n".join(parts)


def _chapter(folder: Path) -> Iterator[str]:
    """Write the chapter of one sweep."""
    sweep = load_sweep_copy(folder)
    if sweep.claim is None:
        raise ConfigError(f"{folder}: its sweep has no claim; allowed: one with it")
    found = rows(folder)
    question = Question(sweep.claim.baseline, SHOWN, sweep.claim.primary)
    lines = compare(found, question)
    seeds = len({row["seed"] for row in found})
    statuses = [str(row["status"]) for row in found]
    bad = len(statuses) - statuses.count("arrived")
    yield f"## {sweep.name}\n"
    yield f"{sweep.purpose}\n"
    yield f"{len(found)} runs, {seeds} seeds; {bad} runs with an ego that failed.\n"
    if sweep.name in PUBLISHED:
        yield f"Published: {PUBLISHED[sweep.name]}\n"
    yield "| metric | drivers | mean | difference | 95 % interval | change |"
    yield "|---|---|---|---|---|---|"
    base: dict[str, float] = {}
    for line in lines:
        if line.value is not None and line.label == question.baseline:
            base[line.metric] = line.value.value
        yield _row(line, base.get(line.metric))
    yield ""


def _row(line: Line, base: float | None) -> str:
    """Write one line of a table."""
    metric = METRICS[line.metric]
    cells = [metric.label_with_unit, line.label]
    cells.append("-" if line.value is None else metric.text(line.value.value))
    difference, interval = difference_words(line)
    share = ""
    if line.difference is not None:
        interval = interval or "too few seeds"
        share = f"{100.0 * line.difference.value / base:+.0f} %" if base else ""
    cells += [difference, interval, share]
    return f"| {' | '.join(cells)} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_document`."""
    parser = argparse.ArgumentParser(prog="penetration", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, help="of finished sweeps")
    return write_document(parser, lambda options: document(options.folders), arguments)


if __name__ == "__main__":
    sys.exit(main())
