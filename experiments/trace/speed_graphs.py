"""The s-T graphs of the planning cycles, kept beside a trace for display.

Like the candidates, they are not part of the trace or its hash. One row is one knot of
the chosen profile (its id is empty) or of one vehicle that is in the way then.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from experiments.trace.files import read_table, write_tables
from experiments.trace.schema import Kind, Table, column
from planner.interface import SpeedGraph

GRAPHS_FILE = "speed_graphs.parquet"
GRAPHS: Mapping[str, Kind] = {
    "index": Kind.COUNT,  # of the step
    "id": Kind.TEXT,
    "side": Kind.TEXT,  # before, after
    "t_s": Kind.NUMBER,  # from the step on
    "lower_m": Kind.NUMBER,
    "upper_m": Kind.NUMBER,
}
SPACING = 0.2  # between the knots kept [s]

Row = tuple[int, str, str, float, float, float]


def write_graphs(cycles: Sequence[tuple[int, SpeedGraph]], folder: Path) -> None:
    """Write the graphs into a run folder; nothing where there are none.

    Args:
        cycles: Index of the step and its graph.
        folder: Of the run.

    Raises:
        ResultsError: If the file cannot be written.
    """
    rows = [row for index, graph in cycles for row in _rows(index, graph)]
    if rows:
        columns = zip(*rows, strict=True)
        table = {
            key: column(values, kind)
            for (key, kind), values in zip(GRAPHS.items(), columns, strict=True)
        }
        write_tables([(table, GRAPHS, folder / GRAPHS_FILE)])


def read_graphs(folder: Path) -> Table | None:
    """Read the graphs of a run; None if none were kept.

    Raises:
        ResultsError: If the file is damaged.
    """
    file = folder / GRAPHS_FILE
    return read_table(GRAPHS, file) if file.is_file() else None


def _rows(index: int, graph: SpeedGraph) -> list[Row]:
    """Return the rows of one cycle, thinned, in centimetres."""
    every = max(round(SPACING / float(graph.t[1] - graph.t[0])), 1)
    kept = np.arange(0, graph.t.size, every)
    t, s = graph.t[kept].round(3).tolist(), graph.distance[kept].round(2).tolist()
    rows: list[Row] = [(index, "", "", *row) for row in zip(t, s, s, strict=True)]
    bounds = zip(graph.ids, graph.sides, graph.lower, graph.upper, strict=True)
    for name, side, lower, upper in bounds:
        ends = lower[kept].round(2).tolist(), upper[kept].round(2).tolist()
        knots = zip(t, *ends, strict=True)
        rows += [(index, name, side, *knot) for knot in knots if np.isfinite(knot[1])]
    return rows
