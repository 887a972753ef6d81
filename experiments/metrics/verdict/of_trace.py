"""The verdict of a recorded episode: of its first contact, or of leaving the road."""

import numpy as np

from experiments.metrics.impact import first_contact
from experiments.metrics.pairs import obstacle_places
from experiments.metrics.right_of_way import passed_lines
from experiments.metrics.verdict.judge import judge_contact
from experiments.metrics.verdict.records import (
    BodyTrack,
    ContactCase,
    ContactVerdict,
    Fault,
)
from experiments.trace.schema import Table, Trace
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import FloatArray, IntArray

SEEN = 14.0  # before the contact, that a verdict looks at [s]
NEAR = 60.0  # bystanders farther from the ego bar no way out [m]
MOST_BYSTANDERS = 12
AT_CROSSING = 1.0  # before the contact, in which a right of way counts [s]
RED_LINE = 6.0  # before the contact, in which a closed line was driven over [s]

Places = tuple[FloatArray, FloatArray, FloatArray]  # x, y, heading


def verdict_of(trace: Trace) -> ContactVerdict | None:
    """Judge the first contact of an episode, or its leaving the road.

    Returns:
        The verdict, its steps rows of the trace; None where there was neither.
    """
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
    on_map = _vehicle(trace, body, rows, on_path=False)
    left, right = _room(trace, rows)
    if on_map is None:
        other = _obstacle(trace, body, rows)
        on_path = _ego(trace, rows, on_path=True)
        ego = on_path if np.isfinite(on_path.x).all() else _ego(trace, rows)
        bystanders = _bystanders(trace, body, rows, on_path=ego is on_path)
        if ego is not on_path:
            other = _obstacle(trace, body, rows, on_path=False)
        return ContactCase(
            step, ego, other, left, right, bystanders, standing=True
        ), first
    other = _vehicle(trace, body, rows, on_path=True) or on_map
    ego = _ego(trace, rows, on_path=True)
    there = np.isfinite(on_map.x)
    flat = bool(np.isfinite(ego.x).all() and np.isfinite(other.x[there]).all())
    if not flat:
        ego, other = _ego(trace, rows), on_map
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


def _ego(trace: Trace, rows: IntArray, *, on_path: bool = False) -> BodyTrack:
    """Return the ego's motion."""
    steps = trace.steps
    length, width = float(trace.fact("length_m")), float(trace.fact("width_m"))

    def kept(name: str) -> FloatArray:
        return np.asarray(np.ma.filled(steps[name], np.nan)[rows], dtype=np.float64)

    speed, rate = kept("speed_mps"), kept("acceleration_mps2")
    if on_path:
        x, y = kept("centre_s_m"), kept("centre_l_m")
        return BodyTrack(x, y, kept("heading_error_rad"), speed, rate, length, width)
    heading = kept("heading_rad")
    reach = 0.5 * length - float(trace.fact("rear_overhang_m"))
    x = kept("x_m") + reach * np.cos(heading)
    y = kept("y_m") + reach * np.sin(heading)
    return BodyTrack(x, y, heading, speed, rate, length, width)


def _vehicle(
    trace: Trace, name: str, rows: IntArray, *, on_path: bool
) -> BodyTrack | None:
    """Return a vehicle's motion, NaN where it is not there; None if it is none."""
    table = trace.vehicles
    mine = np.flatnonzero(table["id"] == name)
    if not mine.size:
        return None
    at = np.searchsorted(trace.steps["index"], table["index"][mine])
    inside = (at >= rows[0]) & (at <= rows[-1])
    mine, at = mine[inside], at[inside] - rows[0]
    if not mine.size:
        return None

    def kept(key: str) -> FloatArray:
        values = np.full(rows.size, np.nan)
        values[at] = np.ma.filled(table[key], np.nan)[mine]
        return values

    names = (
        ("s_m", "l_m", "heading_error_rad")
        if on_path
        else ("x_m", "y_m", "heading_rad")
    )
    x, y, heading = (kept(key) for key in names)
    return BodyTrack(
        x,
        y,
        heading,
        kept("speed_mps"),
        kept("acceleration_mps2"),
        float(table["length_m"][mine[-1]]),
        float(table["width_m"][mine[-1]]),
    )


def _obstacle(
    trace: Trace, name: str, rows: IntArray, *, on_path: bool = True
) -> BodyTrack:
    """Return an obstacle as a body that stands; a disc as the square about it."""
    bodies = trace.obstacles
    place = int(np.flatnonzero(bodies["id"] == name)[0])
    return _standing(bodies, place, _obstacle_places(trace, on_path=on_path), rows)


def _obstacle_places(trace: Trace, *, on_path: bool) -> Places:
    """Return the obstacles' places, on the path or the map."""
    if on_path:
        return obstacle_places(trace)
    x, y, heading = (
        np.ma.getdata(trace.obstacles[key]) for key in ("x_m", "y_m", "heading_rad")
    )
    return x, y, heading


def _standing(bodies: Table, place: int, places: Places, rows: IntArray) -> BodyTrack:
    """Return one obstacle as a body that stands."""
    x, y, heading = (np.full(rows.size, float(axis[place])) for axis in places)
    grown = 2.0 * float(np.ma.getdata(bodies["radius_m"])[place])
    still = np.zeros(rows.size)
    return BodyTrack(
        x,
        y,
        heading,
        still,
        still,
        float(np.ma.getdata(bodies["length_m"])[place]) + grown,
        float(np.ma.getdata(bodies["width_m"])[place]) + grown,
    )


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
        track = _vehicle(trace, name, rows, on_path=on_path)
        if name != body and track is not None and np.isfinite(track.x[-1]):
            found.append(track)
    places = _obstacle_places(trace, on_path=on_path)
    ego = _ego(trace, rows[-1:], on_path=on_path)
    for k, name in enumerate(trace.obstacles["id"]):
        far = np.hypot(places[0][k] - ego.x[-1], places[1][k] - ego.y[-1])
        if name != body and far < NEAR:
            found.append(_standing(trace.obstacles, k, places, rows))
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
    """Return who has to let the other go first, `ego`, `other` or empty."""
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
    return "ego" if foes["goes_first"][last] else ""
