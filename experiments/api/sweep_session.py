"""A sweep from the command to the last line: survey, lock, estimate, drive, results."""

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from experiments.comparison.results import RUN_ID, Row, rebuild, refresh, rows
from experiments.config.counted import counted
from experiments.config.sweep import Sweep
from experiments.config.sweep_file import planner_folders
from experiments.config.yaml_reader import Document
from experiments.errors import ConfigError, ResultsError
from experiments.report.html import PAGE_FILE
from experiments.sweep.executors.executor import Executor, WorkerSettings
from experiments.sweep.folder import (
    LOG,
    RESULTS,
    load_sweep_copy,
    locked,
    require_place,
    take,
)
from experiments.sweep.plan import Plan
from experiments.sweep.progress import Counts, SweepProgress, duration, sweep_progress
from experiments.sweep.rerun_command import rerun_command
from experiments.sweep.schedule import Survey, drive_missing, survey

STOPPED = (
    "the sweep stops, finished runs are kept; once this is fixed, the same command "
    "resumes"
)


class SweepSession:
    """One call of `rearview sweep`; yields lines for the terminal."""

    def __init__(
        self,
        sweep: Sweep,
        document: Document,
        folder: Path,
        workers: int | None = None,
        cluster: str | None = None,
        limit: int | None = None,
    ) -> None:
        if cluster is not None and workers is not None:
            raise ConfigError(
                "--workers: not allowed with --cluster, which has its own workers"
            )
        if workers is not None:
            from experiments.sweep.executors.local import require_few

            require_few(workers)
        self._sweep = sweep
        self._folder = folder
        self._workers = workers
        self._cluster = cluster
        self._limit = limit
        self._plan = Plan(sweep, document)
        self._planner_folders = planner_folders(sweep, document)

    def preview(self) -> Iterator[str]:
        """Describe what would run and estimate its duration; write nothing."""
        found = self._survey()
        yield self._numbers(found)
        if found.missing:
            yield self._estimate(found, Path(os.devnull))[0]

    def drive(self) -> Iterator[str]:
        """Execute the missing runs and collect the results."""
        found = self._survey()
        yield self._numbers(found)
        if self._cluster is not None and found.missing:
            from experiments.sweep.executors.cluster import require_scheduler

            require_scheduler(self._cluster)
        with locked(self._folder):
            take(self._folder, self._sweep, found.code)
            if found.missing:
                estimate, warm = self._estimate(found, self._folder / LOG)
                yield estimate
                yield from self._drive(found, warm)
            else:
                refresh(self._folder)
        yield from _failures(self._folder)
        yield f"results: {self._folder / RESULTS}"
        yield f"report: {fresh_page(self._folder)}"

    def rows(self) -> list[Row]:
        """Return the results of the sweep's own runs, of those that are finished."""
        planned = {run.run_id for run in self._plan}
        return [row for row in rows(self._folder) if row[RUN_ID] in planned]

    def _survey(self) -> Survey:
        """Check the folder and all runs."""
        require_place(self._folder)
        return survey(self._plan, self._folder)

    def _drive(self, found: Survey, warm: WorkerSettings) -> Iterator[str]:
        """Execute the missing runs with a progress display."""
        todo = found.missing if self._limit is None else self._limit
        counts = Counts(min(todo, found.missing), found.there)
        with sweep_progress(self._sweep.name, self._folder, counts) as progress:
            try:
                drive_missing(
                    self._plan,
                    self._sweep,
                    self._folder,
                    lambda: self._executor(warm),
                    progress,
                    self._limit,
                )
                rebuild(self._folder)
                progress.write("finished" if todo >= found.missing else "limit reached")
            except ResultsError as error:
                self._leave(progress, error)
                raise ResultsError(f"{error}; {STOPPED}") from error
            except BaseException as error:
                self._leave(progress, error)
                raise
        statuses = ", ".join(f"{n} {name}" for name, n in counts.by_status.items())
        yield (
            f"{counted(counts.done, 'run')} in {duration(counts.elapsed)} "
            f"({counts.rate:.2f} runs/s): {statuses}"
        )
        for failure, count in counts.by_failure.items():
            yield f"{count} lost: {failure}"

    def _leave(self, progress: SweepProgress, error: BaseException) -> None:
        """Write results and progress of a sweep that stops, if the disk allows."""
        interrupted = isinstance(error, KeyboardInterrupt)
        with suppress(ResultsError):
            rebuild(self._folder)
            progress.write("interrupted" if interrupted else f"stopped: {error}")

    def _numbers(self, found: Survey) -> str:
        """Describe the numbers of planned and finished runs."""
        there = f", {found.there} of them finished" if found.there else ""
        others = (
            f"; its results keep {counted(found.others, 'other run')}"
            if found.others
            else ""
        )
        return f"{self._sweep.name}: {counted(found.planned, 'run')}{there}{others}"

    def _estimate(self, found: Survey, log: Path) -> tuple[str, WorkerSettings]:
        """Time one run of each kind and extrapolate to all."""
        from experiments.sweep.estimate import estimate_duration
        from experiments.sweep.executors.local import cores

        workers = cores() if self._workers is None else max(1, self._workers)
        settings = WorkerSettings(
            self._sweep.memory_mb, log, Path.cwd(), self._planner_folders
        )
        if self._workers == 0:  # no process but this one, nor for an estimate
            return "in this process, one after another", settings
        estimate = estimate_duration(found, settings, self._sweep.timeout_s, workers)
        warm = replace(settings, warm_up=estimate.warm_up)
        if estimate.seconds is None:
            return "no estimate: none of the timed runs finished", warm
        share = 1.0 if self._limit is None else min(1.0, self._limit / found.missing)
        seconds = estimate.seconds * share
        if self._cluster is not None:
            return f"about {duration(seconds)} on one core of this machine", warm
        return f"about {duration(seconds / workers)} with {workers} workers", warm

    def _executor(self, settings: WorkerSettings) -> Executor:
        """Start the executor."""
        if self._cluster is not None:
            from experiments.sweep.executors.cluster import ClusterExecutor

            return ClusterExecutor(self._cluster, settings, self._folder)
        if self._workers == 0:
            from experiments.sweep.executors.sequential import SequentialExecutor

            return SequentialExecutor(settings)
        from experiments.sweep.executors.local import LocalExecutor

        return LocalExecutor(settings, self._workers)


def _failures(folder: Path) -> list[str]:
    """Describe why runs did not arrive."""
    from experiments.comparison.results import RUN_ID, axis_columns, rows
    from experiments.report.sweep.failures import failure_kinds, failure_lines

    found = rows(folder)
    axes = axis_columns(list(found[0])) if found else []
    kinds = failure_kinds(found, axes, [str(row[RUN_ID]) for row in found])
    names = [planner.name for planner in load_sweep_copy(folder).planners]
    return failure_lines(kinds, rerun_command(str(folder), names))


def fresh_page(folder: Path) -> Path:
    """Return the page of the sweep, rewritten if the results are newer."""
    page = folder / PAGE_FILE
    results = folder / RESULTS
    if not page.exists() or page.stat().st_mtime_ns < results.stat().st_mtime_ns:
        from experiments.report.sweep.page import save_sweep_page  # takes scipy

        save_sweep_page(folder)
    return page
