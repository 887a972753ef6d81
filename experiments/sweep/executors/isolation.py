"""Isolated worker processes: a crash, hang or memory overrun fails one run only.

Both the local and the cluster executor drive their runs in here. Each worker executes
its runs in a child process and watches it; pebble replaces a worker that dies all the
same, or that does not end a run in time.
"""

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessFuture, ProcessPool

from experiments.errors import ExecutorError, described
from experiments.storage.atomic_folder import remove_unfinished
from experiments.storage.provenance import ROOT
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.worker import (
    call_guarded,
    drive_guarded,
    start_worker,
)
from experiments.sweep.processes.guarded import CallLimits, death_in_words
from experiments.sweep.task import Failure, RunReport, RunTask, failed

T = TypeVar("T")
OnReport = Callable[[RunReport], None]

# one thread each: workers with many threads would compete for cores
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
WORKER_GRACE = 30.0  # beyond the time-out of a run, which its worker keeps [s]
MAX_BREAKS = 5  # consecutive broken pools before giving up


class IsolatedWorkers:
    """A pool of worker processes."""

    def __init__(self, workers: int, settings: WorkerSettings) -> None:
        for variable in _THREADS:
            os.environ.setdefault(variable, "1")
        self._settings = settings
        self._workers = workers
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
        arguments = (task, self._settings.memory_mb)
        future = self._schedule(drive_guarded, arguments, task.timeout)

        def over(future: Future[RunReport]) -> None:
            if not self._stopped:
                on_report(self._report(task, future))

        future.add_done_callback(over)

    def call(
        self,
        function: Callable[[Mapping[str, Any]], T],
        argument: Mapping[str, Any],
        timeout: float,
    ) -> "ProcessFuture[T]":
        """Call a function with a scenario in a child process of a worker.

        Returns:
            A future; its result raises CallLostError if the function raises, dies,
            takes longer than `timeout` [s] or too much memory.
        """
        limits = CallLimits(timeout, self._settings.memory_mb)
        return self._schedule(call_guarded, (function, argument, limits), timeout)

    def stop(self) -> None:
        """Stop all workers at once."""
        self._stopped = True
        self._pool.stop()
        self._pool.join()

    def _schedule(
        self, function: Callable[..., Any], arguments: Sequence[Any], timeout: float
    ) -> "ProcessFuture[Any]":
        """Schedule a call, replacing a broken pool; `timeout` is the worker's [s]."""
        timeout += WORKER_GRACE
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
            words = f"its worker {death_in_words(death.exitcode)}"
            code = death.exitcode
            return failed(task, Failure.PROCESS_DIED, words, exit_code=code)
        except BaseException as error:  # noqa: BLE001, a run without report is waited for
            words = f"the worker failed: {described(error)}"
            return failed(task, Failure.LOST_WORKER, words)
        self._breaks = 0
        return report


def _tidy(task: RunTask, process: int | None) -> None:
    """Remove the unfinished run folder of a dead process."""
    if process is not None and task.folder.parent.is_dir():
        remove_unfinished(task.folder.parent, process)


def _start_forkserver(log: Path) -> None:
    """Start the fork server of the workers, with its output in the log.

    It imports from the folder in which it starts before all others, and workers keep
    what it has imported: from our own folder, or an `experiments.py` of the user's in
    the working folder would be taken for this package.
    """
    from multiprocessing import forkserver

    preload = ["experiments.sweep.executors.fork_server"]
    preload += ["experiments.sweep.executors.worker", "libsumo"]
    forkserver.set_forkserver_preload(preload)
    with _stderr_into(log), chdir(ROOT):
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
