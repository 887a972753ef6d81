"""A run with many egos as data for its page."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from experiments.errors import ResultsError
from experiments.report.run.packing import pack, pack_counts, pack_exact
from experiments.report.run.road import page_lanes
from experiments.report.run_reader import numbers
from experiments.trace.files import read_table
from experiments.trace.fleet import FLEET_PLANS, FLEET_TABLES, PLANS_FILE
from experiments.trace.road_map import MapLane, RoadMap
from experiments.trace.schema import Table
from planner.states import FloatArray, IntArray

MOST_ROWS: Final = 1_200_000  # of vehicles in a page; steps are left out beyond them
PLACE = 0.5  # resolution of the picture of time and space [m]
COARSE, FINE, ANGLE = 0.02, 0.01, 1e-3  # of places [m], speeds, headings
HUMAN: Final = 255  # code of a vehicle of no group


def read_tables(folder: Path) -> tuple[dict[str, Table], Table | None]:
    """Read the tables of a run with many egos, and where plans lead.

    Raises:
        ResultsError: If a table is missing or damaged.
    """
    tables = {
        name: read_table(kinds, folder / f"{name}.parquet")
        for name, kinds in FLEET_TABLES.items()
    }
    file = folder / PLANS_FILE
    if not file.is_file():  # of an earlier version
        return tables, None
    plans = read_table(FLEET_PLANS, file)
    if len(plans["x1_m"]) != len(tables["egos"]["index"]):
        raise ResultsError(f"{file}: does not fit the table of the egos beside it")
    return tables, plans


def fleet_replay(
    tables: dict[str, Table],
    plans: Table | None,
    road_map: RoadMap,
    drivers: Sequence[str],
) -> dict[str, Any]:
    """Pack a run for its page.

    Args:
        tables: By name.
        plans: Row by row beside the egos.
        road_map: All lanes.
        drivers: Of the groups of egos.
    """
    fleet, steps = tables["fleet"], tables["fleet_steps"]
    index = np.asarray(fleet["index"], dtype=np.int64)
    shown = _shown_steps(index, np.asarray(steps["index"], dtype=np.int64))
    rows = np.flatnonzero(np.isin(index, shown))
    ids, vehicle = np.unique(fleet["id"].astype(str), return_inverse=True)
    way = _way(fleet, road_map)
    size = {name: _first(vehicle, numbers(fleet[name])) for name in _SIZES}
    group = np.where(np.ma.getmaskarray(fleet["group"]), HUMAN, 0)
    group += np.ma.filled(np.ma.asarray(fleet["group"]), 0).astype(np.int64)
    return {
        "time": pack(numbers(steps["time_s"])[np.isin(steps["index"], shown)], 1e-3),
        "start": pack_counts(np.searchsorted(index[rows], [*shown, index.max() + 1])),
        "ids": ids.tolist(),
        "length": np.round(size["length_m"], 2).tolist(),
        "width": np.round(size["width_m"], 2).tolist(),
        "drivers": list(drivers),
        "way": pack(way[rows], PLACE),
        "id": pack_counts(vehicle[rows]),
        "group": pack_counts(group[rows]),
        "x": pack(numbers(fleet["x_m"])[rows], COARSE),
        "y": pack(numbers(fleet["y_m"])[rows], COARSE),
        "heading": pack(
            _unwrapped(vehicle, numbers(fleet["heading_rad"]))[rows], ANGLE
        ),
        "speed": pack(numbers(fleet["speed_mps"])[rows], FINE),
        "plans": _packed_plans(tables["egos"], plans, shown, ids),
        "road": page_lanes(road_map),
        "ends": _ends(tables["ego_ends"], steps),
    }


_SIZES = ("length_m", "width_m")


def _shown_steps(index: IntArray, steps: IntArray) -> IntArray:
    """Return the steps of a page: all, or every so many."""
    every = max(1, -(-index.size // MOST_ROWS))
    return np.asarray(steps[::every])


def _first(vehicle: IntArray, values: FloatArray) -> FloatArray:
    """Return the first value of each vehicle."""
    return np.asarray(values[np.unique(vehicle, return_index=True)[1]])


def _unwrapped(vehicle: IntArray, heading: FloatArray) -> FloatArray:
    """Let the heading of each vehicle go on without jumps [rad]."""
    order = np.argsort(vehicle, kind="stable")
    out = heading.copy()
    ends = np.flatnonzero(np.diff(vehicle[order])) + 1
    for part in np.split(order, ends):
        out[part] = np.unwrap(heading[part])
    return out


def _way(fleet: Table, road_map: RoadMap) -> FloatArray:
    """Place every row along the edges of the vehicle that came over most of them [m].

    Returns:
        The front bumper's arc length, NaN of a row that is on none of these edges.
    """
    lengths: dict[str, float] = {}
    for lane in road_map.lanes:
        lengths.setdefault(lane.edge, _length(lane))
    lanes, number = np.unique(
        np.array([x or "" for x in fleet["lane"]], dtype=str), return_inverse=True
    )
    edges = [name.rpartition("_")[0] for name in lanes]
    ids = fleet["id"].astype(str)
    best: list[str] = []
    far = 0.0
    order = np.lexsort((np.arange(ids.size), ids))
    bounds = np.flatnonzero(ids[order][1:] != ids[order][:-1]) + 1
    for part in np.split(order, bounds):
        seen = dict.fromkeys(edges[k] for k in number[part].tolist() if edges[k])
        driven = sum(lengths.get(edge, 0.0) for edge in seen)
        if driven > far:
            best, far = list(seen), driven
    begins = np.concatenate(([0.0], np.cumsum([lengths.get(x, 0.0) for x in best])))
    place = {edge: float(begins[k]) for k, edge in enumerate(best)}
    offset = np.array([place.get(edge, np.nan) for edge in edges])
    return np.asarray(offset[number] + numbers(fleet["position_m"]))


def _length(lane: MapLane) -> float:
    """Return the length of a lane [m]."""
    return float(np.hypot(*np.diff(lane.points, axis=0).T).sum())


def _packed_plans(
    egos: Table, plans: Table | None, shown: IntArray, ids: FloatArray
) -> dict[str, Any] | None:
    """Pack where plans lead, by steps."""
    if plans is None:
        return None
    index = np.asarray(egos["index"], dtype=np.int64)
    rows = np.flatnonzero(np.isin(index, shown))
    vehicle = np.searchsorted(ids, egos["id"].astype(str)[rows])
    starts = np.searchsorted(index[rows], [*shown, shown[-1] + 1])
    found: dict[str, Any] = {"start": pack_counts(starts), "id": pack_counts(vehicle)}
    for name in FLEET_PLANS:
        found[name.removesuffix("_m")] = pack_exact(numbers(plans[name])[rows])
    return found


def _ends(ends: Table, steps: Table) -> list[dict[str, Any]]:
    """List how egos ceased to be ones, but for those that arrived."""
    time = dict(zip(steps["index"].tolist(), steps["time_s"].tolist(), strict=True))
    return [
        {
            "time": float(time[index]),
            "id": str(name),
            "text": f"{name}: {how}, {reason}",
        }
        for index, name, how, reason in zip(
            *(ends[key].tolist() for key in ("index", "id", "how", "reason")),
            strict=True,
        )
        if how != "arrived"
    ]
