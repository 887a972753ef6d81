"""The s-T graphs of the cycles for a run page."""

from typing import Any

import numpy as np

from experiments.report.run.packing import pack, pack_counts
from experiments.report.run_reader import numbers
from experiments.trace.schema import Table, Trace

PLACE, TIME = 0.05, 1e-3  # resolutions [m, s]


def packed_graphs(table: Table, trace: Trace) -> dict[str, Any]:
    """Pack the graphs: lines and areas, step by step.

    Args:
        table: As `speed_graphs` keeps it.
        trace: Of the same run.

    Returns:
        Plain data for JSON: where the lines of each step begin, where the knots of
        each line begin, whose it is, and on which side the ego passes.
    """
    index = np.ma.getdata(table["index"])
    ids, sides = (np.ma.filled(table[k], "").astype(str) for k in ("id", "side"))
    fresh = np.ones(index.size, dtype=bool)
    fresh[1:] = (np.diff(index) != 0) | (ids[1:] != ids[:-1])
    first = np.flatnonzero(fresh)
    steps = trace.steps["index"]
    ends = np.append(steps, steps[-1] + 1)
    names, codes = np.unique(ids[first], return_inverse=True)
    return {
        "ids": names.tolist(),
        "id": pack_counts(codes),
        "after": pack_counts((sides[first] == "after").astype(np.int64)),
        "start": pack_counts(np.searchsorted(index[first], ends)),
        "knots": pack_counts(np.append(first, index.size)),
        "t": pack(numbers(table["t_s"]), TIME),
        "lower": pack(numbers(table["lower_m"]), PLACE),
        "upper": pack(numbers(table["upper_m"]), PLACE),
    }
