"""The verdict of a recorded episode: of its first contact, or of leaving the road."""

from weakref import WeakKeyDictionary

import numpy as np

from experiments.metrics.impact import first_contact
from experiments.metrics.right_of_way import STANDING, passed_lines
from experiments.metrics.verdict.judge import judge_contact
from experiments.metrics.verdict.records import (
    BodyTrack,
    ContactCase,
    ContactVerdict,
    Fault,
)
from experiments.metrics.verdict.tracks import (
    ego_track,
    obstacle_track,
    places_of_obstacles,
    standing_track,
    vehicle_track,
)
from experiments.trace.schema import Trace
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import FloatArray, IntArray

SEEN = 14.0  # before the contact, that a verdict looks at [s]
NEAR = 60.0  # bystanders farther from the ego bar no way out [m]
MOST_BYSTANDERS = 12
AT_CROSSING = 1.0  # before the contact, in which a right of way counts [s]
RED_LINE = 6.0  # before the contact, in which a closed line was driven over [s]
_JUDGED: WeakKeyDictionary[Trace, ContactVerdict | None] = WeakKeyDictionary()


def verdict_of(trace: Trace) -> ContactVerdict | None:
    """Judge the first contact of an episode, or its leaving the road.

    Returns:
        The verdict, its steps rows of the trace; None where there was neither. Row,
        events and moments all ask for it: it is computed once.
    """
    if trace not in _JUDGED:
        _JUDGED[trace] = _judge(trace)
    return _JUDGED[trace]


def _judge(trace: Trace) -> ContactVerdict | None:
    """Judge an episode."""
    found = first_contact(trace)
    if found is None:
        return _off_road(trace)
    row, body = found
    if not _is_known(trace, row, body):
        return None
    case, first = contact_case(trace, row, body)
    judged = judge_contact(case)
    return ContactVerdict(
        judged.fault,
        judged.step + first,
        judged.why,
        *(
            None if step is None else step + first
            for step in (judged.last_ego, judged.last_other)
        ),
    )


def _is_known(trace: Trace, row: int, body: str) -> bool:
    """Check that a body that was touched is in the trace."""
    table = trace.vehicles
    here = table["index"] == trace.steps["index"][row]
    return bool(
        (here & (table["id"] == body)).any() or (trace.obstacles["id"] == body).any()
    )


def _off_road(trace: Trace) -> ContactVerdict | None:
    """Judge leaving the road: the ego has driven there, unless it began there."""
    beyond = np.ma.filled(trace.steps["off_road_m"], 0.0) > OFF_ROAD_TOLERANCE
    if not beyond.any():
        return None
    row = int(beyond.argmax())
    if row == 0:
        return ContactVerdict(Fault.UNAVOIDABLE, 0, "begins off the road")
    return ContactVerdict(Fault.EGO, row - 1, "leaves the road", row - 1)


def contact_case(trace: Trace, row: int, body: str) -> tuple[ContactCase, int]:
    """Return the motions up to a contact in row `row`, and their first row.

    In the plane of the ego's path where ego and body have a place there all the time,
    so that a bend is straight; else on the map.
    """
    step = float(trace.fact("step_s"))
    first = max(row - round(SEEN / step), 0)
    rows = np.arange(first, row + 1)
    on_map = vehicle_track(trace, body, rows, on_path=False)
    left, right = _room(trace, rows)
    if on_map is None:
        other = obstacle_track(trace, body, rows)
        on_path = ego_track(trace, rows, on_path=True)
        ego = on_path if np.isfinite(on_path.x).all() else ego_track(trace, rows)
        bystanders = _bystanders(trace, body, rows, on_path=ego is on_path)
        if ego is not on_path:
            other = obstacle_track(trace, body, rows, on_path=False)
        return ContactCase(
            step, ego, other, left, right, bystanders, standing=True
        ), first
    other = vehicle_track(trace, body, rows, on_path=True) or on_map
    ego = ego_track(trace, rows, on_path=True)
    there = np.isfinite(on_map.x)
    flat = bool(np.isfinite(ego.x).all() and np.isfinite(other.x[there]).all())
    if not flat:
        ego, other = ego_track(trace, rows), on_map
    case = ContactCase(
        step,
        ego,
        other,
        left,
        right,
        _bystanders(trace, body, rows, on_path=flat),
        yields=_yields(trace, row, body),
        plane=(on_map,),
    )
    return case, first


def _bystanders(
    trace: Trace, body: str, rows: IntArray, *, on_path: bool
) -> tuple[BodyTrack, ...]:
    """Return the motions of those nearby that may bar a way out."""
    table, steps = trace.vehicles, trace.steps
    now = np.flatnonzero(table["index"] == steps["index"][rows[-1]])
    apart = np.hypot(
        table["x_m"][now] - steps["x_m"][rows[-1]],
        table["y_m"][now] - steps["y_m"][rows[-1]],
    )
    near = now[np.argsort(apart, kind="stable")][: int((apart < NEAR).sum())]
    found = []
    for name in table["id"][near][: MOST_BYSTANDERS + 1]:
        track = vehicle_track(trace, name, rows, on_path=on_path)
        if name != body and track is not None and np.isfinite(track.x[-1]):
            found.append(track)
    places = places_of_obstacles(trace, on_path=on_path)
    ego = ego_track(trace, rows[-1:], on_path=on_path)
    for k, name in enumerate(trace.obstacles["id"]):
        far = np.hypot(places[0][k] - ego.x[-1], places[1][k] - ego.y[-1])
        if name != body and far < NEAR:
            found.append(standing_track(trace.obstacles, k, places, rows))
    return tuple(found)


def _room(trace: Trace, rows: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the room to the left and right of the ego's body on its road [m]."""
    steps, road = trace.steps, trace.road
    s = np.ma.filled(steps["centre_s_m"], np.nan)[rows]
    l = np.ma.filled(steps["centre_l_m"], np.nan)[rows]
    half = 0.5 * float(trace.fact("width_m"))
    left = np.interp(s, road["s_m"], np.ma.filled(road["left_m"], np.inf))
    right = np.interp(s, road["s_m"], np.ma.filled(road["right_m"], -np.inf))
    return np.nan_to_num(left - l - half), np.nan_to_num(l - half - right)


def _yields(trace: Trace, row: int, body: str) -> str:
    """Return who has to let the other go first, `ego`, `other` or empty.

    An ego that has stood before the other's zone does let it go first: who hits it
    there drives where it should not.
    """
    step = float(trace.fact("step_s"))
    if any(row - RED_LINE / step <= k <= row for k in passed_lines(trace)):
        return "ego"
    foes = trace.foes
    at = np.searchsorted(trace.steps["index"], foes["index"])
    recent = (foes["vehicle"] == body) & (at >= row - AT_CROSSING / step) & (at <= row)
    mine = np.flatnonzero(recent)
    if not mine.size:
        return ""
    last = mine[-1]
    if foes["held"][last] or foes["gives_way"][last]:
        return "other"
    if _stood_before(trace, row, float(foes["begin_m"][last])):
        return "other"
    return "ego" if foes["goes_first"][last] else ""


def _stood_before(trace: Trace, row: int, zone: float) -> bool:
    """Check whether the ego has stood for a while before a zone that begins there."""
    first = max(row - round(AT_CROSSING / float(trace.fact("step_s"))), 0)
    speed = np.abs(np.ma.filled(trace.steps["speed_mps"][first : row + 1], 0.0))
    reach = trace.fact("length_m") - trace.fact("rear_overhang_m")
    return bool(speed.max() < STANDING and trace.steps["s_m"][row] + reach < zone)
