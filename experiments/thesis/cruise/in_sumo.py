"""Chapter 4 again, in SUMO among traffic."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.episode.run import run_episode
from experiments.episode.run_folder import OutputOptions
from experiments.errors import SimulationError
from experiments.metrics import columns
from experiments.sweep.processes.parallel import Work
from experiments.thesis.claims import Claim, Number, ResultTable, Share, shown
from experiments.thesis.cruise.random_layouts import ROADS
from experiments.thesis.effort import Effort

PRINTED = ("cruise_thesis", "cruise_thesis_conventional")
CLOSED_LOOP = ("cruise", "cruise_conventional")
NAMES = {
    "cruise_thesis": "proposed as printed",
    "cruise_thesis_conventional": "conventional as printed",
    "cruise": "proposed, closed loop",
    "cruise_conventional": "conventional, closed loop",
}
REASONS = {
    "offset": "where traffic decides the side, the offset term decides less",
    "jerk": "to come back to the centre line after every obstacle takes steering, "
    "which the conventional cost spares by staying aside",
}
SUMO = "seeds in SUMO with traffic"


@dataclass(frozen=True, slots=True)
class Episode:
    """Definition of one episode."""

    scenario: str
    planner: str
    seed: int
    overrides: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SumoOutcome:
    """Result of an episode."""

    status: str
    contacts: int
    jerk: float | None  # mean J_jerk [m²/s⁵]
    offset: float | None  # mean J_offset [m²]

    @property
    def arrived(self) -> bool:
        """Whether the ego arrived."""
        return self.status == EpisodeStatus.ARRIVED


@dataclass(frozen=True, slots=True)
class TrafficPart:
    """Results for the chapter."""

    claims: tuple[Claim, ...]
    tables: tuple[ResultTable, ...]
    missing: tuple[str, ...]


def episode(asked: Episode) -> SumoOutcome:
    """Drive one episode without leaving files."""
    scenario = load_scenario(
        asked.scenario,
        planner=asked.planner,
        seed=asked.seed,
        overrides=asked.overrides,
    )
    with tempfile.TemporaryDirectory() as folder:
        output = OutputOptions(Path(folder) / "run", keeps_trace=lambda _: False)
        row = run_episode(scenario, output=output).row
    jerk, offset = row[columns.MEAN_J_JERK], row[columns.MEAN_J_OFFSET]
    return SumoOutcome(
        str(row[columns.STATUS]),
        int(row[columns.COLLISIONS] or 0),
        None if jerk is None else float(jerk),
        None if offset is None else float(offset),
    )


def traffic_part(effort: Effort, work: Work) -> TrafficPart:
    """Drive the four roads in SUMO, all planners on the same seeds."""
    if effort.traffic_seeds == 0:
        return TrafficPart((), (), ("SUMO with traffic: left out by --quick",))
    try:
        load_libsumo()
    except SimulationError as error:
        return TrafficPart((), (), (f"SUMO with traffic: {error}",))
    planners = (*PRINTED, *CLOSED_LOOP)
    seeds = range(effort.traffic_seeds)
    keys = list(product(ROADS, planners, seeds))
    done = work.map("SUMO with traffic", episode, [Episode(*key) for key in keys])
    found = dict(zip(keys, done, strict=True))
    return TrafficPart(_claims(found, seeds), (_table(found, planners, seeds),), ())


def _claims(
    found: dict[tuple[str, str, int], SumoOutcome], seeds: Sequence[int]
) -> tuple[Claim, ...]:
    """Check Table 4.2 among traffic, as printed and in closed loop."""
    claims = []
    for kind, (ours, theirs) in (("printed", PRINTED), ("closed loop", CLOSED_LOOP)):
        pairs = [
            (found[road, ours, seed], found[road, theirs, seed])
            for road in ROADS
            for seed in seeds
        ]
        for field in ("offset", "jerk"):
            both = [
                (getattr(a, field), getattr(b, field))
                for a, b in pairs
                if a.arrived and b.arrived
            ]
            mean = {
                name: shown(float(np.mean([pair[k] for pair in both])))
                for k, name in enumerate(("proposed", "conventional"))
                if both
            }
            claims.append(
                Claim(
                    f"4.2_sumo_{kind.replace(' ', '_')}_{field}",
                    "Table 4.2",
                    f"in SUMO with traffic, {kind}: the proposed method has the lower "
                    f"mean J_{field}",
                    {},
                    {"episodes": len(both), **mean},
                    None,
                    Share.count((a < b for a, b in both), f"{SUMO} both arrived in"),
                    REASONS[field],
                    "SUMO, four roads",
                )
            )
    return tuple(claims)


def _table(
    found: dict[tuple[str, str, int], SumoOutcome],
    planners: Sequence[str],
    seeds: Sequence[int],
) -> ResultTable:
    """Tabulate how the episodes ended."""
    rows = tuple(
        (road, NAMES[planner], *_summary([found[road, planner, s] for s in seeds]))
        for road in ROADS
        for planner in planners
    )
    return ResultTable(
        "cruise_sumo",
        "The four roads in SUMO with traffic",
        ("road", "planner", *HEADER),
        rows,
        "As printed: manoeuvres of 4 to 5 s to one target speed, one disc of 1 m, "
        "which is not the car that SUMO drives. Here they are told where vehicles "
        "will be, which the thesis does not do.",
    )


HEADER = ("runs", "arrived", "with a contact", "J_offset m²", "J_jerk m²/s⁵")


def _summary(runs: Sequence[SumoOutcome]) -> tuple[Number | str, ...]:
    """Count and average; a dash where nothing was planned."""
    cells: list[Number | str] = [
        len(runs),
        sum(run.arrived for run in runs),
        sum(run.contacts > 0 for run in runs),
    ]
    for field in ("offset", "jerk"):
        values = [getattr(r, field) for r in runs if getattr(r, field) is not None]
        cells.append(shown(float(np.mean(values))) if values else "-")
    return tuple(cells)
