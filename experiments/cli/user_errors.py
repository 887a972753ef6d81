"""Report errors that users can fix in one line."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from experiments.errors import ExperimentError

# exit statuses
ARRIVED = 0  # or done
OTHER_OUTCOME = 1
BAD_INPUT = 2
INTERNAL_ERROR = 3
INTERRUPTED = 130  # by Ctrl-C
TERMINATED = 143  # by SIGTERM


@contextmanager
def report_user_errors() -> Iterator[None]:
    """Report errors that users can fix in one line, with exit status 2."""
    try:
        yield
    except _user_errors() as error:
        line = " ".join(str(error).split())
        sys.stderr.write(f"rearview: {line}\n")
        raise typer.Exit(BAD_INPUT) from error


def _user_errors() -> tuple[type[Exception], ...]:
    """Return the error classes whose messages tell users what to do."""
    from planner.errors import PlannerError
    from sumo_nets.errors import NetworkError

    return (ExperimentError, PlannerError, NetworkError, OSError)
