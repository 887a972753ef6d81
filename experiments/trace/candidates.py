"""Candidates of the planning cycles, thinned, kept beside a trace for display.

They are not part of the trace or its hash: not every planner returns any, and sweeps do
not keep them. One row is one point of one candidate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from experiments.trace.files import read_table, write_tables
from experiments.trace.schema import Kind, Table
from planner.interface import Alternative
from planner.states import FloatArray

CANDIDATES_FILE = "candidates.parquet"
CANDIDATES: Mapping[str, Kind] = {
    "index": Kind.COUNT,  # of the step
    "number": Kind.COUNT,  # of the candidate in its cycle
    "verdict": Kind.TEXT,  # kept, or the check that removed it
    "x_m": Kind.NUMBER,
    "y_m": Kind.NUMBER,
}


@dataclass(slots=True)
class CandidateLog:
    """Collects the candidates of a running episode."""

    cycles: list[tuple[int, Sequence[Alternative]]] = field(default_factory=list)

    def add(self, index: int, alternatives: Sequence[Alternative]) -> None:
        """Add the candidates of one cycle."""
        self.cycles.append((index, alternatives))

    def table(self) -> Table:
        """Return all candidates as columns."""
        rows: list[tuple[int, int, Alternative]] = [
            (index, number, one)
            for index, alternatives in self.cycles
            for number, one in enumerate(alternatives)
        ]
        sizes = [one.x.size for _, _, one in rows]
        return {
            "index": np.repeat([index for index, _, _ in rows], sizes).astype(np.int64),
            "number": np.repeat([n for _, n, _ in rows], sizes).astype(np.int64),
            "verdict": np.repeat(
                np.array([one.verdict for _, _, one in rows], dtype=object), sizes
            ),
            "x_m": _joined([one.x for _, _, one in rows]),
            "y_m": _joined([one.y for _, _, one in rows]),
        }


def _joined(parts: list[FloatArray]) -> FloatArray:
    """Join coordinates, rounded to centimetres: enough to draw, and small."""
    return np.round(np.concatenate([np.empty(0), *parts]), 2)


def write_candidates(log: CandidateLog, folder: Path) -> None:
    """Write the candidates into a run folder; nothing where there are none.

    Raises:
        ResultsError: If the file cannot be written.
    """
    if log.cycles:
        write_tables([(log.table(), CANDIDATES, folder / CANDIDATES_FILE)])


def read_candidates(folder: Path) -> Table | None:
    """Read the candidates of a run; None if none were kept.

    Raises:
        ResultsError: If the file is damaged.
    """
    file = folder / CANDIDATES_FILE
    return read_table(CANDIDATES, file) if file.is_file() else None
