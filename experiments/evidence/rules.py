"""The document `rules.md`: right of way on the shipped networks.

`python -m experiments.evidence.rules FOLDER... -o docs/rules.md` reads folders of the
sweep `rules`, or of parts of it, and runs nothing.
"""

import sys
from collections.abc import Iterable, Iterator, Sequence
from statistics import mean, median

from experiments.comparison.results import LABEL, REASON, Row
from experiments.config.self_driven import SELF_DRIVEN
from experiments.errors import ConfigError
from experiments.evidence.document_command import write_from_sweeps
from experiments.evidence.first_look import first_look
from experiments.evidence.run_outcomes import COUNTED, came_to_goal
from experiments.evidence.shares import share
from experiments.metrics import columns

INTRODUCTION = """# Rules of the road

Written by `python -m experiments.evidence.rules` (`make rules-docs`) from finished runs
of the sweep `rules`; nothing is typed in by hand. SUMO's own driver meets the same
traffic on the same seeds. *Arrived* is the share of runs whose ego came to its goal,
with its 95 % interval by Wilson; *collided* counts runs with a contact, whoever caused
it, *line violations* and *encroachments* runs with at least one. The waiting time is
the mean over the runs, travel time over those that arrived on the road, PET at
junctions the median of the runs in which the ego and another have used the same zone.
What the columns are stands in [Metrics](reference/metrics.md). In turns SUMO's driver
keeps the speed of the lane inside the junction, which is set for a higher lateral
acceleration than the comfort that ours keeps to: that alone makes ours slower there.
"""


def document(found: Sequence[Row]) -> str:
    """Write the document.

    Args:
        found: Rows of the runs.

    Raises:
        ConfigError: If there are none.
    """
    if not found:
        raise ConfigError("there are no runs; allowed: folders of the sweep rules")
    seeds = sorted({int(row[columns.SEED]) for row in found})
    names = [*(words for words, _ in COUNTED), "gave way [s]", "PET [s]", "time [s]"]
    parts = [
        INTRODUCTION,
        f"{len(found)} runs, seeds {seeds[0]} to {seeds[-1]}. What is not there was "
        "not driven.\n",
        *first_look(seeds),
        f"| network | driver | runs | arrived | {' | '.join(names)} |",
        "|---" * (4 + len(names)) + "|",
    ]
    for road in dict.fromkeys(str(row[columns.SCENARIO]) for row in found):
        here = [row for row in found if row[columns.SCENARIO] == road]
        labels = dict.fromkeys(str(row[LABEL]) for row in here)
        parts += [_line(road, [row for row in here if row[LABEL] == x]) for x in labels]
    return "\n".join([*parts, *_failures(found)]) + "\n"


def _line(road: str, here: Sequence[Row]) -> str:
    """Write the line of a network and a driver."""
    arrived = sum(map(came_to_goal, here))
    times = _known(here, columns.TRAVEL_TIME)
    cells = [f"`{road}`", f"`{here[0][LABEL]}`", str(len(here))]
    cells.append(share(arrived, len(here)))
    cells += [_count(here, column) for _, column in COUNTED]
    waits = _known(here, columns.GAVE_WAY)
    cells.append(f"{mean(waits):.1f}" if waits else "-")
    apart = _known(here, columns.JUNCTION_PET)
    cells.append(f"{median(apart):.1f}" if apart else "-")
    cells.append(f"{mean(times):.1f}" if times else "-")
    return f"| {' | '.join(cells)} |"


def _known(here: Iterable[Row], column: str) -> list[float]:
    """Return the values that are there."""
    return [float(row[column]) for row in here if row[column] is not None]


def _count(here: Sequence[Row], column: str) -> str:
    """Count the runs with a value above 0; `-` where the driver has no such values."""
    values = _known(here, column)
    return str(sum(value > 0.0 for value in values)) if values else "-"


def _failures(found: Sequence[Row]) -> Iterator[str]:
    """List what went wrong in runs of planners of ours."""
    failed = [
        row
        for row in found
        if str(row[LABEL]) not in SELF_DRIVEN and not row[columns.ARRIVED]
    ]
    if failed:
        yield "\nRuns of ours that did not arrive without a contact, on the road:\n"
    for row in failed:
        verdict = f"; {row[columns.VERDICT]}" if row[columns.VERDICT] else ""
        yield (
            f"- `{row[columns.SCENARIO]}`, seed {row[columns.SEED]}, `{row[LABEL]}`: "
            f"{row[columns.STATUS]}: {row[REASON]}{verdict}"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_from_sweeps`."""
    return write_from_sweeps("rules", __doc__, document, arguments)


if __name__ == "__main__":
    sys.exit(main())
