"""The tree of processes below this one: list it, measure it, end it.

On Linux a process can become the reaper of its orphaned descendants: a daemon that a
planner starts by forking twice then stays below the process that runs the planner.
"""

import ctypes
import os
import signal
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import psutil  # takes 20 ms to import, which `rearview run` need not pay

KILL_PATIENCE = 5.0  # with a tree that forks while it is being killed [s]
PARENT_INTERVAL = 0.5  # between two checks of the parent where no signal tells [s]
_PAUSE = 0.005  # between two rounds of killing [s]

_LINUX = sys.platform.startswith("linux")
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36  # of prctl(2)


def adopt_orphans() -> None:
    """Make this process the parent of its orphaned descendants (Linux only)."""
    if _LINUX:
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)


def end_with_parent(parent: int, number: int = signal.SIGKILL) -> None:
    """End this process when its parent dies.

    On Linux the kernel sends the signal; elsewhere a thread asks for the parent's id.

    Args:
        parent: Process id of the parent, which may be dead already.
        number: The signal.
    """
    if _LINUX:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(number))
        if os.getppid() != parent:
            os.kill(os.getpid(), number)
        return

    def watch() -> None:
        while os.getppid() == parent:
            sleep(PARENT_INTERVAL)
        os.kill(os.getpid(), number)

    Thread(target=watch, daemon=True).start()


def children(process: int) -> set[int]:
    """Return the process ids of the children of a process, zombies included."""
    if _LINUX:
        found: set[int] = set()
        with suppress(OSError):  # the process, or one of its threads, has ended
            for task in Path(f"/proc/{process}/task").iterdir():
                with suppress(OSError):
                    found.update(map(int, (task / "children").read_text().split()))
            return found
        return found
    import psutil

    try:
        return {child.pid for child in psutil.Process(process).children()}
    except psutil.Error:
        return set()


def with_descendants(roots: Iterable[int]) -> set[int]:
    """Return processes and all below them."""
    found: set[int] = set()
    waiting = list(roots)
    while waiting:
        process = waiting.pop()
        if process not in found:
            found.add(process)
            waiting.extend(children(process))
    return found


def memory(processes: Iterable[int], limit: float) -> float:
    """Return the memory of processes [bytes].

    The sum of resident sets counts pages that processes share several times. Only
    where it exceeds `limit` are these divided among them, which takes longer.
    """
    listed = list(processes)
    total = _sum(listed, lambda one: one.memory_info().rss)
    if total > limit and len(listed) > 1 and _LINUX:
        return _sum(listed, lambda one: one.memory_full_info().pss)
    return total


def kill_all(roots: Callable[[], set[int]]) -> None:
    """Kill processes with all below them, and reap those that are children of this one.

    Args:
        roots: Returns the processes; called again until there are none, since they
            may fork meanwhile, and orphans may appear.
    """
    deadline = monotonic() + KILL_PATIENCE
    while (listed := with_descendants(roots())) and monotonic() < deadline:
        for process in listed:
            with suppress(OSError):  # ended meanwhile, or of another user
                os.kill(process, signal.SIGKILL)
        for process in listed:
            with suppress(OSError):  # not a child of this process
                os.waitpid(process, os.WNOHANG)
        sleep(_PAUSE)


def kill_group(leader: int) -> None:
    """Kill a process group at once, so that no member can fork meanwhile."""
    with suppress(OSError):
        os.killpg(leader, signal.SIGKILL)


def _sum(processes: list[int], measure: Callable[["psutil.Process"], int]) -> float:
    """Add up what is measured, skipping processes that have ended."""
    import psutil

    total = 0
    for process in processes:
        with suppress(psutil.Error):
            total += measure(psutil.Process(process))
    return float(total)
