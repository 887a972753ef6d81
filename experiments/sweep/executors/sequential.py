"""Runs one after the other in this process: for a debugger, without any guard."""

from collections import deque

from experiments.sweep.execute import execute_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.worker import warm_up
from experiments.sweep.task import RunReport, RunTask


class SequentialExecutor:
    """Drives a run when it is asked for the next report."""

    workers = 1

    def __init__(self, settings: WorkerSettings) -> None:
        self._waiting: deque[RunTask] = deque()
        warm_up(settings.warm_up)

    def submit(self, task: RunTask) -> None:
        """Put a run into the queue."""
        self._waiting.append(task)

    def next_report(self, patience: float) -> RunReport | None:  # noqa: ARG002
        """Drive the next run."""
        return execute_run(self._waiting.popleft()) if self._waiting else None

    def stop(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
