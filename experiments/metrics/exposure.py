"""Surrogate measures of safety over time: TET, DRAC and PET.

Sources:
    Minderhoud, Bovy: Extended time-to-collision measures for road traffic safety
        assessment. Accident Analysis and Prevention 33 (2001).
    Allen, Shin, Cooper: Analysis of traffic conflicts and collisions. Transportation
        Research Record 667 (1978), for PET; Cooper, Perrott 1984, for DRAC.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from experiments.metrics.pairs import neighbours
from experiments.metrics.safety import leader_gaps, time_to_contact
from experiments.trace.schema import Trace
from planner.states import BoolArray, FloatArray

CRITICAL_TTC = 3.0  # below it time is exposed [s]
LEAST_GAP = 0.1  # a smaller gap counts as this, so that DRAC stays finite [m]
CELL = 0.5  # of the road, in which encroachment is looked for [m]
PET_HORIZON = 5.0  # later arrivals are no conflict [s]
CHUNK = 200  # footprints at a time, so that they stay in the processor's cache
FAR = 2**20  # cells from the path's start, within which all are


class _Footprints(NamedTuple):
    """Where bodies were in the Frenet plane of the ego's path; (n,) each."""

    step: NDArray[np.int64]  # its index
    s: FloatArray  # of the centre [m]
    l: FloatArray
    heading: FloatArray  # relative to the path [rad]
    length: FloatArray  # [m]
    width: FloatArray

    def among(self, kept: BoolArray) -> "_Footprints":
        """Return those marked in `kept`, (n,)."""
        step, *columns = self
        return _Footprints(step[kept], *(column[kept] for column in columns))


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
    around = int(np.ceil(PET_HORIZON / float(trace.fact("step_s"))))
    ego, others = _footprints(trace)
    ego_index, ego_cell = _covered(ego)
    index, cell = _covered(others.among(_near_in_time(ego, others, around)))
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


def _footprints(trace: Trace) -> tuple[_Footprints, _Footprints]:
    """Return the ego's footprints, in the order of steps, and those of vehicles."""
    steps, vehicles = trace.steps, trace.vehicles
    size = [
        np.full(len(steps["index"]), float(trace.fact(name)))
        for name in ("length_m", "width_m")
    ]
    own = ("centre_s_m", "centre_l_m", "heading_error_rad")
    names = ("s_m", "l_m", "heading_error_rad", "length_m", "width_m")
    return (
        _Footprints(
            np.ma.getdata(steps["index"]),
            *(np.ma.filled(steps[name], np.nan) for name in own),
            *size,
        ),
        _Footprints(
            np.ma.getdata(vehicles["index"]),
            *(np.ma.filled(vehicles[name], np.nan) for name in names),
        ),
    )


def _near_in_time(ego: _Footprints, others: _Footprints, around: int) -> BoolArray:
    """Mark footprints that the ego's may share a cell with within some steps, (n,).

    All others stay clear, with the circle round the body, of the box of the ego's
    centres from `around` steps before to as many after.
    """
    if not ego.step.size:
        return np.zeros(others.step.size, dtype=np.bool_)
    own = np.hypot(ego.length[0], ego.width[0])
    reach = (np.hypot(others.length, others.width) + own) / 2.0
    row = np.searchsorted(ego.step, others.step).clip(max=ego.step.size - 1)
    near = np.ones(others.step.size, dtype=np.bool_)
    for centres, place in ((ego.s, others.s), (ego.l, others.l)):
        least, most = _extremes(centres, around)
        near &= (place >= least[row] - reach) & (place <= most[row] + reach)
    return near


def _extremes(values: FloatArray, around: int) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest of the values up to `around` rows away, (n,)."""
    bounds = []
    for beyond, extreme in ((np.inf, np.min), (-np.inf, np.max)):
        known = np.where(np.isfinite(values), values, beyond)
        padded = np.pad(known, around, constant_values=beyond)
        bounds.append(extreme(sliding_window_view(padded, 2 * around + 1), axis=1))
    return bounds[0], bounds[1]


def _covered(bodies: _Footprints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the steps and cells of footprints, (n_covered,) each.

    Rows without a place in the plane are left out. Cells are numbered by place.
    """
    framed = np.isfinite(bodies.s) & np.isfinite(bodies.l) & np.isfinite(bodies.heading)
    index, s, l, heading, length, width = bodies.among(framed)
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
