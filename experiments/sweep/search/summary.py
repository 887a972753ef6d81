"""What a search has found, as plain data for its file and lines for a terminal."""

import dataclasses
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.config.axes import Point
from experiments.config.search import Search
from experiments.sweep.rerun_command import rerun_command
from experiments.sweep.search.clusters import FailureCluster
from experiments.sweep.search.coverage import SpaceCoverage
from experiments.sweep.search.exploration import SearchTrial
from experiments.sweep.search.files import (
    FOUND,
    PROBABILITY,
    STOPS,
    probability_words,
    shown,
)
from experiments.sweep.search.reduction import Reduced
from experiments.sweep.search.subset_simulation import SubsetEstimate


@dataclass(frozen=True, slots=True)
class SearchFindings:
    """Everything that a search has found."""

    search: Search
    mild: Point
    mild_fails: bool
    trials: Sequence[SearchTrial]
    clusters: Sequence[FailureCluster]
    reduced: Sequence[Reduced]  # of the first clusters
    coverage: SpaceCoverage
    against: Sequence[SearchTrial] | None = None  # at random
    probability: SubsetEstimate | None = None  # of a failure, by subset simulation

    @property
    def first_failure(self) -> int | None:
        """Number of the first trial that failed."""
        return first_failure(self.trials)


def first_failure(trials: Sequence[SearchTrial]) -> int | None:
    """Return the number of the first failed trial; None without one."""
    return next((trial.number for trial in trials if trial.failed), None)


def replay_command(folder: Path, run_id: str | None, planner: str | None = None) -> str:
    """Return the command that repeats a run; empty without a run."""
    if run_id is None:
        return ""
    return rerun_command(str(folder), [] if planner is None else [planner], run_id)


def as_plain(found: SearchFindings, folder: Path) -> dict[str, Any]:
    """Return the content of `search.json`."""
    search, cover = found.search, found.coverage
    return {
        "name": search.name,
        "method": search.method,
        "objective": search.objective.model_dump(mode="json"),
        "budget": search.budget,
        STOPS: search.stop_after_failures,
        "trials": [_trial(trial) for trial in found.trials],
        "failures": sum(trial.failed for trial in found.trials),
        "invalid": sum(trial.is_void for trial in found.trials),
        "first_failure": found.first_failure,
        "mild": {"point": found.mild, "fails": found.mild_fails},
        "clusters": [
            _cluster(found, k, cluster, folder)
            for k, cluster in enumerate(found.clusters)
        ],
        "coverage": {
            "pair_cells": cover.cells,
            "pair_cells_hit": cover.hit,
            "share": cover.pairs,
            "centred_discrepancy": cover.discrepancy,
        },
        "against": None if found.against is None else _against(found.against),
        PROBABILITY: None
        if found.probability is None
        else dataclasses.asdict(found.probability),
    }


def _cluster(
    found: SearchFindings, k: int, cluster: FailureCluster, folder: Path
) -> dict[str, Any]:
    """Return one group of failures as plain data."""
    planner = found.search.planner.name
    worst = cluster.worst
    mildest = found.reduced[k] if k < len(found.reduced) else None
    return {
        "kind": cluster.kind,
        "choices": choices_of(found.search, worst.point),
        "failures": len(cluster.trials),
        "trials": [trial.number for trial in cluster.trials],
        "worst": {
            **_trial(worst),
            "command": replay_command(folder, worst.run_id, planner),
        },
        "mildest": None
        if mildest is None
        else {
            "point": mildest.point,
            "robustness": mildest.robustness,
            "run_id": mildest.run_id,
            "runs": mildest.runs,
            "command": replay_command(folder, mildest.run_id, planner),
        },
    }


def _trial(trial: SearchTrial) -> dict[str, Any]:
    """Return a trial as plain data."""
    return {
        "number": trial.number,
        "run_id": trial.run_id,
        "point": trial.point,
        "robustness": trial.judgement.robustness,
        "failure": trial.judgement.kind or None,
    }


def _against(trials: Sequence[SearchTrial]) -> dict[str, Any]:
    """Return the random search as plain data."""
    return {
        "method": "random",
        "trials": len(trials),
        "failures": sum(trial.failed for trial in trials),
        "first_failure": first_failure(trials),
    }


def table_lines(found: SearchFindings, folder: Path) -> list[str]:
    """Return the lines of the table at the end of a search."""
    trials = found.trials
    failures = sum(trial.failed for trial in trials)
    invalid = sum(trial.is_void for trial in trials)
    first = found.first_failure
    lines = [
        f"{failures} of {len(trials) - invalid} trials failed"
        + ("" if first is None else f", first trial {first}")
    ]
    if invalid:
        counted = f"{invalid} more say" if invalid > 1 else "1 more says"
        lines.append(
            f"{counted} nothing: the scenario cannot be run so, or the objective does "
            "not apply; why:"
        )
        words = "SELECT status, reason, count(*) AS runs FROM runs GROUP BY ALL"
        lines.append(f'  rearview results {shlex.quote(str(folder))} --sql "{words}"')
    if found.mild_fails:
        also = "" if failures else ", though none of the trials does"
        lines.append(f"it fails at the mild values already{also}: {shown(found.mild)}")
    if found.probability is not None:
        lines.append(probability_line(found.probability))
    for k, cluster in enumerate(found.clusters):
        lines += _cluster_lines(found, k, cluster, folder)
        if k + 1 == max(found.search.reduce, 1):
            rest = len(found.clusters) - k - 1
            lines += [f"{rest} more groups: {folder / FOUND}"] if rest else []
            break
    cover, even = found.coverage, found.coverage.discrepancy
    lines.append(
        f"coverage: {cover.pairs:.0%} of {cover.cells} cells of two keys each"
        + ("" if even is None else f", discrepancy {even:.2g}")
    )
    return lines


def _cluster_lines(
    found: SearchFindings, k: int, cluster: FailureCluster, folder: Path
) -> list[str]:
    """Return the lines of one group of failures."""
    planner = found.search.planner.name
    count = len(cluster.trials)
    chosen = shown(choices_of(found.search, cluster.worst.point))
    named = f"{cluster.kind}, {chosen}" if chosen else cluster.kind
    lines = [f"{named}: {count} trial" + ("s" if count > 1 else "")]
    worst = cluster.worst
    rows = [("worst", worst.point, worst.judgement.robustness, worst.run_id)]
    if k < len(found.reduced):
        mildest = found.reduced[k]
        rows.append(("mildest", mildest.point, mildest.robustness, mildest.run_id))
    for name, point, value, run_id in rows:
        number = "" if value is None else f" ({value:.2f})"
        lines.append(f"  {name}{number}: {shown(point)}")
        lines.append(f"    {replay_command(folder, run_id, planner)}")
    return lines


def choices_of(search: Search, point: Mapping[str, Any]) -> Point:
    """Return the values of a point that are choices: a group shares them."""
    return {k: point[k] for k, one in search.space.items() if one.choice is not None}


def probability_line(found: SubsetEstimate) -> str:
    """Say how probable a failure is."""
    levels = f"{len(found.levels)} level" + ("s" if len(found.levels) > 1 else "")
    words = probability_words(found.probability, found.low, found.high)
    of = "of " if found.probability else ""
    return f"a failure has a probability {of}{words}, {levels}"
