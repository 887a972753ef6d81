"""Warnings of a module's log that users should see without --verbose."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def shown_log(log: logging.Logger) -> Iterator[None]:
    """Write the warnings of a log to stderr, one line for each thing."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("rearview: %(message)s"))
    kept = log.level, log.propagate
    log.setLevel(logging.WARNING)
    log.propagate = False
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.level, log.propagate = kept
