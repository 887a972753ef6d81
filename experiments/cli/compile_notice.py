"""Announces the compilation of inner loops, which makes a step take long.

What is compiled stays in a cache, function by function: another planner, or a scene
with something new in it, may need loops that none before it needed.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener

from experiments.storage.provenance import PACKAGES

NOTICE = "compiling the inner loops (once, up to a minute) ...\n"


class _Announcer(Listener):  # type: ignore[misc]  # numba has no types
    """Writes one line to stderr when the first of our functions is compiled."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: Event) -> None:
        """Announce the first compilation; loading from the cache does not get here."""
        if self._said or not _is_ours(event.data["dispatcher"].py_func.__module__):
            return
        self._said = True
        sys.stderr.write(NOTICE)
        sys.stderr.flush()

    def on_end(self, event: Event) -> None:
        """Do nothing."""


@contextmanager
def compilation_announced() -> Iterator[None]:
    """Announce the first compilation of one of our loops within the block."""
    with install_listener("numba:compile", _Announcer()):
        yield


def _is_ours(module: str) -> bool:
    """Check whether a loop is ours; those of users' planners may not be cached."""
    return module.partition(".")[0] in PACKAGES
