"""A study: planners over the panels of one kind of conflict, kept panel by panel.

A finished panel is one Parquet file, written at once. The folder of a planner carries
a hash of the code, the planner and the settings, so that a resumed study takes from
earlier runs only what would come out the same.
"""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from experiments.episode.identity import code_hash
from experiments.evidence.r157.drivers import drivers_of
from experiments.evidence.r157.grids import ConflictPanel
from experiments.evidence.r157.planner_runs import (
    RunRow,
    RunSettings,
    drive_cells,
    reference_planner,
)
from experiments.evidence.r157.simulate import ConflictEnd, collided
from experiments.planners.registry import make_planner, user_module
from experiments.planners.source_files import planner_sources
from experiments.storage.atomic_folder import make_folder
from experiments.storage.provenance import file_hash, text_hash
from experiments.sweep.processes.parallel import Work
from experiments.trace.files import read_table, write_tables
from experiments.trace.schema import Column, Kind, Table
from planner.interface import Planner
from planner.states import BoolArray

BATCH: Final = 15  # cells that a worker drives in one piece
COLUMNS: Final[Mapping[str, Kind]] = {
    "x": Kind.NUMBER,
    "y": Kind.NUMBER,
    "outcome": Kind.COUNT,
    "impact_speed_mps": Kind.NUMBER,
    "hardest_braking_mps2": Kind.NUMBER,
    "left_lane": Kind.COUNT,
    "follower_braking_mps2": Kind.NUMBER,
    "follower_hit": Kind.COUNT,
    "duration_s": Kind.NUMBER,
}
HARD_BRAKING: Final = 6.0 + 1e-6  # beyond it a run is shown as braked hard [m/s²]


@dataclass(frozen=True, slots=True, eq=False)
class PlannerPanel:
    """The runs of one planner in one panel."""

    panel: ConflictPanel
    planner: str
    table: Table  # `COLUMNS`, one row a flattened cell

    def cells(self, name: str) -> Column:
        """Return a column in the shape of the panel."""
        return np.asarray(self.table[name]).reshape(self.panel.shape)

    @property
    def collided(self) -> BoolArray:
        """Cells in which the planner collided, in the shape of the panel."""
        return collided(self.cells("outcome"))

    @property
    def failed(self) -> BoolArray:
        """Cells in which it left the road or returned nothing that can be driven."""
        return np.asarray(self.cells("outcome") == ConflictEnd.FAILED)

    @property
    def left_lane(self) -> BoolArray:
        """Cells in which it left its lane."""
        return np.asarray(self.cells("left_lane") > 0)

    @property
    def braked_hard(self) -> BoolArray:
        """Cells in which it braked harder than 6 m/s²."""
        return np.asarray(self.cells("hardest_braking_mps2") > HARD_BRAKING)


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    """Cells for a worker."""

    planner: str
    panel: ConflictPanel
    rows: Sequence[int]
    settings: RunSettings


def run_panel(
    planner: str,
    panel: ConflictPanel,
    settings: RunSettings,
    folder: Path,
    work: Work,
) -> PlannerPanel:
    """Return the runs of a planner in a panel, from the folder if they are there.

    Args:
        planner: Name of a registered planner or reference driver, or module:factory.
        panel: The panel.
        settings: Of the runs.
        folder: Of the study.
        work: Where the runs are made.

    Raises:
        ConfigError: If there is no such planner.
        ResultsError: If the folder cannot be written or a file in it is damaged.
    """
    place = folder / "panels" / _folder_name(planner, panel, settings)
    file = place / f"{panel.key}_{panel.x.size}x{panel.y.size}.parquet"
    if file.exists():
        return PlannerPanel(panel, planner, read_table(COLUMNS, file))
    pieces = [
        _Batch(planner, panel, range(k, min(k + BATCH, panel.cells)), settings)
        for k in range(0, panel.cells, BATCH)
    ]
    rows = [
        row
        for piece in work.map(f"{planner}: {panel.title}", _drive_batch, pieces)
        for row in piece
    ]
    table = _table(panel, rows)
    make_folder(place)
    aside = file.with_name(f".{file.name}.{os.getpid()}")
    write_tables([(table, COLUMNS, aside)])
    aside.replace(file)
    return PlannerPanel(panel, planner, table)


def check_planner(name: str) -> None:
    """Make a planner once, so that a wrong name is reported before anything runs.

    Raises:
        ConfigError: If there is no such planner.
    """
    make_planner(name, {})


def _drive_batch(batch: _Batch) -> list[RunRow]:
    """Drive some cells; called in a worker process."""
    planner: Planner | None = reference_planner(batch.panel, batch.planner)
    if planner is None:
        planner = make_planner(batch.planner, {})
    return drive_cells(planner, batch.panel, batch.rows, batch.settings)


def _table(panel: ConflictPanel, rows: Sequence[RunRow]) -> Table:
    """Return the columns of the runs."""
    x, y = panel.grid()
    values = [np.array(column) for column in zip(*rows, strict=True)]
    columns = dict(zip(COLUMNS, [x, y, *values], strict=True))
    return {
        name: columns[name].astype(np.float64 if kind is Kind.NUMBER else np.int64)
        for name, kind in COLUMNS.items()
    }


def _folder_name(planner: str, panel: ConflictPanel, settings: RunSettings) -> str:
    """Return the name of a planner's folder: kind, planner, hash of all that counts."""
    own = user_module(planner) if planner not in drivers_of(panel.kind) else None
    sources = [file_hash(file) for file in planner_sources(own)] if own else []
    made_of = f"{code_hash()} {planner} {sources} {panel.kind} {settings}"
    slug = re.sub(r"[^A-Za-z0-9_]+", "-", planner)
    return f"{panel.kind}-{slug}-{text_hash(made_of)[:10]}"
