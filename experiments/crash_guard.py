"""Keeps a crash of the simulator from passing in silence.

SUMO runs inside the process and can take it down. The episode therefore runs in a
forked child, before anything heavy is loaded; the parent sees how it ended.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

import typer

INTERRUPTED = 130  # exit status after Ctrl-C


def guarded(episode: Callable[[], int], crashed: Callable[[int, str], int]) -> int:
    """Run `episode` in a child process.

    Args:
        episode: Gives an exit status.
        crashed: Called with the child's process id and the signal's name if a signal
            ended the child; gives the exit status then.

    Returns:
        The exit status.
    """
    if not hasattr(os, "fork"):  # Windows: no guard
        return episode()
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        os._exit(_status(episode))
    try:
        _, state = os.waitpid(child, 0)
    except KeyboardInterrupt:
        os.waitpid(child, 0)
        return INTERRUPTED
    if os.WIFSIGNALED(state):
        return crashed(child, signal.Signals(os.WTERMSIG(state)).name)
    return os.WEXITSTATUS(state)


@contextmanager
def interrupts_between_steps() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C back until a step is complete; the second one comes at once.

    In the middle of compiled code an interrupt would look like a failure of the
    planner.

    Yields:
        What raises KeyboardInterrupt after a Ctrl-C; to be called in each step.
    """
    asked = False

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            signal.default_int_handler(number, frame)
        asked = True

    def check() -> None:
        if asked:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handler)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)


def _status(episode: Callable[[], int]) -> int:
    """Run and give an exit status whatever happens."""
    try:
        status = episode()
    except typer.Exit as leave:
        status = leave.exit_code
    except KeyboardInterrupt:
        status = INTERRUPTED
    except BaseException:  # noqa: BLE001, an error of ours: show it, never hang
        sys.excepthook(*sys.exc_info())
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return status
