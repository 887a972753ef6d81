"""Ends worker processes that exceed the memory limit of a run.

The resident set is watched from outside, which works while compiled code holds the
interpreter. A limit on the address space would not do: a worker with SUMO and numba
loaded maps 2 GB and uses 0.4.
"""

import os
import signal
import threading
from contextlib import suppress
from pathlib import Path

import psutil

INTERVAL = 0.1  # between two checks [s]
MB = 1e6  # bytes


class MemoryWatch:
    """A thread that watches the memory of registered processes."""

    def __init__(self, register: Path, limit_mb: float) -> None:
        self._register = register
        self._limit = limit_mb * MB
        self._ended: set[int] = set()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def ended(self, process: int) -> bool:
        """Check, once, whether the watch ended a process; process ids are reused."""
        if process not in self._ended:
            return False
        self._ended.discard(process)
        return True

    def stop(self) -> None:
        """Stop the thread."""
        self._stopped.set()
        self._thread.join()

    def _watch(self) -> None:
        """Check all processes until stopped."""
        while not self._stopped.wait(INTERVAL):
            with suppress(FileNotFoundError):  # temporary files were removed
                for mark in self._register.iterdir():
                    self._look_at(int(mark.name))

    def _look_at(self, process: int) -> None:
        """End a process that exceeds the limit."""
        try:
            taken = psutil.Process(process).memory_info().rss
        except psutil.Error:  # the process has ended
            (self._register / str(process)).unlink(missing_ok=True)
            return
        if taken > self._limit and process not in self._ended:
            self._ended.add(process)
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
