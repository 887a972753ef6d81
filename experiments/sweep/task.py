"""Task and report of one run of a sweep."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from experiments.config.sweep import KeepTraces
from experiments.cosim.records import EpisodeStatus
from experiments.episode.run_folder import write_files
from experiments.errors import ResultsError, in_one_line
from experiments.metrics.row import row_without_episode
from experiments.storage.atomic_folder import atomic_folder


class Failure(StrEnum):
    """Why a run has no complete episode."""

    PROCESS_DIED = "process_died"
    WALL_CLOCK = "wall_clock"
    MEMORY = "memory"
    PROCESSES = "processes"  # too many of them
    LOST_WORKER = "lost_worker"
    INVALID = "invalid_configuration"
    ERROR = "error"  # internal
    # no row, the sweep stops:
    DISK = "disk"  # nothing could be written
    OTHER_CODE = "other_code"  # the worker has another version than the sweep


@dataclass(frozen=True, slots=True)
class RunTask:
    """Everything a worker needs, as plain data."""

    run_id: str
    config: Mapping[str, Any]  # the resolved scenario
    folder: Path  # of the run, absolute
    keep_traces: KeepTraces
    timeout: float  # [s]
    facts: Mapping[str, Any]  # for the manifest
    attempt: int = 1
    full_statistics: bool = True  # see `OutputOptions`

    def again(self) -> "RunTask":
        """Return the task of the next attempt."""
        return replace(self, attempt=self.attempt + 1)


@dataclass(frozen=True, slots=True)
class RunReport:
    """Outcome of a run for the sweep."""

    task: RunTask
    status: str
    wall: float | None  # [s]; None if it died unobserved
    failure: Failure | None = None
    reason: str = ""
    exit_code: int | None = None  # of the process that died

    @property
    def failed(self) -> bool:
        """Whether the ego did not arrive."""
        return self.status != EpisodeStatus.ARRIVED

    @property
    def worth_retrying(self) -> bool:
        """Whether the process was lost rather than the episode."""
        return self.failure in (
            Failure.PROCESS_DIED,
            Failure.WALL_CLOCK,
            Failure.MEMORY,
            Failure.PROCESSES,
            Failure.LOST_WORKER,
        )

    @property
    def ends_sweep(self) -> bool:
        """Whether no other run could be executed either."""
        return self.failure in (Failure.DISK, Failure.OTHER_CODE)


def failed(
    task: RunTask,
    failure: Failure,
    reason: str,
    *,
    wall: float | None = None,
    exit_code: int | None = None,
) -> RunReport:
    """Build the report of a run without an episode."""
    line = in_one_line(reason)
    return RunReport(task, EpisodeStatus.CRASHED, wall, failure, line, exit_code)


def record_failure(report: RunReport) -> RunReport:
    """Write the run folder of a run without an episode.

    Returns:
        The report, or one about the disk if the folder cannot be written.
    """
    task = report.task
    row = row_without_episode(
        str(task.config["name"]),
        str(task.config["planner"]["name"]),
        int(task.config["simulation"]["seed"]),
        report.status,
    )
    about = {
        **facts_of(task),
        "scenario": task.config["name"],
        "planner": task.config["planner"]["name"],
        "seed": task.config["simulation"]["seed"],
        "trace_hash": None,
        "status": report.status,
        "reason": report.reason,
        "failure": report.failure,
        "exit_code": report.exit_code,
        "trace_kept": False,
        "wall_s": report.wall,
    }
    try:
        with atomic_folder(task.folder) as folder:
            write_files(folder, row, about, task.config)
    except ResultsError as error:
        return failed(task, Failure.DISK, str(error))
    return report


def facts_of(task: RunTask) -> dict[str, Any]:
    """Return the manifest entries specific to runs of a sweep."""
    return {
        **task.facts,
        "run_id": task.run_id,
        "attempts": task.attempt,
        "full_statistics": task.full_statistics,
    }
