"""The motion that follows from a curvature, and the task of planning one."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.states import FloatArray

CURVATURE_RATE = 0.1  # [1/m²]; 0.4 rad/s at the wheels of a car at 1.5 m/s


@dataclass(frozen=True, slots=True)
class SteeringLimits:
    """What a steerable path keeps; `margin` is the least distance from the boundary."""

    curvature: float  # [1/m]
    curvature_rate: float = CURVATURE_RATE  # [1/m²]
    margin: float = 0.1  # [m]


class SteeredMotion(NamedTuple):
    """Poses at the stations and what they follow from, (n,)."""

    x: FloatArray  # [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    middle: FloatArray  # heading between two stations, (n - 1,) [rad]
    lever: FloatArray  # of a change of the spacing on it, (n - 1,) [1/m]

    @property
    def poses(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x, y [m] and heading [rad] at the stations, (n,) each."""
        return self.x, self.y, self.heading


class SteeringTask(NamedTuple):
    """What is planned: from where to where, inside what, with which body."""

    guide: FloatArray  # (m, 2) [m]
    boundary: FloatArray  # (k, 4) [m]
    outline: FloatArray  # (p, 2), of the body and the margin, rear axle at 0 [m]
    box: tuple[float, float, float]  # of the same: back, front, half the width [m]
    limits: SteeringLimits
    start: tuple[float, float, float]  # x, y [m], heading [rad]
    end: tuple[float, float, float]


class Iterate(NamedTuple):
    """One round's unknowns and what follows from them."""

    curvature: FloatArray  # at the stations, (n,) [1/m]
    spacing: float  # of the stations [m]
    motion: SteeredMotion


def integrate(
    curvature: FloatArray, ds: float, start: tuple[float, float, float]
) -> SteeredMotion:
    """Integrate the curvature, linear between stations, by the midpoint rule."""
    x0, y0, heading0 = start
    turn = 0.5 * (curvature[1:] + curvature[:-1])
    heading = heading0 + ds * np.concatenate([[0.0], np.cumsum(turn)])
    lever = 0.375 * curvature[:-1] + 0.125 * curvature[1:]
    middle = heading[:-1] + ds * lever
    x = x0 + ds * np.concatenate([[0.0], np.cumsum(np.cos(middle))])
    y = y0 + ds * np.concatenate([[0.0], np.cumsum(np.sin(middle))])
    return SteeredMotion(x, y, heading, middle, lever)


def missed_end(task: SteeringTask, motion: SteeredMotion) -> FloatArray:
    """Measure by how much the last pose misses the one asked for, (3,)."""
    last = np.array([motion.x[-1], motion.y[-1], motion.heading[-1]])
    return np.asarray(last - np.array(task.end))
