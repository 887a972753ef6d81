"""A planner of a user, without registration: keeps its lane and a constant speed."""

import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.states import Trajectory

POINTS = 11


@dataclass(frozen=True, slots=True)
class ConstantSpeed:
    """Follows the reference path at the offset and speed it has."""

    crash_at: float | None = None  # the process dies then [s]
    interrupt_at: float | None = None  # as if the user pressed Ctrl-C then [s]
    nan_at: float | None = None  # the plan holds NaN from then on [s]
    raise_at: float | None = None  # plan() raises then [s]
    exit_at: float | None = None  # plan() calls sys.exit then [s]
    leave_at: float | None = None  # the process leaves then, as if all was well [s]
    stats_at: float | None = None  # the statistics are none then [s]
    move_at: float | None = None  # the working folder changes then [s]
    sleep: float = 0.0  # in every cycle [s]
    mark: str | None = None  # file that appears when the first cycle begins

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        if self.crash_at is not None and scene.time >= self.crash_at:
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.interrupt_at is not None and scene.time >= self.interrupt_at:
            os.kill(os.getpid(), signal.SIGINT)
        if self.raise_at is not None and scene.time >= self.raise_at:
            raise RuntimeError("no idea")
        self._misbehave(scene.time)
        t = scene.step * np.arange(POINTS)
        speed = scene.ego.speed
        l = scene.ego_frenet.l
        s = scene.ego_frenet.s + speed * t
        at = scene.path.at(s)
        x = at.x - l * at.sin_heading
        if self.nan_at is not None and scene.time >= self.nan_at:
            x = np.full_like(x, np.nan)
        trajectory = Trajectory(
            t=t,
            x=x,
            y=at.y + l * at.cos_heading,
            heading=at.heading,
            curvature=at.curvature,
            speed=np.full(POINTS, speed),
            acceleration=np.zeros(POINTS),
            s=s,
            l=np.full(POINTS, l),
        )
        stats = PlanStats(candidates=1, survivors=1, costs={"jerk_integral": 0.0})
        if self.stats_at is not None and scene.time >= self.stats_at:
            stats = PlanStats(candidates="many")
        return PlanResult(PlanStatus.OK, trajectory, None, stats)

    def _misbehave(self, now: float) -> None:
        if self.mark is not None:
            Path(self.mark).touch()
        time.sleep(self.sleep)
        if self.exit_at is not None and now >= self.exit_at:
            sys.exit("enough")
        if self.leave_at is not None and now >= self.leave_at:
            os._exit(0)
        if self.move_at is not None and now >= self.move_at:
            os.chdir("/")


def make(**settings: float | str) -> ConstantSpeed:
    return ConstantSpeed(**settings)


NOT_CALLABLE = 3


def no_planner() -> object:
    return object()


def fails() -> object:
    raise RuntimeError("no licence")


def leaves() -> object:
    sys.exit("no licence")
