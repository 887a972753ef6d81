"""The document `comfort.md`: how much of the time planners keep to what is comfortable.

`python -m experiments.evidence.comfort FOLDER... -o docs/comfort.md` reads folders of
the sweeps `comfort_cruise` and `comfort_dense`, or of parts of them, and runs nothing.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from experiments.comparison.results import Row
from experiments.errors import ConfigError
from experiments.evidence.document_command import write_from_sweeps
from experiments.evidence.first_look import first_look
from experiments.evidence.shares import percent, share
from experiments.metrics import columns
from experiments.metrics.comfort import COMFORTABLE_BRAKING, COMFORTABLE_SIDEWAYS

LABEL = "label"
DENSITY = "traffic.density"
CONFIDENCE = 0.95
LATERAL_MOST = 3.0  # that the lateral acceleration never exceeds [m/s²]
JERK_MOST = 5.0  # lateral and along the path, means over half a second [m/s³]
ROUNDING = 1e-3  # by which a limit may be exceeded


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit that each run keeps or does not."""

    words: str
    column: str
    most: float


TIMES = (
    (f"time with abs. a_lat ≤ {COMFORTABLE_SIDEWAYS} m/s²", columns.LATERAL_DISCOMFORT),
    (f"time with braking ≤ {COMFORTABLE_BRAKING} m/s²", columns.BRAKING_DISCOMFORT),
)
LIMITS = (
    Limit(
        f"runs with abs. a_lat ≤ {LATERAL_MOST:g} m/s²",
        columns.MAX_LATERAL_ACCELERATION,
        LATERAL_MOST,
    ),
    Limit(
        f"runs with lateral jerk ≤ {JERK_MOST:g} m/s³",
        columns.MAX_LATERAL_JERK,
        JERK_MOST,
    ),
    Limit(
        f"runs with jerk along the path ≤ {JERK_MOST:g} m/s³",
        columns.MAX_TANGENTIAL_JERK,
        JERK_MOST,
    ),
    Limit("runs without an emergency", columns.EMERGENCY_CYCLES, 0.0),
)
INTRODUCTION = """# How comfortably the planners drive

Written by `python -m experiments.evidence.comfort` (`make comfort-docs`) from finished
runs of the sweeps `comfort_cruise` and `comfort_dense`; nothing is typed in by hand.
Shares of the time are means over the runs, each run counting once, with their 95 %
interval by Student's t, cut off at 100 %; shares of runs have Wilson's interval. Jerks
are means over half a second. An emergency is a cycle of emergency braking. All shares
are of the runs that drove: an ego that found no room to enter has no comfort.
"""


def document(found: Sequence[Row]) -> str:
    """Write the document.

    Args:
        found: Rows of the runs.

    Raises:
        ConfigError: If there are none.
    """
    if not found:
        raise ConfigError(
            "there are no runs; allowed: folders of the sweeps comfort_cruise, "
            "comfort_dense"
        )
    seeds = sorted({int(row[columns.SEED]) for row in found})
    parts = [
        INTRODUCTION,
        f"{len(found)} runs, seeds {seeds[0]} to {seeds[-1]}. What is not there was "
        "not driven.\n",
        *first_look(seeds),
    ]
    for label in dict.fromkeys(str(row[LABEL]) for row in found):
        parts += _chapter([row for row in found if row[LABEL] == label], label)
    return "\n".join(parts)


def _chapter(found: Sequence[Row], label: str) -> Iterator[str]:
    """Write the table of one planner: a column for each limit, a row for each road."""
    names = [*(words for words, _ in TIMES), *(limit.words for limit in LIMITS)]
    yield f"## `{label}`\n"
    counts = ("road", "density", "runs", "drove", "arrived", "collided")
    yield f"| {' | '.join([*counts, *names])} |"
    yield "|" + "---|" * (len(counts) + len(names))
    places = {(str(row[columns.SCENARIO]), _density(row)) for row in found}
    for road, density in sorted(places):
        here = [
            row
            for row in found
            if (str(row[columns.SCENARIO]), _density(row)) == (road, density)
        ]
        yield _line(f"`{road}`", density, here)
    if len(places) > 1:
        yield _line("all", "", found)
    yield ""


def _density(row: Row) -> str:
    """Return the density of the traffic; that of the scenario is not named."""
    return str(row.get(DENSITY) or "-")


def _line(road: str, density: str, here: Sequence[Row]) -> str:
    """Write one row of a table."""
    arrived = sum(bool(row[columns.ARRIVED]) for row in here)
    collided = sum((row[columns.COLLISIONS] or 0) > 0 for row in here)
    driven = [row for row in here if row[columns.MAX_LATERAL_ACCELERATION] is not None]
    counts = (len(here), len(driven), arrived, collided)
    cells = [road, density, *map(str, counts)]
    cells += [_time_share(driven, column) for _, column in TIMES]
    cells += [_run_share(driven, limit) for limit in LIMITS]
    return f"| {' | '.join(cells)} |"


def _time_share(here: Sequence[Row], column: str) -> str:
    """Write the share of the time within a limit, and its interval."""
    kept = 1.0 - np.array([row[column] for row in here if row[column] is not None])
    if not kept.size:
        return "-"
    mean = float(kept.mean())
    if kept.size == 1:
        return f"{100.0 * mean:.2f} %"
    error = float(kept.std(ddof=1)) / np.sqrt(kept.size)
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, kept.size - 1)) * error
    return percent(mean, max(mean - half, 0.0), min(mean + half, 1.0))


def _run_share(here: Sequence[Row], limit: Limit) -> str:
    """Write the share of the runs that keep a limit, and its interval."""
    most = [row[limit.column] for row in here if row[limit.column] is not None]
    return share(sum(x <= limit.most + ROUNDING for x in most), len(most))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_from_sweeps`."""
    return write_from_sweeps("comfort", __doc__, document, arguments)


if __name__ == "__main__":
    sys.exit(main())
