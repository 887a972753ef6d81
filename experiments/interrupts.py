"""Ctrl-C and SIGTERM, deferred until a step is complete."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

SECOND_SIGNAL = 0.3  # signals closer than this are one, sent to a group [s]


class InterruptedByUserError(KeyboardInterrupt):
    """Ctrl-C or SIGTERM, as opposed to a KeyboardInterrupt that a planner raises."""


def is_interrupt(error: BaseException) -> bool:
    """Check whether an error comes from a user who wants to stop.

    A planner may raise KeyboardInterrupt as well. It cannot be told from Ctrl-C where
    Python's own handler is installed.
    """
    if isinstance(error, InterruptedByUserError):
        return True
    own_handler = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return isinstance(error, KeyboardInterrupt) and own_handler


@contextmanager
def interrupts_between_steps() -> Iterator[Callable[[], None]]:
    """Defer Ctrl-C and SIGTERM until a step is complete; a second one acts at once.

    In the middle of compiled code an interrupt would look like a failure of the
    planner.

    Yields:
        What raises KeyboardInterrupt after a signal; to be called in each step.
    """
    first: float | None = None

    def handler(*_: object) -> None:
        nonlocal first
        if first is not None and monotonic() - first > SECOND_SIGNAL:
            raise InterruptedByUserError
        first = monotonic() if first is None else first

    def check() -> None:
        if first is not None:
            raise InterruptedByUserError

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield check
    finally:
        for number, old in before.items():
            signal.signal(number, old)
