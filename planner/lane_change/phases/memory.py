"""The manoeuvre from cycle to cycle: phases, memory, and when it is binding."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.lane_change.place_on_path import place_on
from planner.lane_change.speed.passing_orders import Side
from planner.scene import Scene
from planner.states import Path, Trajectory
from planner.vehicle import Vehicle

# An ego farther from the kept path needs another one: a trajectory must start within
# 0.1 m of it [m]
OFF_PATH = 0.08
SETTLED = 0.1  # as near to its lane's centre the change is over [m]
SETTLED_SLOPE = 0.02  # and as parallel to it, dl/ds [-]
COMMIT_MARGIN = 0.1  # a body this near the line is about to enter [m]


class Phase(StrEnum):
    """Where the manoeuvre stands."""

    KEEP = "keep"  # in the lane, no other one is wanted
    SEEK = "seek"  # in the lane, adjusting speed for a gap in the next one
    CHANGE = "change"  # on the way, still free to turn back
    COMMITTED = "committed"  # the body is in the target lane


@dataclass(frozen=True, slots=True)
class Change:
    """A lane change that has begun or is being looked for."""

    lane: int  # the one it leaves
    target: int
    path: Path  # from where it was planned
    end: float  # distance along `path` where the lateral motion is over [m]
    order: tuple[tuple[str, Side], ...] = ()  # passing order of the last cycle


@dataclass(frozen=True, slots=True)
class Memory:
    """State handed from one cycle to the next."""

    phase: Phase
    lane: int  # kept or left
    trajectory: Trajectory
    change: Change | None = None
    start_s: float | None = None  # where the wanted change begins on the road [m]
    cycle: int = 0  # counts up
    gap: tuple[int, str | None, str | None] | None = None  # see `gaps.choice.GapPlan`


def progress_on(path: Path, scene: Scene) -> float | None:
    """Find the distance along `path` where the ego is, None if it is not on it."""
    ego = scene.ego
    place, (x, y) = place_on(path, scene.ego_frenet.s, ego.x, ego.y)
    if math.hypot(ego.x - x, ego.y - y) > OFF_PATH:
        return None
    return place


def reaches_over(
    vehicle: Vehicle, l: float, slope: float, line: float, side: int
) -> float:
    """Compute how far the body reaches over a line beside it, negative before it [m].

    Args:
        vehicle: The ego's dimensions.
        l: Of the rear axle [m].
        slope: dl/ds of its heading [-].
        line: Lateral offset of the line [m].
        side: 1 if the line is to the left, -1 to the right.
    """
    angle = math.atan(slope)
    half = 0.5 * vehicle.width * math.cos(angle)
    front = l + vehicle.front_reach * math.sin(angle)
    rear = l - vehicle.rear_overhang * math.sin(angle)
    return max(side * (front - line), side * (rear - line)) + half


def lane_line(scene: Scene, lane: int, target: int) -> float:
    """Return the lateral offset of the line between two neighbour lanes here [m]."""
    centres, widths = scene.lanes.at(scene.ego_frenet.s)
    if widths[target] > 0.0:
        share = widths[lane] / (widths[lane] + widths[target])
    else:
        share = 0.5
    return float(centres[lane] + share * (centres[target] - centres[lane]))


def about_to_enter(scene: Scene, lane: int, target: int, step: float) -> bool:
    """Check whether the body is in the target lane or will be within `step` [s]."""
    ego = scene.ego_frenet
    side = 1 if target > lane else -1
    line = lane_line(scene, lane, target)
    over = reaches_over(scene.vehicle, ego.l, ego.l_prime, line, side)
    return over + max(side * ego.l_dot, 0.0) * step > -COMMIT_MARGIN


def settled(scene: Scene, target: int) -> bool:
    """Check whether the ego drives in the middle of its lane, along it."""
    ego = scene.ego_frenet
    centre = float(np.interp(ego.s, scene.lanes.s, scene.lanes.centre[target]))
    return abs(ego.l - centre) < SETTLED and abs(ego.l_prime) < SETTLED_SLOPE
