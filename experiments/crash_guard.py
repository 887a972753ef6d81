"""Keeps a crash of the simulator from passing in silence.

SUMO runs inside the process and can take it down. The episode therefore runs in a
forked child, before anything heavy is loaded; the parent sees how it ended.
"""

import os
import signal
import sys
from collections.abc import Callable

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
