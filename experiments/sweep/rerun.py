"""Repeat one run of a sweep with its full trace."""

import shlex
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.config.planner_modules import ALLOW_PLANNER
from experiments.config.scenario_file import CONFIG_FILE, load_scenario
from experiments.config.sweep import KeepTraces
from experiments.episode.identity import run_hashes
from experiments.errors import ConfigError, ResultsError
from experiments.interrupts import interrupts_between_steps
from experiments.storage.run_files import MANIFEST, read_manifest
from experiments.sweep.executors.executor import POLL_INTERVAL, WorkerSettings
from experiments.sweep.executors.local import LocalExecutor
from experiments.sweep.folder import (
    LOG,
    RERUNS,
    load_sweep_copy,
    require_sweep,
    run_folders,
)
from experiments.sweep.plan import net_file_of
from experiments.sweep.task import RunReport, RunTask, record_failure


@dataclass(frozen=True, slots=True)
class Repeated:
    """Outcome of a repeated run."""

    folder: Path
    same: bool
    verdict: str


def repeat(folder: Path, run_id: str, allow_planners: Collection[str] = ()) -> Repeated:
    """Repeat a run of a sweep in an isolated process.

    Args:
        folder: Of the sweep.
        run_id: Of the run, or how it begins.
        allow_planners: Modules of users' planners that may be run.

    Returns:
        Where the new run folder is, and whether the trace hash is the same.

    Raises:
        ConfigError: If there is no such run, or several.
    """
    folder = folder.absolute()
    require_sweep(folder)
    run = find_run(folder, run_id)
    before = read_manifest(run)
    task = _task(folder, run, before, allow_planners)
    sweep = load_sweep_copy(folder)
    settings = WorkerSettings(sweep.memory_mb, folder / LOG, Path.cwd())
    with interrupts_between_steps() as check_interrupt:
        executor = LocalExecutor(settings, workers=1)
        try:
            executor.submit(task)
            while (report := executor.next_report(POLL_INTERVAL)) is None:
                check_interrupt()
        finally:
            executor.stop()
    return _judged(before, report)


def find_run(folder: Path, run_id: str) -> Path:
    """Find a run by the beginning of its id."""
    found = [run for run in run_folders(folder) if run.name.startswith(run_id)]
    if len(found) == 1:
        return found[0]
    if not found:
        raise ConfigError(f"{run_id}: no such run in {folder}")
    names = ", ".join(run.name for run in found[:3])
    raise ConfigError(f"{run_id}: begins {len(found)} ids ({names}, ...); allowed: one")


def _task(
    folder: Path, run: Path, before: dict[str, Any], allow_planners: Collection[str]
) -> RunTask:
    """Build the task, which keeps its trace."""
    config = str(run / CONFIG_FILE)
    scenario = load_scenario(config, allow_planners=allow_planners)
    sweep = load_sweep_copy(folder)
    hashes = run_hashes(scenario, net_file_of(scenario))
    command = ["rearview", "rerun", str(folder), run.name]
    for module in allow_planners:
        command += [ALLOW_PLANNER, module]
    return RunTask(
        run_id=run.name,
        config=scenario.resolved(),
        folder=folder / RERUNS / run.name,
        keep_traces=KeepTraces.ALL,
        timeout=sweep.timeout_s,
        facts={**hashes, "sweep": before.get("sweep"), "command": shlex.join(command)},
        full_statistics=before.get("full_statistics", True),  # for an equal hash
    )


def _judged(before: dict[str, Any], report: RunReport) -> Repeated:
    """Compare with the original run."""
    if report.worth_retrying:
        report = record_failure(report)
    if not (report.task.folder / MANIFEST).exists():
        raise ResultsError(report.reason)
    now = read_manifest(report.task.folder)
    outcome = f"{now['status']}: {now.get('reason')}"
    known = bool(before.get("trace_hash") and now.get("trace_hash"))
    key = "trace_hash" if known else "failure"
    same = now.get(key) == before.get(key)
    if not known:
        words = "no trace, as before" if same else f"before: {before['status']}"
    elif same:
        words = "identical trace"
    elif before.get("code_hash") != now.get("code_hash"):
        words = "the trace differs, and so does the version of the code"
    else:
        words = "the trace differs"
    return Repeated(report.task.folder, same, f"{outcome} ({words})")
