"""Runs an episode in a child process and reports its crashes.

SUMO runs inside the process and can take it down. The episode therefore runs in a
forked child, before anything heavy is loaded; the parent sees how it ended.
"""

import os
import signal
import sys
from collections.abc import Callable
from time import monotonic, sleep

import typer

from experiments.cli.user_errors import (
    INTERNAL_ERROR,
    INTERRUPTED,
    TERMINATED,
    TerminatedError,
    end_on_sigterm,
)
from experiments.processes.tree import (
    adopt_orphans,
    children,
    end_with_parent,
    kill_all,
)

NOTICE_AFTER = 1.0  # the step still runs after Ctrl-C: tell the user [s]
TERMINATION_GRACE = 5.0  # between SIGTERM and SIGKILL [s]


def guarded(episode: Callable[[], int], crashed: Callable[[int, str], int]) -> int:
    """Run `episode` in a child process.

    Args:
        episode: Gives an exit status.
        crashed: Called with the child's process id and words on its death if it died
            before the episode ended; gives the exit status then.

    Returns:
        The exit status.
    """
    if not hasattr(os, "fork"):  # Windows: no guard
        return episode()
    sys.stdout.flush()
    sys.stderr.flush()
    end_on_sigterm()
    adopt_orphans()
    parent, before = os.getpid(), children(os.getpid())
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        end_with_parent(parent)
        status = _status(episode)
        os.write(writing, b"ended")
        os._exit(status)
    os.close(writing)
    try:
        return _outcome(child, reading, crashed)
    finally:  # what a planner has started does not outlive its episode
        kill_all(lambda: children(parent) - before)


def _outcome(child: int, reading: int, crashed: Callable[[int, str], int]) -> int:
    """Wait for the child and return the exit status."""
    try:
        _, state = os.waitpid(child, 0)
    except TerminatedError:  # possibly sent to the parent only
        _stop(child, crashed)
        return TERMINATED
    except KeyboardInterrupt:  # from the terminal, which sends it to both
        _wait_for_the_step(child, crashed)
        return INTERRUPTED
    death = _death(state, ended=_was_written(reading))
    return os.WEXITSTATUS(state) if death is None else crashed(child, death)


def _wait_for_the_step(child: int, crashed: Callable[[int, str], int]) -> None:
    """Wait for a process to complete its step, until a second Ctrl-C."""
    try:
        if not _has_ended(child, NOTICE_AFTER):
            words = "waiting for the step to end; Ctrl-C again stops at once\n"
            sys.stderr.write(words)
            sys.stderr.flush()
            os.waitpid(child, 0)
    except KeyboardInterrupt:
        _stop(child, crashed)


def _stop(child: int, crashed: Callable[[int, str], int]) -> None:
    """Stop a process; if it does not end in time, kill it and report a crash."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # already being handled
    os.kill(child, signal.SIGTERM)
    if not _has_ended(child, TERMINATION_GRACE):
        os.kill(child, signal.SIGKILL)
        _, state = os.waitpid(child, 0)
        crashed(child, _death(state, ended=False) or "")


def _has_ended(child: int, patience: float) -> bool:
    """Check whether a process ends within `patience` [s]."""
    deadline = monotonic() + patience
    while monotonic() < deadline:
        if os.waitpid(child, os.WNOHANG) != (0, 0):
            return True
        sleep(0.02)
    return False


def _death(state: int, *, ended: bool) -> str | None:
    """Describe how a process died before its episode ended; None if it did not."""
    if os.WIFSIGNALED(state):
        return f"died of {signal.Signals(os.WTERMSIG(state)).name}"
    if not ended:  # a user's code called os._exit
        return f"left with exit status {os.WEXITSTATUS(state)} before the end"
    return None


def _was_written(reading: int) -> bool:
    """Check whether a pipe holds data; a grandchild may keep it open."""
    os.set_blocking(reading, False)
    try:
        return bool(os.read(reading, 1))
    except BlockingIOError:
        return False
    finally:
        os.close(reading)


def _status(episode: Callable[[], int]) -> int:
    """Run and return an exit status whatever happens."""
    try:
        status = episode()
    except typer.Exit as leave:
        status = leave.exit_code
    except KeyboardInterrupt:
        status = INTERRUPTED
    except BaseException:  # noqa: BLE001, internal error: show it, never hang
        sys.excepthook(*sys.exc_info())
        status = INTERNAL_ERROR
    sys.stdout.flush()
    sys.stderr.flush()
    return status
