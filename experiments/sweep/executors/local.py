"""Execution in processes of this machine, by pebble."""

import os
from queue import Empty, SimpleQueue

from experiments.errors import ConfigError
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.isolation import IsolatedWorkers
from experiments.sweep.task import RunReport, RunTask

MOST_PER_CORE = 8  # worker processes that a machine can bear


class LocalExecutor:
    """Executes runs in worker processes, by default one per core."""

    def __init__(self, settings: WorkerSettings, workers: int | None = None) -> None:
        self._count = workers or cores()
        self._reports: SimpleQueue[RunReport] = SimpleQueue()
        self._isolated = IsolatedWorkers(self._count, settings)

    @property
    def workers(self) -> int:
        """Number of processes."""
        return self._count

    def submit(self, task: RunTask) -> None:
        """Submit a run to the pool."""
        self._isolated.drive(task, self._reports.put)

    def next_report(self, patience: float) -> RunReport | None:
        """Wait for a run to finish."""
        try:
            return self._reports.get(timeout=patience)
        except Empty:
            return None

    def stop(self) -> None:
        """Stop all processes."""
        self._isolated.stop()


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def require_few(workers: int) -> None:
    """Refuse so many worker processes that the machine would come to a stand.

    Raises:
        ConfigError: If there are too many.
    """
    most = MOST_PER_CORE * cores()
    if workers > most:
        raise ConfigError(
            f"--workers: is {workers}; allowed: up to {most}, {MOST_PER_CORE} for each "
            "core of this machine"
        )
