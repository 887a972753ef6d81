"""Compiles what a planner needs before it is needed, and announces it.

What is compiled stays in a cache, function by function: another planner, or a scene
with something new in it, may need loops that none before it needed.
"""

import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener

from experiments.cli.garbage import look_for_garbage_less_often
from experiments.cli.kernel_list import Signature, compile_one, family_of, missing
from experiments.cli.shown_log import shown_log
from experiments.storage.provenance import PACKAGES
from planner.numerics import kernel_cache

NOTICE = "compiling the inner loops (once, up to a minute) ...\n"
FEW = 3  # functions that are compiled sooner than further processes start
MOST_PROCESSES = 4  # each takes 250 MB


class _Announcer(Listener):  # type: ignore[misc]  # numba has no types
    """Writes one line to stderr when the first of our functions is compiled."""

    def __init__(self) -> None:
        self._said = False

    def say(self) -> None:
        """Announce that something is compiled, once."""
        if not self._said:
            self._said = True
            sys.stderr.write(NOTICE)
            sys.stderr.flush()

    def on_start(self, event: Event) -> None:
        """Announce the first compilation; loading from the cache does not get here."""
        if _is_ours(event.data["dispatcher"].py_func.__module__):
            self.say()

    def on_end(self, event: Event) -> None:
        """Do nothing."""


@contextmanager
def compilation_announced(planners: Sequence[str] = ()) -> Iterator[None]:
    """Compile what planners lack; announce it, and what the block compiles.

    Args:
        planners: Names; what another planner needs is compiled when it is called.
    """
    announcer = _Announcer()
    families = sorted({name for name in map(family_of, planners) if name})
    with shown_log(kernel_cache.log), install_listener("numba:compile", announcer):
        lacking = missing(families) if kernel_cache.is_writable() else []
        if len(lacking) > FEW:
            announcer.say()
            compile_all(lacking)
        yield


def compile_all(signatures: Sequence[Signature]) -> None:
    """Compile functions into the cache on all processors, with a counter on a terminal.

    What fails is compiled again where it is called, and fails there with its error.
    """
    _show(0, len(signatures))
    processes = min(_n_processors(), MOST_PROCESSES, len(signatures))
    with ProcessPoolExecutor(
        processes,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin_process,
    ) as pool:
        jobs = [pool.submit(compile_one, each) for each in signatures]
        try:
            for done, job in enumerate(as_completed(jobs), start=1):
                if isinstance(job.exception(), BrokenProcessPool):
                    break
                _show(done, len(signatures))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    if sys.stderr.isatty():
        sys.stderr.write("\n")


def _begin_process() -> None:
    """Leave Ctrl-C to the command, and look for garbage as seldom as it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    look_for_garbage_less_often()


def _n_processors() -> int:
    """Count the processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _show(done: int, of: int) -> None:
    """Count on a terminal, in one line that is written over."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\rcompiled {done} of {of} functions")
        sys.stderr.flush()


def _is_ours(module: str) -> bool:
    """Check whether a loop is ours; those of users' planners may not be cached."""
    return module.partition(".")[0] in PACKAGES
