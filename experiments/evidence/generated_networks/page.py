"""The document `generated_networks.md`: how planners get through strangers' networks.

`python -m experiments.evidence.generated_networks.page FOLDER... -o FILE` reads folders
of finished sweeps that `prepare` made, and runs nothing.
"""

import sys
from collections.abc import Iterator, Sequence
from types import MappingProxyType
from typing import Final

from experiments.comparison.results import LABEL, REASON, Row
from experiments.config.self_driven import SUMO
from experiments.errors import ConfigError
from experiments.evidence.document_command import write_from_sweeps
from experiments.evidence.first_look import first_look
from experiments.evidence.run_outcomes import COUNTED, came_to_goal
from experiments.evidence.shares import share
from experiments.metrics import columns

INTRODUCTION = """# On networks that nobody drew

Written by `python -m experiments.evidence.generated_networks.page` (`make
networks-docs`) from finished runs; nothing is typed in by hand. `netgenerate` makes
grids, spiders and random networks of all kinds of right of way, of one to three lanes,
some with turn lanes, some narrow, some for left-hand traffic. Street maps are random
towns in OpenStreetMap's format, converted as a user's map would be: streets that bend,
junctions at sharp angles and close together, dual carriageways, roundabouts, pockets
for turning, one-way streets, stop signs. The ego drives a random route of 300 m or less
among crossing, oncoming and own traffic; tours are random routes of 1 to 3 km through
the shipped `town`, for comparison. A route counts as drivable if SUMO's own driver, in
the same traffic, arrives on it. Shares have their 95 % interval by Wilson.
"""


TOURS: Final = "tours of `town`"
KINDS: Final = MappingProxyType(
    {"net": "netgenerate", "map": "street maps", "tour": TOURS}
)


def document(found: Sequence[Row]) -> str:
    """Write the document.

    Args:
        found: Rows of the runs.

    Raises:
        ConfigError: If there are none, or none of SUMO's driver.
    """
    if not found:
        raise ConfigError("there are no runs; allowed: folders of finished sweeps")
    drivable = {_place(row) for row in found if _is_by_sumo(row) and came_to_goal(row)}
    if not any(_is_by_sumo(row) for row in found):
        raise ConfigError(f"no run is by planner {SUMO}; allowed: sweeps with it")
    places = {_place(row) for row in found}
    seeds = sorted({int(row[columns.SEED]) for row in found})
    tours = {name for name, _ in places if KINDS.get(name.partition("_")[0]) == TOURS}
    names = {name for name, _ in places} - tours
    of_town = " and `town`" if tours else ""
    parts = [
        INTRODUCTION,
        f"{len(places)} routes on {len(names)} networks{of_town}; SUMO's driver "
        f"arrives on {len(drivable)}.\n",
        *first_look(seeds),
        "| networks | planner | of the drivable | share | of the others | "
        + " | ".join(f"runs: {words}" for words, _ in COUNTED)
        + " |",
        "|---" * (5 + len(COUNTED)) + "|",
    ]
    by: dict[tuple[str, str], list[Row]] = {}
    for row in found:
        if not _is_by_sumo(row):
            by.setdefault((_kind(row), str(row[LABEL])), []).append(row)
    parts += [_line(*names, rows, drivable) for names, rows in by.items()]
    for (kind, label), rows in by.items():
        parts += _failures(f"`{label}`, {kind},", rows, drivable)
    return "\n".join(parts) + "\n"


def _kind(row: Row) -> str:
    """Return what made the network of a run; other networks go by their own name."""
    name = str(row[columns.SCENARIO])
    return KINDS.get(name.partition("_")[0], f"`{name}`")


def _is_by_sumo(row: Row) -> bool:
    """Tell whether SUMO's own driver drove."""
    return str(row[LABEL]) == SUMO


def _place(row: Row) -> tuple[str, int]:
    """Return network and seed."""
    return str(row[columns.SCENARIO]), int(row[columns.SEED])


def _line(
    kind: str, name: str, found: Sequence[Row], drivable: set[tuple[str, int]]
) -> str:
    """Write the line of a planner on one kind of networks."""
    asked = [row for row in found if _place(row) in drivable]
    others = [row for row in found if _place(row) not in drivable]
    there, n = sum(map(came_to_goal, asked)), len(asked)
    cells = [kind, f"`{name}`", f"{there} of {n}", share(there, n)]
    cells.append(f"{sum(map(came_to_goal, others))} of {len(others)}")
    cells += [str(sum((row[key] or 0) > 0 for row in found)) for _, key in COUNTED]
    return f"| {' | '.join(cells)} |"


def _failures(
    name: str, found: Sequence[Row], drivable: set[tuple[str, int]]
) -> Iterator[str]:
    """List the drivable routes on which a planner does not arrive, and why."""
    failed = [row for row in found if _place(row) in drivable and not came_to_goal(row)]
    if not failed:
        return
    yield f"\n{name} does not arrive on:\n"
    for row in failed:
        road, seed = _place(row)
        verdict = row[columns.VERDICT]
        words = f"; {verdict}" if verdict else ""
        yield f"- `{road}`, seed {seed}: {row[columns.STATUS]}: {row[REASON]}{words}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_document`."""
    return write_from_sweeps("generated_networks.page", __doc__, document, arguments)


if __name__ == "__main__":
    sys.exit(main())
