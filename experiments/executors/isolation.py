"""Worker processes that may crash, hang or eat memory at the cost of one run each.

Both the local and the cluster executor drive their runs in here. pebble notices a
process that died or took too long and puts a new one in its place; the watch ends one
that takes too much memory.
"""

import multiprocessing
import os
import shutil
import signal
import tempfile
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessFuture, ProcessPool

from experiments.executors.executor import WorkerSettings
from experiments.executors.memory_watch import MemoryWatch
from experiments.executors.worker import drive_watched, start_worker
from experiments.run_folder import remove_unfinished
from experiments.run_task import Failure, RunReport, RunTask, failed

T = TypeVar("T")
OnReport = Callable[[RunReport], None]

# one thread each: several workers with many threads would be in each other's way
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")


class IsolatedWorkers:
    """A pool of worker processes."""

    def __init__(self, workers: int, settings: WorkerSettings) -> None:
        for variable in _THREADS:
            os.environ.setdefault(variable, "1")
        self._settings = settings
        self._workers = workers
        self._register = Path(tempfile.mkdtemp(prefix="rearview-workers-"))
        self._watch = MemoryWatch(self._register, settings.memory_mb)
        self._pool = self._new_pool()
        self._stopped = False

    @property
    def stopped(self) -> bool:
        """Tell whether no run will be driven any more."""
        return self._stopped

    def drive(self, task: RunTask, on_report: OnReport) -> None:
        """Drive a run; its report is handed over by a thread of the pool."""
        future = self._schedule(drive_watched, (task, self._register), task.timeout)

        def over(future: Future[RunReport]) -> None:
            if not self._stopped:
                on_report(self._report(task, future))

        future.add_done_callback(over)

    def call(
        self, function: Callable[[Any], T], argument: Any, timeout: float
    ) -> "ProcessFuture[T]":
        """Call a function in a worker.

        Returns:
            A future; its result raises TimeoutError after `timeout` [s], and
            ProcessExpired if the process dies.
        """
        return self._schedule(function, (argument,), timeout)

    def stop(self) -> None:
        """End all workers at once."""
        self._stopped = True
        self._watch.stop()
        self._pool.stop()
        self._pool.join()
        shutil.rmtree(self._register, ignore_errors=True)

    def _schedule(
        self, function: Callable[..., T], arguments: tuple[Any, ...], timeout: float
    ) -> "ProcessFuture[T]":
        """Schedule a call; a pool that broke is replaced."""
        try:
            return self._pool.schedule(function, arguments, timeout=timeout)
        except (BrokenProcessPool, RuntimeError):
            if self._stopped:
                raise
            self._pool = self._new_pool()
            return self._pool.schedule(function, arguments, timeout=timeout)

    def _new_pool(self) -> ProcessPool:
        """Make a pool whose processes start from one that has loaded everything."""
        methods = multiprocessing.get_all_start_methods()
        forks = "forkserver" in methods  # not on Windows
        context = multiprocessing.get_context("forkserver" if forks else "spawn")
        if forks:
            context.set_forkserver_preload(["experiments.executors.worker", "libsumo"])
        return ProcessPool(
            max_workers=self._workers,
            initializer=start_worker,
            initargs=(self._settings,),
            context=context,
        )

    def _report(self, task: RunTask, future: Future[RunReport]) -> RunReport:
        """Turn what became of a run into its report."""
        try:
            return future.result()
        except TimeoutError:
            words = f"took longer than {task.timeout:g} s of wall clock"
            return failed(task, Failure.WALL_CLOCK, words, wall=task.timeout)
        except ProcessExpired as death:
            _tidy(task, death.pid)
            return self._death(task, death.pid, death.exitcode)
        except (CancelledError, BrokenProcessPool) as error:
            words = f"the pool of processes broke: {error}"
            return failed(task, Failure.PROCESS_DIED, words)

    def _death(
        self, task: RunTask, process: int | None, exit_code: int | None
    ) -> RunReport:
        """Report a run whose process died."""
        if self._watch.ended(process):
            words = f"took more than {self._settings.memory_mb:.0f} MB of memory"
            return failed(task, Failure.MEMORY, words, exit_code=exit_code)
        words = f"the process of the episode {death_in_words(exit_code)}"
        return failed(task, Failure.PROCESS_DIED, words, exit_code=exit_code)


def death_in_words(exit_code: int | None) -> str:
    """Say how a process ended, from its exit code."""
    if exit_code is None or exit_code >= 0:
        return f"left with exit status {exit_code} before the end"
    name = signal.Signals(-exit_code).name
    hint = " (as the kernel does when memory runs out)" if name == "SIGKILL" else ""
    return f"died of {name}{hint}"


def _tidy(task: RunTask, process: int | None) -> None:
    """Remove what a dead process left of its run folder."""
    if process is not None and task.folder.parent.is_dir():
        remove_unfinished(task.folder.parent, process)
