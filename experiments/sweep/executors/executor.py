"""Interface of the executors of a sweep."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from experiments.sweep.task import RunReport, RunTask

POLL_INTERVAL = 0.5  # longest wait for a report between two checks for Ctrl-C [s]


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """Settings of every worker process."""

    memory_mb: float  # resident memory that ends a run
    log: Path  # output of SUMO and planners; absolute
    directory: Path  # the working folder, searched for users' planners
    planner_folders: tuple[str, ...] = ()  # searched before it
    warm_up: tuple[Mapping[str, Any], ...] = ()  # scenarios, driven before any run


class Executor(Protocol):
    """Executes runs; every submitted run comes back as one report."""

    @property
    def workers(self) -> int:
        """Number of runs executed at a time."""
        ...

    def submit(self, task: RunTask) -> None:
        """Submit a run; it is executed as soon as a worker is free."""
        ...

    def next_report(self, patience: float) -> RunReport | None:
        """Wait for a run to finish; None if none does within `patience` [s]."""
        ...

    def stop(self) -> None:
        """Stop everything at once, including running episodes."""
        ...
