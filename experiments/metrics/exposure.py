"""Surrogate measures of safety over time: TET, DRAC and PET.

Sources:
    Minderhoud, Bovy: Extended time-to-collision measures for road traffic safety
        assessment. Accident Analysis and Prevention 33 (2001).
    Allen, Shin, Cooper: Analysis of traffic conflicts and collisions. Transportation
        Research Record 667 (1978), for PET; Cooper, Perrott 1984, for DRAC.
"""

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.pairs import neighbours
from experiments.metrics.safety import leader_gaps, time_to_contact
from experiments.trace.schema import Trace
from planner.states import FloatArray

CRITICAL_TTC = 3.0  # below it time is exposed [s]
LEAST_GAP = 0.1  # a smaller gap counts as this, so that DRAC stays finite [m]
CELL = 0.5  # of the road, in which encroachment is looked for [m]
PET_HORIZON = 5.0  # later arrivals are no conflict [s]
CHUNK = 2000  # footprints at a time, so that memory stays bounded
FAR = 2**20  # cells from the path's start, within which all are


def time_exposed_ttc(trace: Trace) -> float | None:
    """Return the time with a TTC to some vehicle below `CRITICAL_TTC` [s].

    The TTC is that of `safety.min_time_to_collision`. None without vehicles.
    """
    exposed = exposed_steps(trace)
    return None if exposed is None else float(exposed.size * trace.fact("step_s"))


def exposed_steps(trace: Trace) -> NDArray[np.int64] | None:
    """Return the indices of the steps that `time_exposed_ttc` counts."""
    pairs = neighbours(trace)
    if not pairs.ds.size:
        return None
    return np.unique(pairs.index[time_to_contact(pairs) < CRITICAL_TTC])


def max_drac(trace: Trace) -> float | None:
    """Return the largest deceleration rate to avoid a crash with a leader [m/s²].

    (s_dot - s_dot of the leader)² / (2 gap) while the gap closes, leader and gap as for
    the time headway. 0 behind leaders that are never approached, None without any.
    """
    found = largest_drac(trace)
    return None if found is None else found[0]


def largest_drac(trace: Trace) -> tuple[float, int] | None:
    """Return `max_drac` [m/s²] and the index of its step."""
    pairs = neighbours(trace)
    gap, leads = leader_gaps(pairs)
    if not leads.any():
        return None
    closing = np.maximum(-pairs.ds_dot[leads], 0.0)
    needed = closing**2 / (2.0 * np.maximum(gap[leads], LEAST_GAP))
    return float(needed.max()), int(pairs.index[leads][needed.argmax()])


def min_post_encroachment_time(trace: Trace) -> float | None:
    """Return the shortest time between two bodies at one place of the road [s].

    The places are cells of `CELL` in the Frenet plane of the ego's path, whose centres
    a footprint covers; the time is from when the ego or a vehicle has left one to when
    the other comes there, to within a step and a cell, 0 if both are there. A follower
    or leader in the ego's lane counts with its gap in time. None above `PET_HORIZON`.
    """
    found = closest_encroachment(trace)
    return None if found is None else found[0]


def closest_encroachment(trace: Trace) -> tuple[float, int] | None:
    """Return the time of `min_post_encroachment_time` [s] and the index of its step.

    The step is that of the later of the two visits of the place.
    """
    steps, vehicles = trace.steps, trace.vehicles
    ego_index, ego_cell = _covered(
        steps["index"],
        np.ma.filled(steps["centre_s_m"], np.nan),
        np.ma.filled(steps["centre_l_m"], np.nan),
        np.ma.filled(steps["heading_error_rad"], np.nan),
        np.full(len(steps["index"]), float(trace.fact("length_m"))),
        np.full(len(steps["index"]), float(trace.fact("width_m"))),
    )
    index, cell = _covered(
        vehicles["index"],
        *(
            np.ma.filled(vehicles[name], np.nan)
            for name in ("s_m", "l_m", "heading_error_rad", "length_m", "width_m")
        ),
    )
    if not ego_cell.size or not cell.size:
        return None
    # one number for (cell, step), so that the nearest visit of the ego is a search
    span = int(max(ego_index.max(), index.max())) + 1
    ego_visits = np.sort(ego_cell * span + ego_index)
    visits = cell * span + index
    after = np.searchsorted(ego_visits, visits)
    shortest, moment = np.inf, 0
    for place in (after - 1, after):
        near = ego_visits[np.clip(place, 0, ego_visits.size - 1)]
        apart = np.where(near // span == cell, np.abs(near - visits), np.inf)
        least = int(apart.argmin())
        if apart[least] < shortest:
            shortest = float(apart[least])
            moment = int(max(near[least], visits[least]) % span)
    time = shortest * float(trace.fact("step_s"))
    return (time, moment) if time <= PET_HORIZON else None


def _covered(
    index: NDArray[np.int64],
    s: FloatArray,
    l: FloatArray,
    heading: FloatArray,
    length: FloatArray,
    width: FloatArray,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the steps and cells of footprints, (n_covered,) each.

    Rows without a place in the plane are left out. Cells are numbered by place.
    """
    framed = np.isfinite(s) & np.isfinite(l) & np.isfinite(heading)
    index = np.ma.getdata(index)[framed]
    s, l, heading = s[framed], l[framed], heading[framed]
    length, width = length[framed], width[framed]
    if not s.size:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    reach = int(np.ceil(np.hypot(length.max(), width.max()) / 2.0 / CELL)) + 1
    grid = np.arange(-reach, reach + 1)
    row, column = (axis.ravel() for axis in np.meshgrid(grid, grid, indexing="ij"))
    found = []
    for k in range(0, s.size, CHUNK):
        part = slice(k, k + CHUNK)
        base_s, base_l = (np.floor(x[part] / CELL).astype(np.int64) for x in (s, l))
        cell_s, cell_l = base_s[:, None] + row, base_l[:, None] + column
        ds = (cell_s + 0.5) * CELL - s[part, None]
        dl = (cell_l + 0.5) * CELL - l[part, None]
        cos, sin = np.cos(heading[part, None]), np.sin(heading[part, None])
        inside = (np.abs(ds * cos + dl * sin) <= length[part, None] / 2.0) & (
            np.abs(dl * cos - ds * sin) <= width[part, None] / 2.0
        )
        steps = np.broadcast_to(index[part, None], inside.shape)
        cells = (cell_s + FAR) * (2 * FAR) + cell_l + FAR
        found.append((steps[inside], cells[inside]))
    steps, cells = (np.concatenate(columns) for columns in zip(*found, strict=True))
    return steps, cells
