"""Ego and vehicles of each step joined, in the Frenet plane of the ego's path."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.trace.schema import Trace
from planner.states import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """Every vehicle in every step in which it and the ego project on the path.

    Arrays are (n_pairs,), in the order of steps. Differences are vehicle minus ego,
    centre to centre; headings are relative to the path.
    """

    index: NDArray[np.int64]  # step
    id: NDArray[Any]
    ds: FloatArray  # [m]
    dl: FloatArray
    ds_dot: FloatArray  # [m/s]
    dl_dot: FloatArray
    heading: FloatArray  # [rad]
    length: FloatArray  # [m]
    width: FloatArray
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]
    ego_heading: FloatArray  # [rad]
    ego_speed: FloatArray  # [m/s]
    ego_length: float  # [m]
    ego_width: float


def static_neighbours(trace: Trace) -> tuple[Neighbours, FloatArray]:
    """Join the obstacles with the ego of every step, and return their radii, (n,) [m].

    An obstacle is a rectangle, or a disc of length and width 0.
    """
    steps, bodies = trace.steps, trace.obstacles
    s, l, heading = obstacle_places(trace)
    framed = np.isfinite(np.ma.filled(steps["centre_s_m"], np.nan))
    ego = {
        name: np.ma.getdata(steps[name])[framed]
        for name in (
            "centre_s_m",
            "centre_l_m",
            "s_dot_mps",
            "l_dot_mps",
            "heading_error_rad",
            "speed_mps",
        )
    }
    step, body = (axis.ravel() for axis in np.indices((int(framed.sum()), int(s.size))))
    still = np.zeros(step.size)
    pairs = Neighbours(
        index=np.ma.getdata(steps["index"])[framed][step],
        id=bodies["id"][body],
        ds=s[body] - ego["centre_s_m"][step],
        dl=l[body] - ego["centre_l_m"][step],
        ds_dot=-ego["s_dot_mps"][step],
        dl_dot=-ego["l_dot_mps"][step],
        heading=heading[body],
        length=np.ma.getdata(bodies["length_m"])[body],
        width=np.ma.getdata(bodies["width_m"])[body],
        speed=still,
        acceleration=still,
        ego_heading=ego["heading_error_rad"][step],
        ego_speed=ego["speed_mps"][step],
        ego_length=float(trace.fact("length_m")),
        ego_width=float(trace.fact("width_m")),
    )
    return pairs, np.ma.getdata(bodies["radius_m"])[body]


def obstacle_places(trace: Trace) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (s, l) of each obstacle [m] and its heading against the path [rad]."""
    road, bodies = trace.road, trace.obstacles
    if not bodies["x_m"].size:
        return np.empty(0), np.empty(0), np.empty(0)
    dx = bodies["x_m"][:, None] - road["x_m"]
    dy = bodies["y_m"][:, None] - road["y_m"]
    near = np.argmin(np.hypot(dx, dy), axis=1)
    rows = np.arange(near.size)
    heading = np.ma.getdata(road["heading_rad"])[near]
    cos, sin = np.cos(heading), np.sin(heading)
    dx, dy = dx[rows, near], dy[rows, near]
    return (
        np.ma.getdata(road["s_m"])[near] + dx * cos + dy * sin,
        np.asarray(dy * cos - dx * sin),
        np.ma.getdata(bodies["heading_rad"]) - heading,
    )


def neighbours(trace: Trace) -> Neighbours:
    """Join the vehicles with the ego of their step."""
    steps, vehicles = trace.steps, trace.vehicles
    row = np.searchsorted(steps["index"], vehicles["index"])
    ego = {
        key: np.ma.filled(steps[key], np.nan)[row]
        for key in (
            "centre_s_m",
            "centre_l_m",
            "s_dot_mps",
            "l_dot_mps",
            "heading_error_rad",
            "speed_mps",
        )
    }
    other = {
        key: np.ma.filled(vehicles[key], np.nan)
        for key in ("s_m", "l_m", "s_dot_mps", "l_dot_mps", "heading_error_rad")
    }
    framed = np.isfinite(ego["centre_s_m"]) & np.isfinite(other["s_m"])

    def kept(values: FloatArray) -> FloatArray:
        return values[framed]

    return Neighbours(
        index=vehicles["index"][framed],
        id=vehicles["id"][framed],
        ds=kept(other["s_m"] - ego["centre_s_m"]),
        dl=kept(other["l_m"] - ego["centre_l_m"]),
        ds_dot=kept(other["s_dot_mps"] - ego["s_dot_mps"]),
        dl_dot=kept(other["l_dot_mps"] - ego["l_dot_mps"]),
        heading=kept(other["heading_error_rad"]),
        length=kept(vehicles["length_m"]),
        width=kept(vehicles["width_m"]),
        speed=kept(vehicles["speed_mps"]),
        acceleration=kept(vehicles["acceleration_mps2"]),
        ego_heading=kept(ego["heading_error_rad"]),
        ego_speed=kept(ego["speed_mps"]),
        ego_length=float(trace.fact("length_m")),
        ego_width=float(trace.fact("width_m")),
    )
