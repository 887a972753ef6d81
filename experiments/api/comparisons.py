"""Comparisons of planners in Python."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from experiments.api.frames import frame, table_of
from experiments.api.sweeps import SweepResults
from experiments.comparison.compare import Center, Line
from experiments.comparison.compare import compare as compared
from experiments.comparison.question import question_of
from experiments.comparison.results import ALL_RUNS, rows
from experiments.comparison.table import as_markdown, export, records
from experiments.sweep.folder import require_sweep


class Comparison:
    """Planners compared with a baseline, one line per metric, cell and planner.

    Made by `compare`; `print` shows it as a Markdown table.
    """

    def __init__(self, lines: Sequence[Line]) -> None:
        self._lines = tuple(lines)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The lines as records; their fields are not part of the stable API."""
        return self._lines

    def frame(self, library: str = "pandas") -> Any:
        """Return the lines as a data frame of pandas or polars, with all digits."""
        return frame(table_of(records(self._lines)), library)

    def save(self, file: str | Path, caption: str = "") -> Path:
        """Write the table as `.csv`, `.md` or `.tex`; returns the file."""
        export(self._lines, Path(file), caption)
        return Path(file)

    def __iter__(self) -> Iterator[Line]:
        """Iterate over the lines."""
        return iter(self._lines)

    def __len__(self) -> int:
        """Count the lines."""
        return len(self._lines)

    def __str__(self) -> str:
        """Return the Markdown table."""
        return as_markdown(self._lines)

    def __repr__(self) -> str:
        """Name the number of lines."""
        return f"<Comparison: {len(self)} lines>"

    def _repr_markdown_(self) -> str:
        """Show the table in notebooks."""
        return str(self)


def compare(
    results: SweepResults | str | Path,
    baseline: str | None = None,
    *,
    metrics: Sequence[str] | None = None,
    by: Sequence[str] | None = None,
    where: str | None = None,
    median: bool = False,
) -> Comparison:
    """Compare the planners of a sweep with a baseline on common seeds.

    Args:
        results: Of the sweep, or its folder.
        baseline: Label of a planner; that of the sweep's claim if None.
        metrics: Columns or rates; those of the claim and the usual ones if None.
        by: Columns within whose values planners are compared; `()` pools all runs;
            scenario and axes if None.
        where: SQL condition on the runs.
        median: Compare medians instead of means.

    Returns:
        The comparison: values with 95 % intervals, differences on common seeds with
        theirs, p values corrected together (Holm).

    Raises:
        ConfigError: If there is no such planner, metric or axis.
    """
    folder = Path(results) if isinstance(results, str | Path) else results.folder
    require_sweep(folder)
    condition = f" WHERE {where}" if where else ""
    found = rows(folder, f"{ALL_RUNS}{condition}", "where")
    center = Center.MEDIAN if median else Center.MEAN
    question = question_of(folder, baseline, metrics, by, center)
    return Comparison(compared(found, question))
