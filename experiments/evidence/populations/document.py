"""The document `populations.md`: who else drives, and whether that changes the order.

`python -m experiments.evidence.populations.document FOLDER -o docs/populations.md` runs
SUMO with the traffic of each population alone, and reads the folder of the sweep
`populations`, finished or not.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from experiments.comparison.compare import PENALTY_FACTOR
from experiments.comparison.inference import wilson
from experiments.comparison.location import LEAST_VALUES
from experiments.comparison.results import LABEL, Row, rows
from experiments.errors import ConfigError
from experiments.evidence.document_command import write_document
from experiments.evidence.first_look import first_look
from experiments.evidence.populations.ranking import (
    POPULATION,
    RANKED,
    flips,
    rankings,
    share_of,
)
from experiments.evidence.populations.traffic import (
    FOLLOWING,
    HARD,
    LASTS,
    SCENARIO,
    SHORT_TTC,
    sample_traffic,
    summary,
)
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.sweep.folder import load_sweep_copy
from sumo_nets.driver_population import POPULATIONS

DENSITIES = ("medium", "dense")
SEEDS = 5
FIGURES = {  # key of `summary` -> title and format
    "low": ("time gap, 10 % [s]", "{:.2f}"),
    "median": ("median", "{:.2f}"),
    "high": ("90 %", "{:.2f}"),
    "below_1_s": ("below 1 s", "{:.1%}"),
    "variation": ("variation", "{:.2f}"),
    "short_ttc": (f"TTC < {SHORT_TTC:g} s", "{:.2%}"),
    "hard_per_100_km": (f"braking > {HARD:g} m/s² [1/100 km]", "{:.1f}"),
    "speed": ("mean speed [m/s]", "{:.1f}"),
    "distance": ("driven [km]", "{:.0f}"),
}
HEADER = f"""# Who else drives: populations of drivers

Written by `python -m experiments.evidence.populations.document`; nothing is typed in by
hand. What a population is stands in
[Scenario files](reference/scenario_files.md#populations-and-errors).

## The traffic itself

SUMO alone with the traffic of `{SCENARIO}` (three lanes, limit 60 km/h), {LASTS:g} s of
each seed after the warm-up. Time gaps, bumper to bumper over the follower's speed, are
of vehicles that follow: a gap of at most {FOLLOWING:g} s, 5 m/s and more, one sample a
second; *variation* is their standard deviation over their mean, *TTC* the share of
samples with a shorter one.
"""
PUBLISHED = """Published, to compare with: the time gap `T` of IDM fitted to cars on
motorways lies between 0.8 and 1.6 s (Treiber and Kesting, Traffic Flow Dynamics, 2013);
gaps that are kept are longer than `T`. Steady-state time gaps of single drivers vary by
up to 64 % of their mean (naturalistic driving on the Dulles airport road, Washington,
168,053 samples). Two seconds are advised, and many keep less (SWOV fact sheet, Headway
times and road safety). No published figure for hard braking or TTC uses these
definitions: those columns compare the populations with each other.
"""


def document(folder: Path, seeds: int = SEEDS) -> str:
    """Write the document.

    Args:
        folder: Of the sweep.
        seeds: Of the traffic by itself.

    Raises:
        ConfigError: If the sweep has no populations.
    """
    parts = [HEADER, *_traffic(seeds), "", PUBLISHED, *_ranking(folder)]
    return "\n".join(parts)


def _traffic(seeds: int) -> Iterator[str]:
    """Write the table of the traffic itself."""
    titles = [title for title, _ in FIGURES.values()]
    yield f"| density | population | {' | '.join(titles)} |"
    yield "|---" * (len(titles) + 2) + "|"
    for density in DENSITIES:
        for population in POPULATIONS:
            samples = [sample_traffic(population, s, density) for s in range(seeds)]
            found = summary(samples)
            cells = [text.format(found[key]) for key, (_, text) in FIGURES.items()]
            yield f"| {density} | {population} | {' | '.join(cells)} |"


def _ranking(folder: Path) -> Iterator[str]:
    """Write what the populations make of the order of planners."""
    found = [row for row in rows(folder) if row.get(columns.STATUS) is not None]
    if not found or POPULATION not in found[0]:
        raise ConfigError(f"{folder}: is no sweep over {POPULATION}; allowed: one")
    sweep = load_sweep_copy(folder)
    seeds = {int(row[columns.SEED]) for row in found}
    yield "\n## The order of planners\n"
    yield f"Sweep `{sweep.name}`: {len(found)} runs finished, {len(seeds)} seeds.\n"
    yield from first_look(seeds)
    yield from _endings(found)
    for metric in RANKED:
        yield from _ranked(found, metric)


def _endings(found: Sequence[Row]) -> Iterator[str]:
    """Write how many arrive, and whose fault contacts are."""
    labels = list(dict.fromkeys(str(row[LABEL]) for row in found))
    yield "Runs of all relaxations are pooled here.\n"
    yield f"| arrived, of all runs (95 %: Wilson) | {' | '.join(labels)} |"
    yield "|---" * (len(labels) + 1) + "|"
    for population in POPULATIONS:
        cells = []
        for label in labels:
            count, of = share_of(found, population, label, columns.ARRIVED, value=True)
            if not of:
                cells.append("-")
                continue
            share = wilson(count, of)
            fault = "ego at fault"
            own, _ = share_of(found, population, label, columns.VERDICT, value=fault)
            words = f"{count} of {of} ({share.low:.0%} to {share.high:.0%})"
            cells.append(words + (f", {own} at fault" if own else ""))
        yield f"| {population} | {' | '.join(cells)} |"
    yield ""


def _ranked(found: Sequence[Row], metric: str) -> Iterator[str]:
    """Write the order by one metric."""
    cells = rankings(found, metric)
    if not cells:
        return
    yield f"### {METRICS[metric].label_with_unit}\n"
    if metric == columns.TRAVEL_TIME:
        yield (
            f"Who does not arrive counts {PENALTY_FACTOR:g} times the longest time of "
            "the row.\n"
        )
    yield "| relaxation [s] | population | order, best first: mean (95 %) | seeds |"
    yield "|---|---|---|---|"
    for cell in cells:
        named = []
        for label, found_mean in zip(cell.order, cell.means, strict=True):
            low, high = found_mean.low, found_mean.high
            ends = f" ({low:.2f} to {high:.2f})" if found_mean.known else ""
            named.append(f"{label} {found_mean.value:.2f}{ends}")
        row = [f"{cell.relaxation:g}", cell.population, "; ".join(named)]
        yield f"| {' | '.join(row)} | {cell.seeds} |"
    changes = flips(found, metric)
    yield ""
    if not any(one.known for cell in cells for one in cell.means):
        yield f"Too few seeds for intervals (at least {LEAST_VALUES}): no finding.\n"
    elif not changes:
        yield (
            "No two planners change places between populations with differences that "
            "are no chance on both sides (5 %, Holm over all pairs and rows).\n"
        )
    for one in changes:
        yield (
            f"- {one.first} is better than {one.second} among {one.better}, worse "
            f"among {one.worse} (relaxation {one.relaxation:g} s)"
        )
    if changes:
        yield ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_document`."""
    parser = argparse.ArgumentParser(prog="populations", description=__doc__)
    parser.add_argument("folder", type=Path, help="of the sweep `populations`")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of the traffic alone")
    return write_document(
        parser,
        lambda options: document(options.folder, options.seeds).rstrip() + "\n",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
