"""Says why a step takes long, once inner loops are really being compiled.

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
        """Take note that a function is compiled, not loaded."""
        if self._said or not _is_ours(event.data["dispatcher"].py_func.__module__):
            return
        self._said = True
        sys.stderr.write(NOTICE)
        sys.stderr.flush()

    def on_end(self, event: Event) -> None:
        """Nothing more to say."""


@contextmanager
def compilation_announced() -> Iterator[None]:
    """Announce the first compilation of a loop of ours within the block."""
    with install_listener("numba:compile", _Announcer()):
        yield


def _is_ours(module: str) -> bool:
    """Tell our loops from those of a user's planner, which may not be cached."""
    return module.partition(".")[0] in PACKAGES
