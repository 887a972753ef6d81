"""Runs of a sweep chosen for a comparison, repeated where no trace was kept."""

import math
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from experiments.cli.report_commands import write_page
from experiments.comparison.results import (
    ALL_RUNS,
    LABEL,
    RUN_ID,
    Row,
    axis_columns,
    rows,
)
from experiments.config.counted import counted
from experiments.config.scenario_file import CONFIG_FILE, load_scenario
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.fleet_catalogue import EGOS_DRIVEN
from experiments.metrics.metric import Better, CellKind
from experiments.sweep.folder import RERUNS, load_sweep_copy, run_folder
from experiments.sweep.rerun import find_run, repeat
from experiments.trace.files import file_name

MOST = 8  # runs on one page
SHOWN = 5  # seeds in a message


def chosen_runs(
    folder: Path,
    ids: Sequence[str],
    seed: int | None,
    where: str | None,
    worst: str | None,
) -> list[str]:
    """Choose runs of a sweep: by id, by seed, or by the largest loss in a metric.

    Returns:
        Ids; planners in the order of the sweep file.

    Raises:
        ConfigError: If nothing, too little or too much is chosen.
    """
    given = [bool(ids), seed is not None, worst is not None]
    if sum(given) != 1:
        raise ConfigError(
            f"{folder}: is a sweep; allowed with it: ids of runs, --seed, or --worst"
        )
    if ids:
        names = [find_run(folder, run_id).name for run_id in ids]
        everything = rows(folder)
        _refuse_many(folder, [row for row in everything if row[RUN_ID] in names])
        return names
    condition = f" WHERE {where}" if where else ""
    found = rows(folder, f"{ALL_RUNS}{condition}", "--where")
    order = {p.shown: k for k, p in enumerate(load_sweep_copy(folder).variants)}
    if worst is not None:
        chosen, words = _worst(found, worst, list(order))
        sys.stderr.write(f"{words}\n")
    else:
        chosen = [row for row in found if row[columns.SEED] == seed]
        if not chosen:
            seeds = sorted({int(row[columns.SEED]) for row in found})
            raise ConfigError(
                f"--seed {seed}: no run has it; there are "
                + ", ".join(map(str, seeds[:SHOWN]))
                + (" ..." if len(seeds) > SHOWN else "")
                if seeds
                else "--where: no run meets it"
            )
    if not 2 <= len(chosen) <= MOST:  # noqa: PLR2004
        raise ConfigError(
            f"{counted(len(chosen), 'run')} chosen; allowed: 2 to {MOST}; "
            "--where chooses among them: \"scenario = 'curved'\""
        )
    _refuse_many(folder, chosen)
    chosen = sorted(chosen, key=lambda row: order.get(_label(row), len(order)))
    return [str(row[RUN_ID]) for row in chosen]


def _refuse_many(folder: Path, chosen: Sequence[Row]) -> None:
    """Raise ConfigError if a run has many egos: the page replays one of each run."""
    for row in chosen:
        if row[EGOS_DRIVEN] is not None:
            own = run_folder(folder, str(row[RUN_ID]))
            raise ConfigError(
                f"{folder}: its runs have many egos; allowed: runs with one ego; "
                f"a run's own page: rearview report {own}"
            )


def with_traces(
    folder: Path, ids: Sequence[str], allow_planners: Collection[str]
) -> list[Path]:
    """Return run folders with traces, repeating runs that kept none."""
    found = []
    runs = [find_run(folder, run_id) for run_id in ids]
    for run in runs:  # is refused before anything is repeated
        load_scenario(str(run / CONFIG_FILE), allow_planners=allow_planners)
    for own in runs:
        again = folder / RERUNS / own.name
        kept = [run for run in (own, again) if (run / file_name("steps")).is_file()]
        if kept:
            found.append(kept[0])
            continue
        sys.stderr.write(f"repeating {own.name} with its trace\n")
        repeated = repeat(folder, own.name, allow_planners).folder
        write_page(repeated)
        found.append(repeated)
    return found


def _worst(
    found: Sequence[Row], metric: str, labels: Sequence[str]
) -> tuple[list[Row], str]:
    """Find the drives of one seed in which a planner loses most against the first.

    Not arriving loses more than any value.
    """
    known = METRICS.get(metric)
    if known is None or known.kind is CellKind.TEXT or known.better is Better.NEITHER:
        allowed = [
            name
            for name, one in METRICS.items()
            if one.better is not Better.NEITHER and not one.identity
        ]
        raise ConfigError(
            f"--worst {metric}: is no metric with a better direction; "
            f"{unknown_name(metric, allowed)}"
        )
    if len(labels) == 1:
        raise ConfigError(
            f"--worst {metric}: {labels[0]} is the only planner; allowed: a sweep with "
            "two, or ids of runs"
        )
    groups: dict[tuple[str, ...], list[Row]] = {}
    axes = axis_columns(list(found[0])) if found else []
    for row in found:
        key = tuple(str(row[k]) for k in (columns.SCENARIO, columns.SEED, *axes))
        groups.setdefault(key, []).append(row)
    sign = 1.0 if known.better is Better.LOWER else -1.0
    best: tuple[float, list[Row], str] | None = None
    for group in groups.values():
        base = next((r for r in group if _label(r) == labels[0]), None)
        for row in group:
            if base is None or row is base:
                continue
            loss = _loss(base, row, metric, sign)
            if best is None or loss > best[0]:
                shown = (
                    "did not arrive"
                    if loss == math.inf
                    else f"{metric} {sign * loss:+.4g} against {labels[0]}"
                )
                words = f"seed {row[columns.SEED]}: {_label(row)} {shown}"
                best = loss, group, words
    if best is None:
        raise ConfigError(f"--worst {metric}: no run of {labels[0]} to compare with")
    return best[1], best[2]


def _loss(base: Row, row: Row, metric: str, sign: float) -> float:
    """Return how much worse a run is than that of the first planner."""
    if bool(base[columns.ARRIVED]) and not row[columns.ARRIVED]:
        return math.inf
    one: Any = base[metric]
    other: Any = row[metric]
    if one is None or other is None:
        return -math.inf
    return sign * (float(other) - float(one))


def _label(row: Row) -> str:
    """Return the label of the planner of a row."""
    return str(row[LABEL] or row[columns.PLANNER])
