"""Parallel computation of many small pieces of work, with progress."""

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Protocol, TypeVar

from pebble import ProcessExpired, ProcessPool
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from experiments.errors import ExecutorError

Item = TypeVar("Item")
Result = TypeVar("Result")
CHUNKS = 12  # that each process gets of one piece of work, about


class Work(Protocol):
    """Maps a function over items, possibly in several processes."""

    def map(
        self, words: str, function: Callable[[Item], Result], items: Iterable[Item]
    ) -> list[Result]:
        """Return the results in the order of the items; `words` describe the work."""
        ...


class InProcesses:
    """Calls functions in worker processes, for the part of the whole that is named."""

    def __init__(self, pool: ProcessPool, workers: int, progress: Progress) -> None:
        self._pool = pool
        self._workers = workers
        self._progress = progress
        self.part = ""

    def map(
        self, words: str, function: Callable[[Item], Result], items: Iterable[Item]
    ) -> list[Result]:
        """Call the function on each item, in the order of the items.

        Raises:
            ExecutorError: If a worker process dies.
        """
        asked = list(items)
        size = max(1, len(asked) // (CHUNKS * self._workers))
        task = self._progress.add_task(f"{self.part}: {words}", total=len(asked))
        found: list[Result] = []
        if not asked:
            return found
        results = self._pool.map(function, asked, chunksize=size).result()
        try:
            for result in results:
                found.append(result)
                self._progress.advance(task)
        except ProcessExpired as error:
            raise ExecutorError(
                f"{self.part}: {words}: a worker process died (exit code "
                f"{error.exitcode}); the same command goes on at this part"
            ) from error
        self._progress.update(task, visible=False)
        self._progress.console.print(f"{self.part}: {words}: {len(asked)} done")
        return found


@contextmanager
def in_processes(workers: int) -> Iterator[InProcesses]:
    """Start the processes; they are stopped at once on any error."""
    console = Console(stderr=True, highlight=False)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    pool = ProcessPool(max_workers=workers, initializer=_prepare)
    try:
        with Progress(*columns, console=console, transient=True) as progress:
            yield InProcesses(pool, workers, progress)
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()


def _prepare() -> None:
    """Ignore Ctrl-C, which the parent handles, and silence stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)
