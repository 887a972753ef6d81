"""What all commands do with an error that the user can mend: one line."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from experiments.errors import ExperimentError

ARRIVED, OTHER_OUTCOME, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130  # exit status


@contextmanager
def report_user_errors() -> Iterator[None]:
    """Turn errors that the user can mend into one line and exit status 2."""
    try:
        yield
    except _user_errors() as error:
        line = " ".join(str(error).split())
        sys.stderr.write(f"rearview: {line}\n")
        raise typer.Exit(BAD_INPUT) from error


def _user_errors() -> tuple[type[Exception], ...]:
    """List the families of errors that say in one line what to do."""
    from planner.errors import PlannerError
    from sumo_nets.errors import NetworkError

    return (ExperimentError, PlannerError, NetworkError, OSError)
