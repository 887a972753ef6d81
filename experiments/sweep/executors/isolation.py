"""Isolated worker processes: a crash, hang or memory overrun fails one run only.

Both the local and the cluster executor drive their runs in here. pebble notices a
process that died or took too long and puts a new one in its place; the watch ends one
that takes too much memory.
"""

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessFuture, ProcessPool

from experiments.errors import ExecutorError
from experiments.storage.atomic_folder import remove_unfinished
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.memory_watch import MemoryWatch
from experiments.sweep.executors.worker import call_watched, drive_watched, start_worker
from experiments.sweep.task import Failure, RunReport, RunTask, failed

T = TypeVar("T")
OnReport = Callable[[RunReport], None]

# one thread each: workers with many threads would compete for cores
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
MAX_BREAKS = 5  # consecutive broken pools before giving up


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
        self._breaks = 0  # since the last run that finished normally
        self._stopped = False

    @property
    def stopped(self) -> bool:
        """Whether the pool has been stopped."""
        return self._stopped

    def drive(self, task: RunTask, on_report: OnReport) -> None:
        """Execute a run; a thread of the pool passes its report on.

        Raises:
            ExecutorError: If processes cannot be kept alive.
        """
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
            ProcessExpired if the process dies or takes too much memory.
        """
        arguments = (function, argument, self._register)
        return self._schedule(call_watched, arguments, timeout)

    def stop(self) -> None:
        """Stop all workers at once."""
        self._stopped = True
        self._watch.stop()
        self._pool.stop()
        self._pool.join()
        shutil.rmtree(self._register, ignore_errors=True)

    def _schedule(
        self, function: Callable[..., Any], arguments: Sequence[Any], timeout: float
    ) -> "ProcessFuture[Any]":
        """Schedule a call, replacing a broken pool."""
        try:
            return self._pool.schedule(function, arguments, timeout=timeout)
        except (BrokenProcessPool, RuntimeError):
            if self._stopped:
                raise
        self._breaks += 1
        if self._breaks > MAX_BREAKS:
            raise ExecutorError(
                f"worker processes die at start; see {self._settings.log}; the same "
                "command resumes the sweep"
            )
        self._pool.stop()
        self._pool.join()
        self._pool = self._new_pool()
        return self._pool.schedule(function, arguments, timeout=timeout)

    def _new_pool(self) -> ProcessPool:
        """Create a pool whose processes start with everything loaded."""
        methods = multiprocessing.get_all_start_methods()
        forks = "forkserver" in methods  # not on Windows
        context = multiprocessing.get_context("forkserver" if forks else "spawn")
        if forks:
            _start_forkserver(self._settings.log)
        return ProcessPool(
            max_workers=self._workers,
            initializer=start_worker,
            initargs=(self._settings,),
            context=context,
        )

    def _report(self, task: RunTask, future: Future[RunReport]) -> RunReport:
        """Convert the outcome of a run to its report."""
        try:
            report = future.result()
        except TimeoutError:
            words = f"exceeded {task.timeout:g} s of wall clock"
            return failed(task, Failure.WALL_CLOCK, words, wall=task.timeout)
        except ProcessExpired as death:
            _tidy(task, death.pid)
            return self._death(task, death.pid, death.exitcode)
        except BaseException as error:  # noqa: BLE001, a run without report is waited for
            words = f"the worker failed: {type(error).__name__}: {error}"
            return failed(task, Failure.LOST_WORKER, words)
        self._breaks = 0
        return report

    def _death(
        self, task: RunTask, process: int | None, exit_code: int | None
    ) -> RunReport:
        """Build the report of a run whose process died."""
        if process is not None and self._watch.ended(process):
            words = f"exceeded {self._settings.memory_mb:.0f} MB of memory"
            return failed(task, Failure.MEMORY, words, exit_code=exit_code)
        words = f"the process of the episode {death_in_words(exit_code)}"
        return failed(task, Failure.PROCESS_DIED, words, exit_code=exit_code)


def death_in_words(exit_code: int | None) -> str:
    """Describe how a process ended, from its exit code."""
    if exit_code is None or exit_code >= 0:
        return f"left with exit status {exit_code} before the end"
    name = signal.Signals(-exit_code).name
    hint = " (as the kernel does when memory runs out)" if name == "SIGKILL" else ""
    return f"died of {name}{hint}"


def _tidy(task: RunTask, process: int | None) -> None:
    """Remove the unfinished run folder of a dead process."""
    if process is not None and task.folder.parent.is_dir():
        remove_unfinished(task.folder.parent, process)


def _start_forkserver(log: Path) -> None:
    """Start the fork server of the workers, with its output in the log."""
    from multiprocessing import forkserver

    forkserver.set_forkserver_preload(["experiments.sweep.executors.worker", "libsumo"])
    with _stderr_into(log):
        forkserver.ensure_running()


@contextmanager
def _stderr_into(file: Path) -> Iterator[None]:
    """Append the stderr of started processes to a file."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        opened = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(opened, 2)
        os.close(opened)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
