"""The motions of a recorded episode as tracks, on the ego's path or on the map."""

import numpy as np

from experiments.metrics.pairs import obstacle_places
from experiments.metrics.verdict.records import BodyTrack
from experiments.trace.schema import Table, Trace
from planner.states import FloatArray, IntArray

Places = tuple[FloatArray, FloatArray, FloatArray]  # x, y, heading


def ego_track(trace: Trace, rows: IntArray, *, on_path: bool = False) -> BodyTrack:
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


def vehicle_track(
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


def obstacle_track(
    trace: Trace, name: str, rows: IntArray, *, on_path: bool = True
) -> BodyTrack:
    """Return an obstacle as a body that stands; a disc as the square about it."""
    bodies = trace.obstacles
    place = int(np.flatnonzero(bodies["id"] == name)[0])
    return standing_track(
        bodies, place, places_of_obstacles(trace, on_path=on_path), rows
    )


def places_of_obstacles(trace: Trace, *, on_path: bool) -> Places:
    """Return the obstacles' places, on the path or the map."""
    if on_path:
        return obstacle_places(trace)
    x, y, heading = (
        np.ma.getdata(trace.obstacles[key]) for key in ("x_m", "y_m", "heading_rad")
    )
    return x, y, heading


def standing_track(
    bodies: Table, place: int, places: Places, rows: IntArray
) -> BodyTrack:
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
