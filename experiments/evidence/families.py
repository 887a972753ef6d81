"""The document `families.md`: one driver for a route beside those made for one road.

`python -m experiments.evidence.families FOLDER... -o docs/families.md` reads folders of
the sweeps `families_*`, or of parts of them, and runs nothing.
"""

import sys
from collections.abc import Iterator, Sequence

from experiments.comparison.compare import Question, compare
from experiments.comparison.results import LABEL, Row
from experiments.errors import ConfigError
from experiments.evidence.differences import difference_words
from experiments.evidence.document_command import write_from_sweeps
from experiments.evidence.first_look import first_look
from experiments.evidence.run_outcomes import COUNTED
from experiments.evidence.shares import share
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS

ONE_DRIVER = "route"
MEASURED = (
    columns.TRAVEL_TIME,
    columns.RMS_JERK,
    columns.MAX_LATERAL_ACCELERATION,
    columns.MIN_CLEARANCE,
)
INTRODUCTION = f"""# One driver beside three families

Written by `python -m experiments.evidence.families` (`make families-docs`) from
finished runs of the sweeps `families_*`; nothing is typed in by hand. On each road,
`{ONE_DRIVER}`, which drives everywhere, meets the planner that was made for that kind
of road, in the same traffic and among the same obstacles on the same seeds. *Arrived*
is the share of runs with its 95 % interval by Wilson; numbers are means over the runs
in which they apply, differences those of `{ONE_DRIVER}` from the family on common
seeds, with their 95 % interval, and p values are corrected by Holm over the roads of a
family.
"""


def document(found: Sequence[Row]) -> str:
    """Write the document.

    Args:
        found: Rows of the runs.

    Raises:
        ConfigError: If there are none, or a road without both planners.
    """
    if not found:
        raise ConfigError(
            "there are no runs; allowed: folders of the sweeps families_*"
        )
    seeds = sorted({int(row[columns.SEED]) for row in found})
    counted = " | ".join(words for words, _ in COUNTED[:2])
    names = " | ".join(METRICS[name].label_with_unit for name in MEASURED)
    parts = [
        INTRODUCTION,
        f"{len(found)} runs, seeds {seeds[0]} to {seeds[-1]}. What is not there was "
        "not driven.\n",
        *first_look(seeds),
        f"| road | planner | runs | arrived | {counted} | {names} |",
        "|---" * (4 + len(COUNTED[:2]) + len(MEASURED)) + "|",
    ]
    for family, road, here in _places(found):
        for label in (family, ONE_DRIVER):
            own = [row for row in here if row[LABEL] == label]
            parts.append(f"| `{road}` | `{label}` | {_cells(own)} |")
    return "\n".join([*parts, "", *_differences(found)]) + "\n"


def _places(found: Sequence[Row]) -> Iterator[tuple[str, str, list[Row]]]:
    """Yield family, road and runs.

    Raises:
        ConfigError: If a road has not both planners.
    """
    for road in dict.fromkeys(str(row[columns.SCENARIO]) for row in found):
        here = [row for row in found if str(row[columns.SCENARIO]) == road]
        labels = {str(row[LABEL]) for row in here}
        families = sorted(labels - {ONE_DRIVER})
        if len(families) != 1 or ONE_DRIVER not in labels:
            raise ConfigError(
                f"{road}: has runs of {', '.join(sorted(labels))}; allowed: those of "
                f"{ONE_DRIVER} and of one other"
            )
        yield families[0], road, here


def _cells(own: Sequence[Row]) -> str:
    """Write what is counted and measured of one planner on one road."""
    arrived = sum(bool(row[columns.ARRIVED]) for row in own)
    cells = [str(len(own)), share(arrived, len(own))]
    cells += [str(sum((row[key] or 0) > 0 for row in own)) for _, key in COUNTED[:2]]
    for name in MEASURED:
        values = [float(row[name]) for row in own if row[name] is not None]
        mean = sum(values) / len(values) if values else None
        cells.append("-" if mean is None else METRICS[name].text(mean))
    return " | ".join(cells)


def _differences(found: Sequence[Row]) -> Iterator[str]:
    """Write what one driver costs or gains on each road."""
    by_family: dict[str, list[Row]] = {}
    for family, _, here in _places(found):
        by_family.setdefault(family, []).extend(here)
    yield f"## Differences of `{ONE_DRIVER}`\n"
    yield "| road | from | metric | seeds | difference | 95 % interval | p (Holm) |"
    yield "|---|---|---|---|---|---|---|"
    for family, rows in by_family.items():
        question = Question(family, MEASURED, by=[columns.SCENARIO])
        for line in compare(rows, question):
            if line.label != ONE_DRIVER or line.metric not in MEASURED:
                continue
            apart, interval = difference_words(line)
            if not apart:
                continue
            known = "-" if line.p_holm is None else f"{line.p_holm:.3g}"
            name = METRICS[line.metric].label_with_unit
            cells = (f"`{line.where}`", f"`{family}`", name, str(line.pairs))
            yield f"| {' | '.join((*cells, apart, interval, known))} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_from_sweeps`."""
    return write_from_sweeps("families", __doc__, document, arguments)


if __name__ == "__main__":
    sys.exit(main())
