"""A sweep in Python: execute what is missing, then look at the results."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from experiments.api.frames import frame, table_of
from experiments.api.runs import Run
from experiments.api.sweep_session import SweepSession
from experiments.comparison.results import ALL_RUNS, Row, rows
from experiments.config.counted import counted
from experiments.config.sweep_file import load_sweep, sweep_of
from experiments.errors import ConfigError
from experiments.report.figures.save import save_figure
from experiments.report.html import PAGE_FILE
from experiments.report.sweep.page import save_sweep_page
from experiments.sweep.folder import require_sweep, run_folder, run_folders

SWEEPS = Path("sweeps")  # parent of the folders of sweeps


class SweepResults:
    """The results of a sweep, one row a run.

    Made by `sweep` and `SweepResults.open`.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @classmethod
    def open(cls, folder: str | Path) -> "SweepResults":
        """Open the folder of a sweep, also one that is not finished.

        Raises:
            ConfigError: If it is not one.
        """
        require_sweep(Path(folder))
        return cls(Path(folder))

    @property
    def folder(self) -> Path:
        """Where the sweep and its runs are."""
        return self._folder

    def rows(self, sql: str = ALL_RUNS) -> list[Row]:
        """Return rows as dictionaries.

        Args:
            sql: One SELECT on the table `runs`, which has the columns `run_id`,
                `label` (of the planner), the axes, every metric, and how it ended.

        Raises:
            ConfigError: If SQL cannot understand it.
        """
        return rows(self._folder, sql, "sql")

    def frame(self, sql: str = ALL_RUNS, library: str = "pandas") -> Any:
        """Return rows as a data frame of pandas or polars; see `rows`."""
        return frame(table_of(self.rows(sql)), library)

    def runs(self) -> list[Run]:
        """Return the runs, by their ids."""
        return [Run.open(folder) for folder in run_folders(self._folder)]

    def run(self, run_id: str) -> Run:
        """Open the run with an id of the results."""
        return Run.open(run_folder(self._folder, run_id))

    def figure(self, file: str | Path) -> Path:
        """Draw the sweep; returns the file, `.png`, `.svg` or `.pdf`."""
        return save_figure(self._folder, Path(file))

    def report(self) -> Path:
        """Write the page of the sweep and return its file."""
        save_sweep_page(self._folder)
        return self._folder / PAGE_FILE

    def __len__(self) -> int:
        """Count the runs."""
        return sum(1 for _ in run_folders(self._folder))

    def __repr__(self) -> str:
        """Name the folder and the number of runs."""
        return f"<SweepResults {self._folder}: {counted(len(self), 'run')}>"


def sweep(
    source: str | Path | Mapping[str, Any],
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    limit: int | None = None,
    allow_planners: Collection[str] = (),
    show: Callable[[str], object] | None = None,
) -> SweepResults:
    """Execute the missing runs of a sweep and collect the results.

    The same call resumes: runs that are there are not repeated. Each run has a process
    of its own unless `workers` is 0. A script that calls this with workers needs the
    usual `if __name__ == "__main__":`.

    Args:
        source: Shipped name, see `rearview.sweeps`, a `.yaml` file, or the content of
            one as a dictionary.
        out: Folder of the sweep; `sweeps/NAME` if None.
        workers: Processes; one per core if None.
        limit: Execute at most this many runs.
        allow_planners: Modules of planners that the file may name though they are not
            beside it; their code is run.
        show: Called with each line that the command line would print.

    Returns:
        The results.

    Raises:
        ConfigError: One line that names the file, the key and what is allowed.
        ResultsError: If the disk refuses.
    """
    if workers is not None and workers < 0:
        raise ConfigError(f"sweep: workers: is {workers}; allowed: 0 or more")
    if isinstance(source, Mapping):
        asked, document = sweep_of(source)
    else:
        asked, document = load_sweep(str(source), allow_planners)
    folder = Path(out or SWEEPS / asked.name).absolute()
    session = SweepSession(asked, document, folder, workers, None, limit)
    for line in session.drive():
        if show is not None:
            show(line)
    return SweepResults(folder)
