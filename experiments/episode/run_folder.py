"""The run folder of an episode: its name, and what is written into it."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any

from experiments.config import Scenario
from experiments.config.base import LONGEST_NAME
from experiments.config.scenario_file import CONFIG_FILE, config_text
from experiments.cosim.records import Ending
from experiments.episode.newest_run import ENDED
from experiments.episode.without_ego import SharedTraffic
from experiments.metrics.metric import MeasuredEpisode
from experiments.metrics.moments import moments_beside_the_trace
from experiments.metrics.row import Cell, metric_row
from experiments.planners.registry import user_module
from experiments.storage.run_files import MANIFEST, METRICS, write_json
from experiments.trace.files import write_trace
from experiments.trace.schema import SCHEMA_VERSION, Table, Trace, trace_hash
from experiments.world_setup.traffic import TRAFFIC_FILE

ID_LENGTH = 8  # characters of the run's hash in the folder's name


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """The results of a run."""

    ending: Ending
    row: dict[str, Cell]
    trace_hash: str
    folder: Path


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeOutcome(Outcome):
    """The results of an episode with one ego."""

    trace: Trace


@dataclass(frozen=True, slots=True)
class OutputOptions:
    """Place and content of a run folder."""

    target: Path | None = None  # instead of the usual name
    keeps_trace: Callable[[Ending], bool] = lambda _: True
    facts: Mapping[str, Any] = field(default_factory=dict)  # for the manifest
    keeps_candidates: bool = False  # of the cycles, and s-T graphs, with the trace
    # count in every cycle what each check removes; else planners are faster, and the
    # trace and its hash lack these counts
    full_statistics: bool = True
    shared: SharedTraffic | None = None  # of the runs before, of the same process


@dataclass(frozen=True, slots=True)
class RunOutput:
    """A run folder that is being filled."""

    aside: Path  # where it is filled
    target: Path  # where it will be
    options: OutputOptions
    started: float  # of the run, by perf_counter [s]


def folder_name(scenario: Scenario, run_hash: str) -> str:
    """Return the name of a run folder: `<scenario>-<planner>-<seed>-<hash>`."""
    planner = "".join(
        c if c.isalnum() or c in "_." else "_" for c in scenario.driven_by
    )
    seed = scenario.simulation.seed
    # of a planner's name so much as a folder's name has room for; the hash tells it
    shown = planner[:LONGEST_NAME]
    return f"{scenario.name}-{shown}-{seed}-{run_hash[:ID_LENGTH]}"


def write_run(
    scenario: Scenario,
    identity: Mapping[str, Any],
    ending: Ending,
    trace: Trace,
    output: RunOutput,
    runs_without_ego: Sequence[Table | None] = (),
) -> EpisodeOutcome:
    """Compute the metrics of an episode and write its files.

    Args:
        scenario: Checked.
        identity: See `run_identity`.
        ending: How the episode ended.
        trace: Of the episode.
        output: The folder.
        runs_without_ego: Vehicles in the same traffic without the ego, and those of its
            placebo, as far as they were run.

    Returns:
        The outcome.
    """
    limits = scenario.ego.vehicle.limits.to_planner()
    recorded = scenario.world == "commonroad"
    row = metric_row(trace, *runs_without_ego, limits=limits, recorded_traffic=recorded)
    measured = MeasuredEpisode(trace, next(iter(runs_without_ego), None), limits)
    hashed = trace_hash(trace)
    moments: Mapping[str, Any] = {}
    if output.options.keeps_trace(ending):
        write_trace(trace, output.aside)
        moments = moments_beside_the_trace(measured)
    write_folder(scenario, identity, ending, hashed, row, output, moments)
    return EpisodeOutcome(ending, row, hashed, output.target, trace)


def write_folder(
    scenario: Scenario,
    identity: Mapping[str, Any],
    ending: Ending,
    hashed: str,
    row: Mapping[str, Cell],
    output: RunOutput,
    moments: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Write the files that a run has beside its trace.

    Args:
        scenario: Checked.
        identity: See `run_identity`.
        ending: How the run ended.
        hashed: Hash of its trace.
        row: Its metrics.
        output: The folder.
        moments: That are kept beside the trace.
    """
    kept = output.options.keeps_trace(ending)
    if not kept:
        (output.aside / TRAFFIC_FILE).unlink(missing_ok=True)
    command = ["rearview", "run", f"{output.target}/{CONFIG_FILE}"]
    manifest = {
        **identity,
        "trace_schema": SCHEMA_VERSION,
        "trace_hash": hashed,
        "status": str(ending.status),
        "reason": ending.reason,
        "trace_kept": kept,
        "moments": dict(moments),
        "wall_s": perf_counter() - output.started,
        ENDED: datetime.now(UTC).isoformat(),
        "command": shlex.join(
            [*command, *_allowance(scenario), "--out", str(output.target.parent)]
        ),
        **output.options.facts,
    }
    write_files(output.aside, row, manifest, scenario.resolved())


def write_files(
    folder: Path,
    row: Mapping[str, Cell],
    manifest: Mapping[str, Any],
    config: Mapping[str, Any],
) -> None:
    """Write the files that every run folder has.

    Args:
        folder: Exists.
        row: Metrics of the run.
        manifest: What the run was made from, and how it ended.
        config: The resolved scenario.
    """
    write_json(folder / METRICS, row)
    write_json(folder / MANIFEST, manifest)
    (folder / CONFIG_FILE).write_text(config_text(config), encoding="utf-8")


def _allowance(scenario: Scenario) -> list[str]:
    """Return the options without which users' planners are refused in a file."""
    named = {choice.name for _, choice in scenario.planner_choices()}
    modules = sorted({module for name in named if (module := user_module(name))})
    return [word for module in modules for word in ("--allow-planner", module)]
