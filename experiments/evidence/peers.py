"""The document `peers.md`: planners of others and ours in the same traffic.

`python -m experiments.evidence.peers FOLDER... -o docs/peers.md` reads folders of the
sweep `peers`, or of parts of it, and runs nothing.
"""

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from experiments.comparison.compare import Line, Question, compare
from experiments.comparison.results import Row
from experiments.config.sweep_file import load_sweep
from experiments.cosim.records import EpisodeStatus
from experiments.errors import ConfigError
from experiments.evidence.differences import difference_words
from experiments.evidence.document_command import write_from_sweeps
from experiments.evidence.first_look import first_look
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS

SWEEP = "peers"
OURS = "route"
DENSITY = "traffic.density"
LABEL = "label"
MEASURED = (
    columns.MIN_CLEARANCE,
    columns.RMS_JERK,
    columns.TRAVEL_TIME,
    columns.PLANNING_CPU_P50,
)
INTRODUCTION = f"""# Ours and others in the same traffic

Written by `python -m experiments.evidence.peers` (`make peers-docs`) from finished runs
of the sweep `peers`; nothing is typed in by hand. All planners drive the same roads,
seeds and vehicles. `{OURS}` is ours; what the adapter of the others had to assume
stands in [Planners of others](planners/peers.md), and their figures are figures of it
too. A difference is that from `{OURS}` on common seeds, with its 95 % interval; numbers
are means over the runs in which they apply.
"""


def document(found: Sequence[Row]) -> str:
    """Write the document.

    Args:
        found: Rows of the runs.

    Raises:
        ConfigError: If there are none, or none of `OURS`.
    """
    if not found:
        raise ConfigError("there are no runs; allowed: folders of the sweep peers")
    labels = _ours_first(str(row[LABEL]) for row in found)
    if OURS not in labels:
        raise ConfigError(f"no run is of {OURS}, with which the others are compared")
    seeds = sorted({int(row[columns.SEED]) for row in found})
    densities = sorted({str(row[DENSITY]) for row in found})
    parts = [
        INTRODUCTION,
        f"{len(found)} of the {load_sweep(SWEEP)[0].count} runs of the sweep, "
        f"seeds {', '.join(map(str, seeds))}, density {', '.join(densities)}. What is "
        "not there was not driven.\n",
        *first_look(seeds),
        "## In all\n",
        *_totals(found, labels),
        "",
        *_worse(found, labels),
    ]
    for density in densities:
        parts += _chapter([x for x in found if str(x[DENSITY]) == density], density)
    return "\n".join(parts) + "\n"


def _ours_first(labels: Iterable[str]) -> list[str]:
    """Return the labels, each once."""
    return sorted(set(labels), key=lambda label: (label != OURS, label))


def _totals(found: Sequence[Row], labels: Sequence[str]) -> Iterator[str]:
    """Write how the runs of each planner ended."""
    statuses = [str(status) for status in EpisodeStatus]
    met = [x for x in statuses if any(str(r[columns.STATUS]) == x for r in found)]
    shown = [name.replace("_", " ") for name in met]
    yield f"| planner | runs | {' | '.join(shown)} |"
    yield f"|---|---|{'---|' * len(met)}"
    for label in labels:
        own = [row for row in found if row[LABEL] == label]
        count = Counter(str(row[columns.STATUS]) for row in own)
        cells = " | ".join(str(count[name]) for name in met)
        yield f"| `{label}` | {len(own)} | {cells} |"


def _worse(found: Sequence[Row], labels: Sequence[str]) -> Iterator[str]:
    """Say on which roads another planner arrives more often, or collides less."""
    lines, left_out = [], []
    for road in dict.fromkeys(str(row[columns.SCENARIO]) for row in found):
        own = _counts(found, road, OURS)
        others = {x: _counts(found, road, x) for x in labels if x != OURS}
        left_out += [
            f"- `{road}`: `{x}` {one[0]} runs, `{OURS}` {own[0]}"
            for x, one in others.items()
            if one[0] != own[0]
        ]
        others = {x: one for x, one in others.items() if one[0] == own[0]}
        more = [x for x, one in others.items() if one[1] > own[1]]
        fewer = [x for x, one in others.items() if one[2] < own[2]]
        if more:
            shown = ", ".join(f"`{x}` {others[x][1]}" for x in more)
            lines.append(f"- `{road}`: {own[1]} of {own[0]} arrive, of {shown}")
        if fewer:
            shown = ", ".join(f"`{x}` {others[x][2]}" for x in fewer)
            lines.append(f"- `{road}`: {own[2]} of {own[0]} collide, of {shown}")
    if lines:
        yield f"Where another planner arrives more often than `{OURS}`,"
        yield "or collides in fewer runs, of as many:\n"
        yield from lines
    else:
        yield f"On no road does another planner arrive more often than `{OURS}`,"
        yield "or collide in fewer runs."
    if left_out:
        yield "\nLeft out of that, since they have another number of runs:\n"
        yield from left_out
    yield ""


def _counts(found: Sequence[Row], road: str, label: str) -> tuple[int, int, int]:
    """Return (runs, arrived, collided) of a planner on a road."""
    runs = [r for r in found if str(r[columns.SCENARIO]) == road and r[LABEL] == label]
    arrived = sum(bool(row[columns.ARRIVED]) for row in runs)
    collided = sum(row[columns.STATUS] == EpisodeStatus.COLLISION for row in runs)
    return len(runs), arrived, collided


def _chapter(found: Sequence[Row], density: str) -> Iterator[str]:
    """Write the table of one density."""
    question = Question(OURS, MEASURED, by=[columns.SCENARIO])
    lines = compare(found, question)
    names = [METRICS[name].label_with_unit for name in MEASURED]
    yield f"## Density {density}\n"
    column = f"difference of {METRICS[columns.TRAVEL_TIME].label}"
    yield f"| road | planner | arrived | collided | {' | '.join(names)} | {column} |"
    yield f"|---|---|---|---|{'---|' * (len(names) + 1)}"
    for road in dict.fromkeys(str(row[columns.SCENARIO]) for row in found):
        labels = _ours_first(
            str(r[LABEL]) for r in found if str(r[columns.SCENARIO]) == road
        )
        for number, label in enumerate(labels):
            runs, arrived, collided = _counts(found, road, label)
            own = {x.metric: x for x in lines if (x.label, x.where) == (label, road)}
            cells = [_value(own.get(name), name) for name in MEASURED]
            apart, interval = difference_words(own.get(columns.TRAVEL_TIME))
            difference = f"{apart} ({interval})" if interval else apart
            first = f"`{road}`" if number == 0 else ""
            yield (
                f"| {first} | `{label}` | {arrived} of {runs} | {collided} | "
                f"{' | '.join(cells)} | {difference} |"
            )
    yield ""


def _value(line: Line | None, name: str) -> str:
    """Write a mean."""
    known = line is not None and line.value is not None
    return METRICS[name].text(line.value.value) if known else "-"  # type: ignore[union-attr]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_from_sweeps`."""
    return write_from_sweeps("peers", __doc__, document, arguments)


if __name__ == "__main__":
    sys.exit(main())
