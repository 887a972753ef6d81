"""Checks what a run says of its ending against its trace, with other geometry.

Bodies are polygons of shapely here, and the road is the area between the edges that
the trace holds: nothing of the code that ended the episode is used.
"""

import json
import re
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import affinity

from experiments.config import Scenario
from experiments.cosim.records import Ending, EpisodeStatus
from experiments.trace.schema import Trace

STANDING = 0.1  # slower is standing [m/s]
NEAR = 25.0  # bodies whose centres are farther apart are not compared [m]
TOUCHING = 0.02  # two shapes of the same bodies agree to this [m]
EDGE = 0.1  # two measures of a body beyond the road's edge agree to this [m]
FULLY_ON_ROAD = 0.01  # beyond the edge by this is still on the road [m]
LINE_ROOM = 15.0  # from the front bumper to the line that one waits at [m]
UNNAMED = 3.0  # of the patience, with an ego that stands while others drive by [-]
_BLOCKED = re.compile(r"stood (\d+) s at s = ([\d.]+) m, since t = ([\d.]+) s: (.+)")
_INTERNAL = re.compile(r"Traceback|\bNone\b|\bnan\b|object at 0x|<[a-z_.]+ ")
_MAX_REASON = 500
_ROUNDED = 0.05  # times in reasons are given to the tenth of a second [s]


def problems(scenario: Scenario, ending: Ending, trace: Trace) -> Iterator[str]:
    """What contradicts the ending; nothing if it is right."""
    reason = ending.reason
    if not reason or "\n" in reason or len(reason) > _MAX_REASON:
        yield f"the reason is no line: {reason[:200]!r}"
    if found := _INTERNAL.search(reason):
        yield f"internal words in the reason: {found[0]}"
    if ending.status is EpisodeStatus.NO_ROOM:
        yield from _of_no_room(scenario, reason, trace)
        return
    if ending.status not in _CHECKS:
        yield f"ends in {ending.status}"
        return
    yield from _of_every_step(trace, ending)
    yield from _CHECKS[ending.status](scenario, reason, trace)


def _of_no_room(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    """No step was driven, and there is traffic to wait for."""
    if len(trace.steps["index"]):
        yield "no room to enter, but steps"
    if scenario.traffic is None:
        yield "no room on an empty road"
    if "ego.start_m" not in reason:
        yield "no advice"


def _of_every_step(trace: Trace, ending: Ending) -> Iterator[str]:
    """Contacts end an episode at once; what touches or leaves the road is seen."""
    steps = trace.steps
    count = len(steps["index"])
    if not count:
        yield "no step"
        return
    contacts = [json.loads(text) for text in steps["contacts"]]
    if any(contacts[:-1]):
        yield "drove on after a contact"
    if bool(contacts[-1]) != (ending.status is EpisodeStatus.COLLISION):
        yield f"{ending.status} with contacts {contacts[-1]}"
    road = _road(trace)
    for step in range(count):
        body = _ego(trace, step)
        off = _beyond(body, road)
        if abs(off - float(steps["off_road_m"][step])) > EDGE:
            yield f"step {step}: {off:.2f} m off the road, {steps['off_road_m'][step]}"
            return
        for name, other in _others(trace, step):
            unseen = name not in contacts[step] and shapely.intersects(body, other)
            if unseen and _overlap(body, other) > TOUCHING:
                yield f"step {step}: overlaps {name} unseen"
                return


def _of_arrival(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    steps = trace.steps
    if not float(steps["s_m"][-1]) >= scenario.ego.goal_m:
        yield f"arrived at s = {steps['s_m'][-1]}"
    if np.ma.max(steps["off_road_m"]) > FULLY_ON_ROAD:
        yield "arrived with steps off the road"


def _of_collision(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    """Whom the reason names was touched in the last step or within it."""
    steps = trace.steps
    names = json.loads(steps["contacts"][-1])
    if not names or any(name not in reason for name in names):
        yield f"touched {names}, says {reason}"
    last = len(steps["index"]) - 1
    there = dict(_others(trace, last))
    for name in names:
        if name not in there:
            yield f"touched {name}, which is not near"
            continue
        gap = shapely.distance(_ego(trace, last), there[name])
        relative = float(steps["speed_mps"][-1]) + _speed(trace, last, name)
        if gap > TOUCHING + relative * float(trace.fact("step_s")):
            yield f"{name} is {gap:.2f} m away at the contact"


def _of_off_road(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    beyond = np.ma.filled(trace.steps["off_road_m"], 0.0) > FULLY_ON_ROAD
    left = np.ma.getmaskarray(trace.steps["s_m"])[-1]
    counted = re.search(r"in (\d+) steps", reason)
    if not left and (counted is None or int(counted[1]) != int(beyond.sum())):
        yield f"{int(beyond.sum())} steps off the road"


def _of_blocked(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    """The ego stands from the named moment on, not at a red light, named body ahead."""
    found = _BLOCKED.fullmatch(reason)
    if found is None:
        yield "says not since when and where"
        return
    stood, s, since = (float(found[k]) for k in (1, 2, 3))
    why = found[4]
    steps, step = trace.steps, float(trace.fact("step_s"))
    first = _first_standing(trace)
    if abs(float(steps["time_s"][first]) - since) > step + _ROUNDED:
        yield f"stands since {steps['time_s'][first]}"
    if abs(float(steps["time_s"][-1]) - since - stood) > 1.0:
        yield "stood for another time"
    if abs(float(steps["s_m"][-1]) - s) > 0.1:
        yield f"stands at s = {steps['s_m'][-1]}"
    waited = _at_a_line(scenario, trace, first)
    counted = (len(waited) - int(waited.sum())) * step
    if counted < scenario.simulation.blocked_after_s - 2.0 * step:
        yield f"stood only {counted:.1f} s without a closed line before it"
    if why.endswith("gives no reason"):
        yield "no reason"
    yield from _of_blocker(scenario, why, trace)


def _of_blocker(scenario: Scenario, why: str, trace: Trace) -> Iterator[str]:
    """A body that is named is ahead, and stands if it is a vehicle."""
    found = re.search(r"([\w.]+) (?:is in the way|stands [\d.]+ m ahead)", why)
    if found is None:
        return
    name, last = found[1], len(trace.steps["index"]) - 1
    there = dict(_others(trace, last, 80.0))
    if name not in there:
        yield f"{name} is not near"
        return
    if _speed(trace, last, name) > STANDING:
        yield f"{name} drives"
    x, y = float(trace.steps["x_m"][-1]), float(trace.steps["y_m"][-1])
    heading = float(trace.steps["heading_rad"][-1])
    ahead = shapely.get_coordinates(there[name]) - (x, y)
    if (ahead @ (np.cos(heading), np.sin(heading))).max() < 0.0:
        yield f"{name} is behind"


def _of_timeout(scenario: Scenario, reason: str, trace: Trace) -> Iterator[str]:
    """The time is up; an ego that stands for good would be blocked."""
    steps, step = trace.steps, float(trace.fact("step_s"))
    if float(steps["time_s"][-1]) < scenario.simulation.duration_s - step:
        yield f"ends at {steps['time_s'][-1]} s"
    if float(steps["s_m"][-1]) >= scenario.ego.goal_m:
        yield "is beyond the goal"
    first = _first_standing(trace)
    line = np.ma.getmaskarray(steps["stop_line_m"])[first:]
    if line.sum() * step > UNNAMED * scenario.simulation.blocked_after_s + step:
        yield f"stands {line.sum() * step:.1f} s without a closed line"


_CHECKS = {
    EpisodeStatus.ARRIVED: _of_arrival,
    EpisodeStatus.COLLISION: _of_collision,
    EpisodeStatus.OFF_ROAD: _of_off_road,
    EpisodeStatus.BLOCKED: _of_blocked,
    EpisodeStatus.TIMEOUT: _of_timeout,
}


def _first_standing(trace: Trace) -> int:
    """The step since which the ego has not moved; the number of steps if it moves."""
    moving = np.flatnonzero(np.abs(trace.steps["speed_mps"]) >= STANDING)
    return int(moving[-1]) + 1 if moving.size else 0


def _at_a_line(scenario: Scenario, trace: Trace, first: int):
    """In which steps a closed line is close before the front bumper."""
    vehicle = scenario.ego.vehicle
    front = trace.steps["s_m"] + vehicle.length_m - vehicle.rear_overhang_m
    room = np.ma.filled(trace.steps["stop_line_m"] - front, np.inf)
    return np.asarray(room[first:] <= LINE_ROOM)


def _ego(trace: Trace, step: int) -> shapely.Polygon:
    """The ego's body, from its rear axle."""
    length, width = trace.fact("length_m"), trace.fact("width_m")
    rear = -float(trace.fact("rear_overhang_m"))
    body = shapely.box(rear, -width / 2, rear + length, width / 2)
    return _placed(body, trace.steps, step)


def _placed(body, table, row: int) -> shapely.Polygon:
    turned = affinity.rotate(
        body, float(table["heading_rad"][row]), origin=(0, 0), use_radians=True
    )
    return affinity.translate(
        turned, float(table["x_m"][row]), float(table["y_m"][row])
    )


def _others(
    trace: Trace, step: int, reach: float = NEAR
) -> Iterator[tuple[str, shapely.Polygon]]:
    """Vehicles and obstacles around the ego in a step."""
    x, y = float(trace.steps["x_m"][step]), float(trace.steps["y_m"][step])
    index = trace.steps["index"][step]
    begin, end = np.searchsorted(trace.vehicles["index"], [index, index + 1])
    for table, rows in (
        (trace.vehicles, range(begin, end)),
        (trace.obstacles, range(len(trace.obstacles["id"]))),
    ):
        for row in rows:
            if np.hypot(table["x_m"][row] - x, table["y_m"][row] - y) <= reach:
                length, width = table["length_m"][row] / 2, table["width_m"][row] / 2
                body = shapely.box(-length, -width, length, width)
                radius = float(table["radius_m"][row]) if "radius_m" in table else 0.0
                if length == 0.0 or width == 0.0:
                    body = shapely.LineString([(-length, -width), (length, width)])
                grown = body.buffer(radius, quad_segs=32) if radius else body
                yield str(table["id"][row]), _placed(grown, table, row)


def _speed(trace: Trace, step: int, name: str) -> float:
    """Speed of a vehicle in a step, 0 of an obstacle."""
    rows = (trace.vehicles["index"] == trace.steps["index"][step]) & (
        trace.vehicles["id"] == name
    )
    return float(np.max(trace.vehicles["speed_mps"][rows], initial=0.0))


def _overlap(one: shapely.Polygon, other: shapely.Polygon) -> float:
    """About how deep two bodies overlap [m]."""
    return float(np.sqrt(shapely.area(shapely.intersection(one, other))))


def _road(trace: Trace) -> shapely.Geometry:
    """The area between the edges of the road."""
    road = trace.road
    sin, cos = np.sin(road["heading_rad"]), np.cos(road["heading_rad"])
    left, right = (
        np.column_stack((road["x_m"] - l * sin, road["y_m"] + l * cos))
        for l in (road["left_m"], road["right_m"])
    )
    quads = np.stack((left[:-1], left[1:], right[1:], right[:-1]), axis=1)
    area = shapely.union_all(shapely.make_valid(shapely.polygons(quads)))
    shapely.prepare(area)
    return area


def _beyond(body: shapely.Polygon, road: shapely.Geometry) -> float:
    """How far a body reaches beyond the road [m]."""
    if shapely.covers(road, body):
        return 0.0
    corners = shapely.points(shapely.get_coordinates(body))
    return float(np.max(shapely.distance(road, corners)))
