"""Report errors that users can fix in one line."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from experiments.errors import ExperimentError, in_one_line

# exit statuses
ARRIVED = 0  # or done
OTHER_OUTCOME = 1
BAD_INPUT = 2
INTERNAL_ERROR = 3
INTERRUPTED = 130  # by Ctrl-C
NOT_READ = 141  # stdout was closed, as after SIGPIPE
TERMINATED = 143  # by SIGTERM


class TerminatedError(KeyboardInterrupt):
    """SIGTERM, which ends a command like Ctrl-C."""

    raised = False  # at any time; typer turns the exception into that of Ctrl-C


def end_on_sigterm() -> None:
    """Raise an exception on SIGTERM, so that nothing half-written is left."""
    signal.signal(signal.SIGTERM, _on_terminate)


def _on_terminate(*_: object) -> None:
    """Raise; an exception runs what has to be tidied up."""
    TerminatedError.raised = True
    raise TerminatedError


@contextmanager
def report_user_errors() -> Iterator[None]:
    """Report errors that users can fix in one line, with exit status 2."""
    with reader_may_leave():
        try:
            yield
        except BrokenPipeError:
            raise
        except user_errors() as error:
            sys.stderr.write(f"rearview: {error_line(error)}\n")
            raise typer.Exit(BAD_INPUT) from error


@contextmanager
def reader_may_leave() -> Iterator[None]:
    """End without a word when whoever reads stdout has read enough: `| head`.

    What is still in the buffer is written before the block is left, or Python would
    complain about it as the process ends.
    """
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit) as error:
        # click and rich leave with status 1 while they handle a broken pipe
        causes = (error, error.__context__)
        if not any(isinstance(cause, BrokenPipeError) for cause in causes):
            raise
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        raise typer.Exit(NOT_READ) from error


def error_line(error: BaseException) -> str:
    """Return the message of an error as one line that is not too long."""
    return in_one_line(str(error)) or type(error).__name__


def user_errors() -> tuple[type[Exception], ...]:
    """Return the error classes whose messages tell users what to do."""
    from planner.errors import PlannerError
    from sumo_nets.errors import NetworkError

    return (ExperimentError, PlannerError, NetworkError, OSError)
