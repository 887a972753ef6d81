"""The candidates of the cycles for a run page."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.report.run.packing import pack, pack_counts
from experiments.report.run_reader import numbers
from experiments.trace.candidates import read_candidates
from experiments.trace.schema import Table, Trace

PLACE = 0.02  # resolution [m]


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """One row per point; `index` is the step, `number` the candidate."""

    table: Table

    def packed(self, trace: Trace) -> dict[str, Any]:
        """Pack the candidates, with the first of each step and their first points."""
        index, number = (np.ma.getdata(self.table[k]) for k in ("index", "number"))
        fresh = np.ones(index.size, dtype=bool)
        fresh[1:] = (np.diff(index) != 0) | (np.diff(number) != 0)
        first = np.flatnonzero(fresh)  # row of the first point of each
        steps = trace.steps["index"]
        ends = np.append(steps, steps[-1] + 1)
        verdicts, codes = np.unique(
            np.ma.filled(self.table["verdict"], "").astype(str)[first],
            return_inverse=True,
        )
        return {
            "verdicts": verdicts.tolist(),
            "verdict": pack_counts(codes),
            "start": pack_counts(np.searchsorted(index[first], ends)),
            "points": pack_counts(np.append(first, index.size)),
            "x": pack(numbers(self.table["x_m"]), PLACE),
            "y": pack(numbers(self.table["y_m"]), PLACE),
        }


def candidates_of(folder: Path) -> Candidates | None:
    """Read the candidates of a run; None if none were kept.

    Raises:
        ResultsError: If their file is damaged.
    """
    table = read_candidates(folder)
    return None if table is None else Candidates(table)
