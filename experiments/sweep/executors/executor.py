"""What a sweep needs of those who drive its runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from experiments.sweep.task import RunReport, RunTask


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """What every worker process is told when it starts."""

    memory_mb: float  # resident memory that ends a run
    log: Path  # gets what SUMO and planners print, absolute
    directory: Path  # where users' planners are looked for
    warm_up: tuple[Mapping[str, Any], ...] = ()  # scenarios, driven before any run


class Executor(Protocol):
    """Drives runs; every run that is submitted comes back as one report."""

    @property
    def workers(self) -> int:
        """Runs driven at a time."""
        ...

    def submit(self, task: RunTask) -> None:
        """Hand a run over; it is driven as soon as a worker is free."""
        ...

    def next_report(self, patience: float) -> RunReport | None:
        """Wait for a run to be over; None if none is within `patience` [s]."""
        ...

    def stop(self) -> None:
        """End everything at once, whatever is running."""
        ...
