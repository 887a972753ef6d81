"""What a cycle of the route planner sees, and whether a change of lanes can be made."""

from dataclasses import dataclass

import numpy as np

from planner.interface import PlanResult, PlanStatus
from planner.lane_change.lane_choice import BodiesAhead, lane_at
from planner.lane_change.phases.memory import Phase, reaches_over
from planner.lane_change.surroundings import in_lane
from planner.route.lane_need import leads_farthest
from planner.route.memory import LaneManoeuvre, RouteMemory
from planner.scene import Scene
from planner.states import FloatArray

STANDING = 0.3  # [m/s]
FIRM = 3.0  # braking that a lane's end may ask for at once [m/s²]
NEARLY = 0.4  # as near to its lane's centre a change is over [m]
ALONG = 0.06  # and as parallel to it, dl/ds [-]
CHANGE_TIME = 2.5  # a change needs so much way before its lanes end [s]
CHANGE_ROOM = 9.0  # ... and at least so much [m]
LEAST_MOVED = 0.1  # to the side, of a change that is not over within a plan [m]
OVER_ROOM = 12.0  # ... and at least so much [m]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What one cycle sees, computed once."""

    scene: Scene
    bodies: BodiesAhead
    ends: FloatArray  # of the lanes [m]
    stood: float  # for how long the ego has stood [s]
    round_until: float  # see RouteMemory
    close_until: float  # see RouteMemory

    @property
    def front(self) -> float:
        """Where the front bumper is [m]."""
        return self.scene.ego_frenet.s + self.scene.vehicle.front_reach


def kept(look: Look, last: RouteMemory | None) -> LaneManoeuvre:
    """Return the manoeuvre of the cycle before, if its lane is still there."""
    scene, ego = look.scene, look.scene.ego_frenet
    here = lane_at(scene.lanes, ego.s, ego.l)
    if last is None or last.manoeuvre.lane >= look.ends.size:
        return LaneManoeuvre(here)
    changes = last.manoeuvre.phase in (Phase.CHANGE, Phase.COMMITTED)
    if changes and abs(last.manoeuvre.lane - here) <= 1:
        return last.manoeuvre
    if last.manoeuvre.lane != here:  # it was led elsewhere, or its lane is gone
        return LaneManoeuvre(here)
    return last.manoeuvre


def is_over(scene: Scene, origin: int, target: int) -> bool:
    """Check whether a change is over: the ego drives along in its new lane.

    One that stands there, to wait for the next change, need not be in its middle: it
    has left the old lane.
    """
    ego, lanes = scene.ego_frenet, scene.lanes
    centre = float(np.interp(ego.s, lanes.s, lanes.centre[target]))
    if scene.ego.speed < STANDING:
        side = 1 if origin > target else -1
        line = centre + side * 0.5 * float(
            np.interp(ego.s, lanes.s, lanes.width[target])
        )
        return reaches_over(scene.vehicle, ego.l, ego.l_prime, line, side) < 0.0
    return abs(ego.l - centre) < NEARLY and abs(ego.l_prime) < ALONG


def name_of(scene: Scene, body: int) -> str:
    """Return the id of a body of the table, obstacles first; empty for none."""
    return (*scene.obstacles.ids, *scene.vehicles.ids)[body] if body >= 0 else ""


def has_room(look: Look, own: int, target: int) -> bool:
    """Check that both lanes go on for as long as a change takes."""
    need = max(CHANGE_ROOM, CHANGE_TIME * look.scene.ego.speed)
    return bool(min(look.ends[own], look.ends[target]) - look.front >= need)


def lane_end(look: Look, lane: int, room: float) -> tuple[float, ...]:
    """Return where to wait before the end of a lane that must be left [m].

    Args:
        look: The cycle.
        lane: That is followed.
        room: Kept to its end for each lane to be crossed; 0 until the ego is in it [m].
    """
    end = look.ends[lane]
    if not np.isfinite(end) or end >= look.ends.max():
        return ()
    stop = look.front + max(look.scene.ego.speed, 0.0) ** 2 / (2.0 * FIRM)
    kept = room * abs(leads_farthest(look.ends, lane) - lane)
    return (float(min(max(end - kept, stop), end - 1.0)),)


def is_late(look: Look, manoeuvre: LaneManoeuvre) -> bool:
    """Check whether a lane ends before a change out of it can be over.

    The ego has to leave it, as soon as there is a gap, on what road there is.
    """
    changes = manoeuvre.phase in (Phase.CHANGE, Phase.COMMITTED)
    return changes and bool(look.ends[manoeuvre.lane] - look.front < OVER_ROOM)


def ahead_in(look: Look, lane: int) -> int:
    """Return the row of the nearest body ahead in a lane; -1 without one near."""
    bodies = look.bodies
    s = np.where(in_lane(look.scene, bodies, lane), bodies.s, np.inf)
    s = np.where(s > look.scene.ego_frenet.s, s, np.inf)
    near = look.front + CHANGE_ROOM + CHANGE_TIME * look.scene.ego.speed
    return int(np.argmin(s)) if s.size and s.min() < near else -1


def goes_over(look: Look, result: PlanResult, target: int) -> bool:
    """Check whether a plan ends in the lane to which it is to change, or on its way.

    One that would rather slow down in its lane, behind which it comes too close to the
    end to change at all, is no change. A long body at a low speed does not get over
    within a plan.
    """
    way = result.trajectory
    if result.status is not PlanStatus.OK or way is None:
        return False
    lanes = look.scene.lanes
    centre = np.interp(way.s[-1], lanes.s, lanes.centre[target])
    half = 0.5 * np.interp(way.s[-1], lanes.s, lanes.width[target])
    toward = np.sign(centre - way.l[0])
    moves = (way.l[-1] - way.l[0]) * toward > LEAST_MOVED
    return bool(
        abs(way.l[-1] - centre) < half
        or (moves and (way.l[-1] - way.l[-2]) * toward > 0.0)
    )
