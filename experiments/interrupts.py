"""Ctrl-C and SIGTERM, deferred until a step is complete."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType

SECOND_SIGNAL = 0.3  # signals closer than this are one, sent to a group [s]


@contextmanager
def interrupts_between_steps() -> Iterator[Callable[[], None]]:
    """Defer Ctrl-C and SIGTERM until a step is complete; a second one acts at once.

    In the middle of compiled code an interrupt would look like a failure of the
    planner.

    Yields:
        What raises KeyboardInterrupt after a signal; to be called in each step.
    """
    first: float | None = None

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal first
        if first is not None and monotonic() - first > SECOND_SIGNAL:
            signal.default_int_handler(number, frame)
        first = monotonic() if first is None else first

    def check() -> None:
        if first is not None:
            raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield check
    finally:
        for number, old in before.items():
            signal.signal(number, old)
