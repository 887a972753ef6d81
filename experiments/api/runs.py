"""A run in Python: outcome, tables, figure and page of a run folder."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from experiments.api.frames import frame
from experiments.errors import ResultsError
from experiments.metrics.columns import Cell
from experiments.metrics.row import read_row
from experiments.report.figures.save import run_figure, save_figure
from experiments.report.run.page import save_run_page
from experiments.storage.atomic_folder import require_there
from experiments.storage.run_files import MANIFEST, read_manifest
from experiments.trace.files import MANY_EGOS, read_table, read_trace
from experiments.trace.fleet import FLEET_TABLES
from experiments.trace.schema import TABLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Run:
    """A finished run; reads its folder when asked, and never changes what is in it.

    Made by `Scenario.run` and `Run.open`.
    """

    def __init__(self, folder: Path, manifest: Mapping[str, Any]) -> None:
        self._folder = folder
        self._manifest = manifest

    @classmethod
    def open(cls, folder: str | Path) -> "Run":
        """Open a run folder, also one of a sweep.

        Raises:
            ResultsError: If it is not one, or is damaged.
        """
        folder = Path(folder)
        require_there(folder)
        if not (folder / MANIFEST).is_file():
            raise ResultsError(
                f"{folder}: is not a run folder; allowed: one written by rearview run, "
                f"with {MANIFEST} in it"
            )
        return cls(folder, read_manifest(folder))

    @property
    def folder(self) -> Path:
        """Where the files of the run are."""
        return self._folder

    @property
    def manifest(self) -> Mapping[str, Any]:
        """What the run was made from: versions, hashes, command, how it ended."""
        return MappingProxyType(dict(self._manifest))

    @property
    def status(self) -> str:
        """How the run ended: `arrived`, `blocked`, `timeout`, `collision`, ..."""
        return str(self._manifest["status"])

    @property
    def reason(self) -> str:
        """Why it ended so, in one sentence."""
        return str(self._manifest.get("reason") or "")

    @property
    def trace_hash(self) -> str | None:
        """Hash of everything recorded but the timings; the same for the same run."""
        found = self._manifest.get("trace_hash")
        return None if found is None else str(found)

    @cached_property
    def row(self) -> Mapping[str, Cell]:
        """The results row: every metric by its column, None where it does not apply."""
        return MappingProxyType(read_row(self._folder))

    def frames(self, library: str = "pandas") -> dict[str, Any]:
        """Read the recorded tables as data frames.

        Args:
            library: `pandas` or `polars`.

        Returns:
            Table to data frame: `steps` (one row a step), `vehicles`, `plans`,
            `obstacles`, ... with the columns of the reference of run folders; of a run
            with many egos `fleet`, `egos`, `ego_ends` and `fleet_steps`.

        Raises:
            ConfigError: If the library is not there.
            ResultsError: If the run kept no trace, or a file is damaged.
        """
        if (self._folder / MANY_EGOS).exists():
            return {
                name: frame(
                    read_table(kinds, self._folder / f"{name}.parquet"), library
                )
                for name, kinds in FLEET_TABLES.items()
            }
        trace = read_trace(self._folder)
        names = [*TABLES, "timing", *trace.model_tables()]
        return {name: frame(getattr(trace, name), library) for name in names}

    def figure(self, file: str | Path | None = None) -> "Figure":
        """Draw the run: the road from above, and curves over time.

        Args:
            file: Where the picture goes too: `.png`, `.svg` or `.pdf`.

        Returns:
            The figure of matplotlib, which notebooks show.

        Raises:
            ConfigError: If the suffix is unknown.
            ResultsError: If the run cannot be read, or matplotlib is missing.
        """
        if file is not None:
            save_figure(self._folder, Path(file))
        return run_figure(self._folder)

    def report(self, file: str | Path | None = None) -> Path:
        """Write the page that replays the run.

        Args:
            file: Where it goes; `report.html` in the run folder if None.

        Returns:
            The page's file.

        Raises:
            ResultsError: If the run cannot be read, or the page not be written.
        """
        return save_run_page(self._folder, None if file is None else Path(file))

    def __repr__(self) -> str:
        """Name the folder and how the run ended."""
        return f"<Run {self._folder.name}: {self.status}>"
