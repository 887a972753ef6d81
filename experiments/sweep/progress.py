"""Progress of a sweep: a table on a terminal, lines elsewhere, and always a file."""

import heapq
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from experiments.config.counted import counted
from experiments.storage.run_files import replace_json
from experiments.sweep.folder import PROGRESS
from experiments.sweep.task import RunReport

if TYPE_CHECKING:
    from rich.table import Table

FILE_INTERVAL = 1.0  # between two writes of the file [s]
TABLE_INTERVAL = 0.5  # between two updates of a terminal [s]
LINE_INTERVAL = 10.0  # between plain lines [s]
N_SLOWEST = 3
MINUTE, HOUR = 60.0, 3600.0  # [s]


@dataclass(slots=True)
class Counts:
    """Numbers of finished runs."""

    missing: int  # before the start
    there: int  # finished before the start
    done: int = 0
    by_status: dict[str, int] = field(default_factory=dict)
    by_failure: dict[str, int] = field(default_factory=dict)
    slowest: list[tuple[float, str]] = field(default_factory=list)  # [s], run
    elapsed: float = 0.0  # [s]

    def add(self, report: RunReport) -> None:
        """Count a finished run."""
        self.done += 1
        _increase(self.by_status, report.status)
        if report.failure is not None:
            _increase(self.by_failure, report.failure)
        if report.wall is not None:
            heapq.heappush(self.slowest, (report.wall, report.task.run_id))
        if len(self.slowest) > N_SLOWEST:
            heapq.heappop(self.slowest)

    @property
    def lost(self) -> int:
        """Runs without an episode."""
        return sum(self.by_failure.values())

    @property
    def rate(self) -> float:
        """Runs a second."""
        return self.done / self.elapsed if self.elapsed > 0.0 else 0.0

    @property
    def left(self) -> float | None:
        """Time left [s]."""
        return (self.missing - self.done) / self.rate if self.rate > 0.0 else None


class SweepProgress:
    """Collects the reports of a sweep and displays them."""

    def __init__(
        self, name: str, folder: Path, counts: Counts, show: "Display"
    ) -> None:
        self.counts = counts
        self._name = name
        self._folder = folder
        self._show = show
        self._started = monotonic()
        self._written = -FILE_INTERVAL
        self._shown = self._started

    def report(self, report: RunReport) -> None:
        """Record a finished run."""
        self.counts.add(report)

    def tick(self) -> None:
        """Write the file and update the display when due."""
        now = monotonic()
        self.counts.elapsed = now - self._started
        if now - self._written >= FILE_INTERVAL:
            self._written = now
            self.write("running")
        if now - self._shown >= self._show.interval:
            self._shown = now
            self._show.draw(self._name, self.counts)

    def write(self, state: str) -> None:
        """Write the progress file; raises ResultsError on a full disk."""
        counts = asdict(self.counts)
        about: dict[str, Any] = {
            "sweep": self._name,
            "state": state,
            "updated": datetime.now(UTC).isoformat(timespec="seconds"),
            "runs_per_s": self.counts.rate,
            "left_s": self.counts.left,
            **counts,
            "slowest": sorted(counts["slowest"], reverse=True),
        }
        replace_json(self._folder / PROGRESS, about)


@dataclass(frozen=True, slots=True)
class Display:
    """How progress is displayed, and how often."""

    interval: float  # [s]
    draw: Callable[[str, Counts], None]


@contextmanager
def sweep_progress(name: str, folder: Path, counts: Counts) -> Iterator[SweepProgress]:
    """Display the progress of a sweep while it runs.

    Yields:
        What takes the reports.
    """
    if not sys.stderr.isatty():
        display = Display(LINE_INTERVAL, _write_line)
        yield SweepProgress(name, folder, counts, display)
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), auto_refresh=False) as live:

        def draw(name: str, counts: Counts) -> None:
            live.update(table(name, counts), refresh=True)

        progress = SweepProgress(name, folder, counts, Display(TABLE_INTERVAL, draw))
        yield progress
        draw(name, counts)


def table(name: str, counts: Counts) -> "Table":
    """Build the table for a terminal."""
    from rich.table import Table

    shown = Table(title=name, show_header=False)
    shown.add_column()
    shown.add_column(justify="right")
    shown.add_row("done", f"{counts.done} of {counts.missing}")
    if counts.there:
        shown.add_row("there before", str(counts.there))
    for status, count in sorted(counts.by_status.items()):
        shown.add_row(f"  {status}", str(count))
    for failure, count in sorted(counts.by_failure.items()):
        shown.add_row(f"  lost: {failure}", str(count))
    shown.add_row("rate", f"{counts.rate:.2f} runs/s")
    shown.add_row("time left", duration(counts.left))
    for wall, run in sorted(counts.slowest, reverse=True):
        shown.add_row(f"slowest: {run}", f"{wall:.1f} s")
    return shown


def _write_line(name: str, counts: Counts) -> None:
    """Write a line of progress."""
    sys.stderr.write(f"{name}: {in_words(counts)}\n")
    sys.stderr.flush()


def in_words(counts: Counts) -> str:
    """Summarise the progress in one line."""
    lost = f", {counts.lost} of them lost" if counts.lost else ""
    done = f"{counts.done} of {counted(counts.missing, 'run')} done{lost}"
    return f"{done}, {counts.rate:.2f} runs/s, {duration(counts.left)} left"


def duration(seconds: float | None) -> str:
    """Format a duration."""
    if seconds is None:
        return "-"
    if seconds < MINUTE:
        return f"{seconds:.0f} s"
    if seconds < HOUR:
        return f"{seconds / MINUTE:.0f} min"
    return f"{seconds / HOUR:.1f} h"


def _increase(counts: dict[str, int], key: str) -> None:
    """Increment a count."""
    counts[str(key)] = counts.get(str(key), 0) + 1
