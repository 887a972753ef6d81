"""Runs an episode in a child process and reports its crashes.

SUMO runs inside the process and can take it down. The episode therefore runs in a
forked process, before anything heavy is loaded; its ancestors see how it ended.
"""

import os
import signal
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic, sleep
from typing import NoReturn

import typer

from experiments.cli.user_errors import (
    INTERNAL_ERROR,
    INTERRUPTED,
    TERMINATED,
    TerminatedError,
    end_on_sigterm,
)
from experiments.sweep.processes.tree import (
    adopt_orphans,
    children,
    end_with_parent,
    kill_all,
)

NOTICE_AFTER = 1.0  # the step still runs after Ctrl-C: tell the user [s]
# asks to pass Ctrl-C on; Windows has neither this signal nor the guard
PASS_ON: int = getattr(signal, "SIGUSR1", signal.SIGTERM)
TERMINATION_GRACE = 5.0  # between SIGTERM and SIGKILL [s]

_PROCESS = struct.Struct("!q")  # a process id


def guarded(episode: Callable[[], int], crashed: Callable[[int, str], int]) -> int:
    """Run `episode` in a process of its own.

    It is a grandchild. The child between survives whatever the episode does, and ends
    all that the episode has started if this process is killed.

    Args:
        episode: Gives an exit status.
        crashed: Called with the id of the episode's process and words on its death if
            it died before the episode ended; gives the exit status then.

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
    signal.pthread_sigmask(signal.SIG_BLOCK, {PASS_ON})  # until the child can take it
    child = os.fork()
    if child == 0:
        os.close(reading)
        _supervise(parent, episode, writing)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {PASS_ON})
    os.close(writing)
    try:
        return _outcome(child, reading, crashed)
    finally:  # what a planner has started does not outlive its episode
        kill_all(lambda: children(parent) - before)
        os.close(reading)


def _supervise(parent: int, episode: Callable[[], int], writing: int) -> NoReturn:
    """Run the episode in a child, and end as it ends."""
    try:
        adopt_orphans()
        # signals wait until they can be passed on
        passed_on = {signal.SIGINT, signal.SIGTERM, PASS_ON}
        signal.pthread_sigmask(signal.SIG_BLOCK, passed_on)
        supervisor = os.getpid()
        process = os.fork()
        if process == 0:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, passed_on)
            end_with_parent(supervisor)
            os.write(writing, _PROCESS.pack(os.getpid()))
            status = _status(episode)
            os.write(writing, b"ended")
            os._exit(status)
        os.close(writing)
        _pass_interrupts_on(process)
        _end_all_with(parent, process)
        _, state = os.waitpid(process, 0)
        if not os.WIFSIGNALED(state):
            os._exit(os.WEXITSTATUS(state))
        number = os.WTERMSIG(state)
        with suppress(OSError):  # SIGKILL has no handler
            signal.signal(number, signal.SIG_DFL)
        os.kill(supervisor, number)
    except BaseException:  # noqa: BLE001, this copy of the command ends here
        sys.excepthook(*sys.exc_info())
    finally:
        os._exit(INTERNAL_ERROR)


def _pass_interrupts_on(process: int) -> None:
    """Pass Ctrl-C on to the episode when the command asks for it.

    A terminal sends SIGINT to all processes, a script perhaps to the command alone. In
    the first case this process has had one too, by the time that the command asks, and
    so has the episode, which must not get two.
    """
    to_all = False

    def on_sigint(*_: object) -> None:
        nonlocal to_all
        to_all = True

    def on_asked(*_: object) -> None:
        if not to_all:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGINT)

    if signal.SIGINT in signal.sigpending():  # perhaps of before there was an episode
        signal.sigwait({signal.SIGINT})
    signal.signal(signal.SIGINT, on_sigint)
    signal.signal(PASS_ON, on_asked)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, PASS_ON})


def _end_all_with(parent: int, process: int) -> None:
    """Kill everything below if the parent dies; pass its SIGTERM on to a process."""
    own = os.getpid()

    def on_sigterm(*_: object) -> None:
        if os.getppid() != parent:
            kill_all(lambda: children(own))
            os._exit(TERMINATED)
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGTERM)

    signal.signal(signal.SIGTERM, on_sigterm)
    end_with_parent(parent, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})


def _outcome(child: int, reading: int, crashed: Callable[[int, str], int]) -> int:
    """Wait for the child and return the exit status."""

    def died(_: int, death: str) -> int:
        process, _ended = _heard(reading)
        return crashed(process or child, death)

    try:
        _, state = os.waitpid(child, 0)
    except TerminatedError:  # possibly sent to the parent only
        _stop(child, died)
        return TERMINATED
    except KeyboardInterrupt:
        with suppress(ProcessLookupError):
            os.kill(child, PASS_ON)
        _wait_for_the_step(child, died)
        return INTERRUPTED
    process, ended = _heard(reading)
    death = _death(state, ended=ended)
    return os.WEXITSTATUS(state) if death is None else crashed(process or child, death)


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
        os.waitpid(child, 0)
        crashed(
            child, f"was killed: its step did not end within {TERMINATION_GRACE:g} s"
        )


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


def _heard(reading: int) -> tuple[int | None, bool]:
    """Read what the episode wrote: its process, and whether it came to its end.

    A process that the planner started may keep the pipe open.
    """
    os.set_blocking(reading, False)
    try:
        words = os.read(reading, 100)
    except BlockingIOError:
        return None, False
    size = _PROCESS.size
    if len(words) < size:
        return None, False
    return _PROCESS.unpack(words[:size])[0], len(words) > size


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
