"""Notices a planner that writes into the road, whose arrays outlive its cycle."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from zlib import crc32

import numpy as np

from planner.scene import Scene

LASTING = ("path", "road", "obstacles", "lanes")  # fields of a scene


class RoadSeal:
    """Checksums of the arrays that all scenes of an episode share."""

    def __init__(self, scene: Scene) -> None:
        self._parts = {name: getattr(scene, name) for name in LASTING}
        self._sums = self._measured()

    def broken(self) -> str | None:
        """Return the name of a part that has changed, None if there is none."""
        for name, value in self._measured().items():
            if value != self._sums[name]:
                return name
        return None

    def _measured(self) -> dict[str, int]:
        """Return the checksum of each part."""
        return {name: _checksum(part) for name, part in self._parts.items()}


def _checksum(part: object) -> int:
    """Return the checksum of all arrays of a record."""
    total = 0
    for array in _arrays(part):
        total = crc32(array.tobytes(), total)
    return total


def _arrays(part: object) -> Iterator[np.ndarray]:
    """Yield the arrays of a record, depth first."""
    if isinstance(part, np.ndarray):
        yield part
    elif isinstance(part, tuple):
        for item in part:
            yield from _arrays(item)
    elif is_dataclass(part):
        for one in fields(part):
            yield from _arrays(getattr(part, one.name))
