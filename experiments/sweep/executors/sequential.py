"""Sequential execution in this process: for a debugger, without isolation."""

from collections import deque

from experiments.sweep.execute import execute_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.worker import warm_up
from experiments.sweep.task import RunReport, RunTask


class SequentialExecutor:
    """Executes a run when the next report is requested."""

    workers = 1

    def __init__(self, settings: WorkerSettings) -> None:
        self._waiting: deque[RunTask] = deque()
        warm_up(settings.warm_up)

    def submit(self, task: RunTask) -> None:
        """Queue a run."""
        self._waiting.append(task)

    def next_report(self, patience: float) -> RunReport | None:  # noqa: ARG002
        """Execute the next run."""
        return execute_run(self._waiting.popleft()) if self._waiting else None

    def stop(self) -> None:
        """Discard the queue."""
        self._waiting.clear()
