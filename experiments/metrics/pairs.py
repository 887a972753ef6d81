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
