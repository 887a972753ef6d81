"""Planners that do what no planner should, one for each function of this module.

Everything here is bounded: a fork happens a few times, a hang ends with the process.
"""

import asyncio
import atexit
import ctypes
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
from constant_speed_planner import ConstantSpeed

from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.states import Trajectory

START = 0.3  # when it begins [s]
SLEEP = 600.0  # of processes that are meant to outlive the run [s]
FORKS = 5

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Hostile:
    """Drives straight on, and does something at `START`; in each cycle if it plans."""

    def __init__(self, action: Callable[[Scene, PlanResult], object]) -> None:
        self.action = action
        self.planner = ConstantSpeed()
        self.done = False

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        result = self.planner.plan(scene, memory)
        if scene.time < START or self.done:
            return result
        given = self.action(scene, result)
        self.done = given is None
        return result if self.done else given


class MuteError(BaseException):
    def __str__(self) -> str:
        raise self


class OwnError(BaseException):
    pass


def throw(error: BaseException) -> None:
    raise error


def changed(result: PlanResult, **columns: np.ndarray) -> PlanResult:
    """Copy a plan with other columns in its trajectory."""
    old = {name: getattr(result.trajectory, name) for name in Trajectory.__slots__}
    return PlanResult(PlanStatus.OK, Trajectory(**(old | columns)), None)


def sleeping_child(*, away: bool = False) -> None:
    """Fork a child that sleeps; `away`: in a session of its own, an orphan."""
    child = os.fork()
    if child == 0:
        if away:
            os.setsid()
            if os.fork():
                os._exit(0)
        time.sleep(SLEEP)
        os._exit(0)
    if away:
        os.waitpid(child, 0)


def many(action: Callable[[], object]) -> None:
    for _ in range(FORKS):
        action()


def write_into(array: np.ndarray) -> None:
    array.setflags(write=True)
    array[:] = 1e6


def recurse(depth: int = 0) -> int:
    return recurse(depth + 1) + 1


def hang() -> None:
    while True:
        time.sleep(1.0)


def hang_deaf() -> None:
    for number in set(signal.Signals) - {signal.SIGKILL, signal.SIGSTOP}:
        signal.signal(number, signal.SIG_IGN)
    hang()


def eat() -> None:
    eaten = []
    for _ in range(40):  # 3 GB, also if nobody stops it
        eaten.append(np.ones(10_000_000))
        time.sleep(0.02)
    hang()


def eat_in_children() -> None:
    for _ in range(3):
        if os.fork() == 0:
            kept = np.ones(60_000_000)
            time.sleep(SLEEP)
            os._exit(int(kept[0]))
    hang()


def flood() -> None:
    for _ in range(200_000):
        os.write(1, b"all work and no play\n")


def many_processes() -> None:
    """Fork more than a run may have, and no more than that."""
    for _ in range(90):
        sleeping_child()
    hang()


def spoilt_alternatives(result: PlanResult) -> PlanResult:
    def give():
        raise OwnError

    return PlanResult(PlanStatus.OK, result.trajectory, None, alternatives=give)


def close_everything() -> None:
    os.closerange(3, 1000)


def without_numpy() -> None:
    """Spoil NumPy for this process."""
    for name in ("hypot", "searchsorted", "interp", "array", "arange", "isfinite"):
        setattr(np, name, lambda *_, **__: 1 / 0)


def busy_threads() -> None:
    def spin():
        while True:
            time.sleep(0.001)

    for _ in range(FORKS):
        threading.Thread(target=spin, daemon=False).start()


ACTIONS: dict[str, Callable[[Scene, PlanResult], object]] = {
    "exit_0": lambda s, r: os._exit(0),
    "exit_7": lambda s, r: os._exit(7),
    "segfault": lambda s, r: ctypes.string_at(0),
    "abort": lambda s, r: os.abort(),
    "kill_itself": lambda s, r: os.kill(os.getpid(), signal.SIGKILL),
    "terminate_itself": lambda s, r: os.kill(os.getpid(), signal.SIGTERM),
    "interrupt_itself": lambda s, r: os.kill(os.getpid(), signal.SIGINT),
    "alarm": lambda s, r: signal.setitimer(signal.ITIMER_REAL, 0.001) and hang(),
    "hang": lambda s, r: hang(),
    "hang_deaf": lambda s, r: hang_deaf(),
    "raise": lambda s, r: throw(RuntimeError("no idea")),
    "raise_mute": lambda s, r: throw(MuteError()),
    "raise_own": lambda s, r: throw(OwnError("mine")),
    "cancelled": lambda s, r: throw(asyncio.CancelledError()),
    "keyboard": lambda s, r: throw(KeyboardInterrupt()),
    "system_exit": lambda s, r: sys.exit("bye"),
    "generator_exit": lambda s, r: throw(GeneratorExit()),
    "stop_iteration": lambda s, r: throw(StopIteration()),
    "long_text": lambda s, r: throw(ValueError("x " * 100_000)),
    "group": lambda s, r: throw(BaseExceptionGroup("all", [OwnError(), MuteError()])),
    "recursion": lambda s, r: recurse(),
    "memory": lambda s, r: eat(),
    "memory_in_children": lambda s, r: eat_in_children(),
    "huge_array": lambda s, r: np.ones(10**15),
    "huge_plan": lambda s, r: changed(
        r, **dict.fromkeys(Trajectory.__slots__, np.arange(2_000_000) * 0.1)
    ),
    "nan_plan": lambda s, r: changed(r, x=np.full_like(r.trajectory.x, np.nan)),
    "backward_plan": lambda s, r: changed(r, speed=-r.trajectory.speed),
    "jump": lambda s, r: changed(r, x=r.trajectory.x + 50.0),
    "none": lambda s, r: object(),
    "generator": lambda s, r: (r for _ in range(3)),
    "text_stats": lambda s, r: PlanResult(
        PlanStatus.OK, r.trajectory, None, PlanStats(candidates="many")
    ),
    "hollow": lambda s, r: object.__new__(PlanResult),
    "write_road": lambda s, r: write_into(s.path.x),
    "write_vehicles": lambda s, r: write_into(s.vehicles.x),
    "without_numpy": lambda s, r: without_numpy(),
    "alternatives": lambda s, r: spoilt_alternatives(r),
    "threads": lambda s, r: busy_threads(),
    "atexit_hang": lambda s, r: atexit.register(hang) and None,
    "flood": lambda s, r: flood(),
    "forked_copy": lambda s, r: os.fork() and None,
    "children": lambda s, r: many(sleeping_child),
    "daemons": lambda s, r: many(lambda: sleeping_child(away=True)),
    "shell": lambda s, r: many(
        lambda: subprocess.Popen(["sleep", str(SLEEP)], start_new_session=True)
    ),
    "many_processes": lambda s, r: many_processes(),
    "daemons_then_crash": lambda s, r: (
        many(lambda: sleeping_child(away=True)) or ctypes.string_at(0)
    ),
    "daemons_then_hang": lambda s, r: (
        many(lambda: sleeping_child(away=True)) or many(sleeping_child) or hang_deaf()
    ),
    "close_pipes": lambda s, r: close_everything(),
}


def make(action: str = "raise") -> Hostile:
    return Hostile(ACTIONS[action])
