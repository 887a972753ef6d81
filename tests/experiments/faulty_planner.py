"""A planner of a user that goes wrong in a chosen way, soon after the start."""

import ctypes
import time
from dataclasses import dataclass

from constant_speed_planner import ConstantSpeed

from planner.interface import PlanResult
from planner.scene import Scene

START = 0.5  # [s]
CHUNK = 50_000_000  # bytes


@dataclass(frozen=True, slots=True)
class Faulty:
    """Drives straight on until its fault shows."""

    fault: str

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        if scene.time >= START:
            _FAULTS[self.fault]()
        return ConstantSpeed().plan(scene, memory)


def make(fault: str = "none") -> Faulty:
    return Faulty(fault)


def _segfault() -> None:
    ctypes.string_at(0)


def _hang() -> None:
    while True:
        time.sleep(1.0)


def _raise() -> None:
    raise RuntimeError("no idea")


def _leave() -> None:
    raise KeyboardInterrupt  # as if someone had pressed Ctrl-C, who had not


def _eat_memory() -> None:
    eaten = []
    while True:
        eaten.append(b"x" * CHUNK)
        time.sleep(0.005)


_FAULTS = {
    "none": lambda: None,
    "segfault": _segfault,
    "hang": _hang,
    "raise": _raise,
    "memory": _eat_memory,
    "leave": _leave,
}
