"""Execution in processes of this machine, by pebble."""

import os
from queue import Empty, SimpleQueue

from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.isolation import IsolatedWorkers
from experiments.sweep.task import RunReport, RunTask


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
