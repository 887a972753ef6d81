"""Schedule of a sweep: find the missing runs and execute them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from experiments.config.sweep import KeepTraces, Sweep
from experiments.episode.identity import shaping_versions
from experiments.errors import ResultsError
from experiments.interrupts import interrupts_between_steps
from experiments.sweep.executors.executor import POLL_INTERVAL, Executor
from experiments.sweep.folder import finished, remove_unfinished, run_folder
from experiments.sweep.plan import Plan, PlannedRun
from experiments.sweep.rerun_command import rerun_command
from experiments.sweep.task import RunReport, RunTask, record_failure

QUEUED_PER_WORKER = 2  # submitted runs: no worker waits for work


Kind = tuple[str, str]  # label of the planner, scenario


class Show(Protocol):
    """Display of the progress of a sweep."""

    def report(self, report: RunReport) -> None:
        """Record a finished run."""
        ...

    def tick(self) -> None:
        """Update periodically."""
        ...


@dataclass(frozen=True, slots=True)
class Survey:
    """Planned and finished runs, found before anything runs."""

    planned: int
    there: int
    others: int = 0  # runs in the folder that are not in the plan
    code: dict[str, str] = field(default_factory=dict)  # what -> hash or version
    kinds: dict[Kind, "Missing"] = field(default_factory=dict)

    @property
    def missing(self) -> int:
        """Runs to drive."""
        return self.planned - self.there


@dataclass(slots=True)
class Missing:
    """Missing runs of one kind: the first of them, and their number."""

    first: PlannedRun
    count: int = 0


@dataclass(slots=True)
class _Work:
    """Runs still to execute."""

    tasks: Iterator[RunTask]
    again: list[RunTask] = field(default_factory=list)
    running: int = 0

    def next_task(self) -> RunTask | None:
        """Return the next run: one to retry, or a new one."""
        return self.again.pop() if self.again else next(self.tasks, None)


def survey(plan: Plan, folder: Path) -> Survey:
    """Check all runs of a plan once; raises ConfigError for an invalid one."""
    there = finished(folder)
    code = {name: str(version) for name, version in shaping_versions().items()}
    kinds: dict[Kind, Missing] = {}
    count = 0
    for run in plan:
        if run.run_id in there:
            count += 1
        else:
            kind = (run.label, run.scenario.name)
            kinds.setdefault(kind, Missing(run)).count += 1
        _note_code(run, code)
    return Survey(len(plan), count, len(there) - count, code, kinds)


def drive_missing(
    plan: Plan,
    sweep: Sweep,
    folder: Path,
    make_executor: Callable[[], Executor],
    show: Show,
    limit: int | None = None,
) -> None:
    """Execute the missing runs of a plan.

    Args:
        plan: All runs.
        sweep: Time-out, retries and traces.
        folder: Of the sweep, locked; absolute.
        make_executor: Starts the executor.
        show: Gets every report.
        limit: Largest number of runs to execute.

    Raises:
        ResultsError: If a disk is full, or a worker has other code; what is there
            is whole and stays.
        ExecutorError: If all workers are lost.
        KeyboardInterrupt: After Ctrl-C or SIGTERM, between two reports.
    """
    work = _Work(_tasks(plan, sweep, folder, limit))
    # an interrupt inside an executor could corrupt its locks and queues
    with interrupts_between_steps() as check_interrupt:
        executor = make_executor()
        try:
            while _feed(executor, work):
                report = executor.next_report(POLL_INTERVAL)
                # A signal to all processes ends workers too: their runs did not fail.
                check_interrupt()
                if report is not None:
                    work.running -= 1
                    _take(report, work, sweep.retries, show)
                show.tick()
        finally:
            executor.stop()
            remove_unfinished(folder)


def task_of(run: PlannedRun, sweep: Sweep, folder: Path) -> RunTask:
    """Build the task of a run."""
    about = {"name": sweep.name, "label": run.label, "point": run.point}
    return RunTask(
        run_id=run.run_id,
        config=run.scenario.resolved(),
        folder=run_folder(folder, run.run_id),
        keep_traces=sweep.keep_traces,
        timeout=sweep.timeout_s,
        facts={
            "sweep": about,
            **run.hashes,
            "command": rerun_command(
                str(folder), [run.scenario.planner.name], run.run_id
            ),
        },
        full_statistics=sweep.keep_traces is not KeepTraces.NONE,
    )


def _tasks(
    plan: Plan, sweep: Sweep, folder: Path, limit: int | None
) -> Iterator[RunTask]:
    """Yield the missing runs one by one."""
    there = finished(folder)
    left = limit
    for run in plan:
        if run.run_id in there:
            continue
        if left == 0:
            return
        left = None if left is None else left - 1
        yield task_of(run, sweep, folder)


def _feed(executor: Executor, work: _Work) -> bool:
    """Keep every worker busy; return whether anything is still running."""
    while work.running < QUEUED_PER_WORKER * executor.workers:
        task = work.next_task()
        if task is None:
            break
        executor.submit(task)
        work.running += 1
    return work.running > 0


def _take(report: RunReport, work: _Work, retries: int, show: Show) -> None:
    """Retry a run whose process was lost, and record it after the last attempt."""
    if report.worth_retrying:
        if report.task.attempt <= retries:
            work.again.append(report.task.again())
            return
        report = record_failure(report)
    if report.ends_sweep:
        raise ResultsError(report.reason)
    show.report(report)


def _note_code(run: PlannedRun, code: dict[str, str]) -> None:
    """Collect the hashes of which a folder may hold only one version."""
    for what, key in (
        ("the code", "code_hash"),
        (f"the planner {run.scenario.planner.name}", "planner_hash"),
    ):
        value = run.hashes[key]
        if value is not None:
            code[what] = value
