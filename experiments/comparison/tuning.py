"""Chooses the lane-change parameters of SUMO's driver from a sweep over them.

`rearview sweep sumo_driver`, then `python -m experiments.comparison.tuning
sweeps/sumo_driver` writes the best ones for `sumo_tuned`, with all that they were
chosen among, into the project's data. Those of `sumo_sublane` come from the sweep of
that name, with `--out experiments/world_setup/tuned_sublane.json`.
"""

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.comparison.results import axis_columns, rows
from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from experiments.errors import ConfigError, ExperimentError
from experiments.metrics import columns
from experiments.world_setup.tuned_driver import TUNED_FILE

PREFIX = "planner.settings."  # of the axes of a sweep that vary settings
PENALTY = 180.0  # travel time of a run that does not arrive [s]
DEVELOPMENT = range(1000)  # seeds that settings may be chosen on


@dataclass(frozen=True, slots=True)
class Candidate:
    """Settings, and how they did over all seeds and traffic."""

    settings: Mapping[str, float]
    runs: int
    collided: int
    arrived: int
    travel_time: float  # mean, `PENALTY` for a run that does not arrive [s]
    braking_behind: float | None  # mean of the hardest braking of a follower [m/s²]

    @property
    def rank(self) -> tuple[float, ...]:
        """Order: collisions, arrivals, travel time, then distance from SUMO's own."""
        usual = SumoDriverSettings()
        changed = sum(
            abs(value - getattr(usual, name)) for name, value in self.settings.items()
        )
        return (self.collided, -self.arrived, self.travel_time, changed)


def candidates(table: Sequence[Mapping[str, Any]]) -> list[Candidate]:
    """Return the candidates of a sweep, the best first.

    Raises:
        ConfigError: If the sweep varies no settings, or has other seeds than those of
            development.
    """
    names = axis_columns(list(table[0])) if table else []
    varied = [name for name in names if name.startswith(PREFIX)]
    if not varied:
        raise ConfigError(f"the sweep varies no settings; allowed: {PREFIX}...")
    groups: dict[tuple[float, ...], list[Mapping[str, Any]]] = defaultdict(list)
    for row in table:
        if row[columns.SEED] not in DEVELOPMENT:
            raise ConfigError(
                f"the sweep has seed {row[columns.SEED]}; allowed: development seeds, "
                f"0 to {DEVELOPMENT[-1]}"
            )
        groups[tuple(row[name] for name in varied)].append(row)
    found = [
        _candidate(dict(zip(varied, values, strict=True)), group)
        for values, group in groups.items()
    ]
    return sorted(found, key=lambda candidate: candidate.rank)


def _candidate(
    settings: Mapping[str, float], group: Sequence[Mapping[str, Any]]
) -> Candidate:
    """Summarise the runs of one candidate."""
    times = [
        row[columns.TRAVEL_TIME] if row[columns.ARRIVED] else PENALTY for row in group
    ]
    braking = [
        row[columns.REAR_MAX_DECELERATION]
        for row in group
        if row[columns.REAR_MAX_DECELERATION] is not None
    ]
    return Candidate(
        {name.removeprefix(PREFIX): value for name, value in settings.items()},
        len(group),
        sum(1 for row in group if row[columns.COLLISIONS]),
        sum(1 for row in group if row[columns.ARRIVED]),
        sum(times) / len(times),
        sum(braking) / len(braking) if braking else None,
    )


def document(found: Sequence[Candidate], seeds: Sequence[int]) -> dict[str, Any]:
    """Return the content of the file of chosen settings."""
    return {
        "chosen_by": "collisions, then arrivals, then mean travel time, "
        f"{PENALTY:g} s for a run that does not arrive",
        "seeds": [min(seeds), max(seeds)],
        "settings": dict(found[0].settings),
        "candidates": [
            {
                "settings": dict(one.settings),
                "runs": one.runs,
                "collided": one.collided,
                "arrived": one.arrived,
                "travel_time_s": round(one.travel_time, 2),
                "braking_behind_mps2": one.braking_behind
                and round(one.braking_behind, 2),
            }
            for one in found
        ],
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Choose settings and write them; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sweep", type=Path, help="folder of the sweep")
    parser.add_argument("-o", "--out", type=Path, default=TUNED_FILE)
    asked = parser.parse_args(arguments)
    try:
        table = rows(asked.sweep)
        found = candidates(table)
    except ExperimentError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    content = document(found, [row[columns.SEED] for row in table])
    asked.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"{asked.out}: {content['settings']}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
