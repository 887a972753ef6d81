"""Which environment has the one simulation of this process."""

from typing import Protocol

# The one whose episode runs here; kept, for who is dropped unclosed leaves SUMO behind
_holders: "set[HoldsProcess]" = set()


class HoldsProcess(Protocol):
    """An environment whose episode is the one simulation of its process."""

    def end_episode(self) -> None:
        """End the episode, if one runs."""


def take_process(env: HoldsProcess) -> None:
    """End the episode of another environment in this process."""
    for other in list(_holders):
        if other is not env:
            other.end_episode()
    _holders.clear()
    _holders.add(env)
