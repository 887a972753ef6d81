"""Junctions in the trace: what the ego met there, and the ways of the others."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from experiments.cosim.records import StepRecord
from experiments.trace.schema import TABLES, Column, Table, column
from experiments.trace.table_rows import from_rows
from planner.right_of_way.records import Foe, JunctionAhead, Rule
from planner.states import FloatArray
from planner.ways import NO_WAY, Ways

_FLAGS = frozenset(
    map(Foe._fields.index, ("merges", "goes_first", "gives_way", "held"))
)


def junction_table(records: Sequence[StepRecord]) -> Table:
    """Make one row for each junction near the ego in each step."""
    return from_rows(
        "junctions",
        [
            (
                r.index,
                x.id,
                str(x.rule),
                x.stop_s,
                x.exit_s,
                x.speed,
                math.nan if x.wait_s is None else x.wait_s,
            )
            for r in records
            for x in r.traffic.junctions
        ],
    )


def foe_table(records: Sequence[StepRecord]) -> Table:
    """Make one row for each foe in each step."""
    rows = [(r.index, *foe) for r in records for foe in r.traffic.foes]
    return from_rows("foes", rows)


def vehicle_way_table(records: Sequence[StepRecord]) -> Table:
    """Make one row for each vehicle in each step whose way is known."""
    rows = []
    for record in records:
        ways = record.traffic.ways
        if ways is None:
            continue
        known = np.flatnonzero(ways.way != NO_WAY).tolist()
        names = record.traffic.vehicles.ids
        for row in known:
            stop = float(ways.stop[row])
            cells = names[row], int(ways.way[row])
            rows.append(
                (record.index, *cells, stop if math.isfinite(stop) else math.nan)
            )
    return from_rows("vehicle_ways", rows)


def way_table(records: Sequence[StepRecord]) -> Table:
    """Make one row for each corner of each way."""
    known = [r.traffic.ways for r in records if r.traffic.ways is not None]
    lines = known[-1].lines if known else ()  # the list only grows
    numbers = np.repeat(np.arange(len(lines)), [line.shape[1] for line in lines])
    corners = np.concatenate([np.empty((3, 0)), *lines], axis=1)
    arrays = (numbers, *corners)
    return {
        key: column(values, kind)
        for (key, kind), values in zip(TABLES["ways"].items(), arrays, strict=True)
    }


def read_junctions(table: Table, rows: slice) -> tuple[JunctionAhead, ...]:
    """Restore the junctions near the ego in one step."""
    return tuple(
        JunctionAhead(
            name, Rule(rule), stop, end, speed, None if math.isnan(wait) else wait
        )
        for name, rule, stop, end, speed, wait in _cells(table, rows)
    )


def read_foes(table: Table, rows: slice) -> tuple[Foe, ...]:
    """Restore the foes of one step."""
    return tuple(
        Foe._make(cell if k not in _FLAGS else bool(cell) for k, cell in row)
        for row in map(enumerate, _cells(table, rows))
    )


def read_lines(table: Table) -> tuple[FloatArray, ...]:
    """Restore all ways: arc length, x, y of the corners, (3, m) each [m]."""
    corners = np.array([np.ma.getdata(table[key]) for key in ("s_m", "x_m", "y_m")])
    numbers = np.ma.getdata(table["way"])
    count = int(numbers.max()) + 1 if numbers.size else 0
    return tuple(np.ascontiguousarray(corners[:, numbers == k]) for k in range(count))


def read_ways(
    table: Table, rows: slice, names: Sequence[str], lines: tuple[FloatArray, ...]
) -> Ways:
    """Restore the ways of the vehicles in one step, in the order of `names`."""
    of: Mapping[str, tuple[int, float]] = {
        name: (way, math.inf if math.isnan(stop) else stop)
        for name, way, stop in _cells(table, rows)
    }
    found = [of.get(name, (NO_WAY, math.inf)) for name in names]
    way = np.array([way for way, _ in found], dtype=np.int64)
    return Ways(way, np.array([stop for _, stop in found]), lines)


def _cells(table: Table, rows: slice) -> list[tuple[Any, ...]]:
    """Return the rows of a table without the index; null is NaN."""
    columns: list[Column] = [
        np.ma.filled(values[rows], np.nan) if values.dtype.kind == "f" else values[rows]
        for key, values in table.items()
        if key != "index"
    ]
    return list(zip(*(values.tolist() for values in columns), strict=True))
