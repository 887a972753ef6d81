"""Inside of a worker process: start, warm-up, execution.

A worker never runs a user's planner itself: that happens in a child process, whose
time, memory and processes it watches.
"""

import faulthandler
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from experiments.config import Scenario
from experiments.config.scenario_file import check_scenario
from experiments.config.yaml_reader import Document
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.records import EpisodeStatus, StepRecord
from experiments.episode.drive import run_scenario
from experiments.planners.registry import PLANNERS
from experiments.storage.atomic_folder import remove_unfinished
from experiments.sweep.execute import execute_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.processes.guarded import (
    CallLimits,
    CallLostError,
    Cause,
    GuardedProcess,
)
from experiments.sweep.processes.tree import end_with_parent
from experiments.sweep.task import (
    Failure,
    RunReport,
    RunTask,
    failed,
    record_failure,
)

WARM_UP_DRIVE = 10.0  # of each warm-up scenario, after which all loops are loaded [s]

_CAN_FORK = hasattr(os, "fork")
_FAILURES = {
    Cause.DIED: Failure.PROCESS_DIED,
    Cause.TIME: Failure.WALL_CLOCK,
    Cause.MEMORY: Failure.MEMORY,
    Cause.PROCESSES: Failure.PROCESSES,
}
_children: dict[str, GuardedProcess] = {}  # of this worker, by owner; at most one

T = TypeVar("T")

log = logging.getLogger(__name__)


class _WarmError(Exception):
    """Ends the warm-up episode."""


def start_worker(settings: WorkerSettings) -> None:
    """Initialise a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the sweep handles Ctrl-C
    signal.signal(signal.SIGTERM, _leave)
    end_with_parent(os.getppid(), signal.SIGTERM)
    _send_output_to(settings.log)
    if settings.directory.is_dir():
        os.chdir(settings.directory)
        sys.path.insert(0, str(settings.directory))
    for folder in settings.planner_folders:
        sys.path.insert(0, folder)
    warm_up(settings.warm_up)


def drive_guarded(task: RunTask, memory_mb: float) -> RunReport:
    """Execute a run in a child process; whatever happens there becomes a report.

    Args:
        task: The run.
        memory_mb: Resident memory that ends it.
    """
    if not _CAN_FORK:
        return execute_run(task)
    try:
        report: RunReport = _call(
            execute_run, task, _owner(task.config), CallLimits(task.timeout, memory_mb)
        )
    except CallLostError as loss:
        if task.folder.parent.is_dir():
            remove_unfinished(task.folder.parent, loss.process)
        return _lost(task, loss)
    if report.failure is not None or report.status == EpisodeStatus.PLANNER_FAILED:
        _end_children()  # what spoilt this run must not spoil the next
    return report


def call_guarded(
    function: Callable[[Mapping[str, Any]], T],
    config: Mapping[str, Any],
    limits: CallLimits,
) -> T:
    """Call a function with a scenario in a child process.

    Raises:
        CallLostError: If it raises, dies or exceeds a limit.
    """
    if not _CAN_FORK:
        return function(config)
    value: T = _call(function, config, _owner(config), limits)
    return value


def warm_up(scenarios: Iterable[Mapping[str, Any]]) -> None:
    """Drive the beginning of scenarios, so that everything is loaded and compiled."""
    for config in scenarios:
        scenario = check_scenario(Document("warm-up", dict(config)))
        try:
            drive_shortly(scenario)
        except Exception:  # the run itself reports it
            log.exception("warm-up")


def drive_shortly(scenario: Scenario) -> None:
    """Drive the beginning of a scenario, leaving no files."""

    def on_step(record: StepRecord | FleetStep) -> None:
        if record.index * scenario.simulation.step_s >= WARM_UP_DRIVE:
            raise _WarmError

    with tempfile.TemporaryDirectory(prefix="rearview-") as out, suppress(_WarmError):
        run_scenario(scenario, out=Path(out), on_step=on_step)


def _owner(config: Mapping[str, Any]) -> str:
    """Return whose code a scenario runs: a user's planner, or only this project's."""
    name = str(config["planner"]["name"])
    return "" if name in PLANNERS else name


def _call(
    function: Callable[[Any], Any], argument: Any, owner: str, limits: CallLimits
) -> Any:
    """Call a function in the child process of an owner.

    A planner may change anything in its process (NumPy's functions, signal handlers,
    threads); one process for each planner keeps that from the others. It serves
    further runs of the planner, which keeps what was loaded and compiled, until one
    fails.
    """
    if owner not in _children:
        _end_children()
        _children[owner] = GuardedProcess()
    guarded = _children[owner]
    try:
        value = guarded.call(function, argument, limits)
    except CallLostError:
        _end_children()
        raise
    if not guarded.is_alone():  # the planner left a process behind
        _end_children()
    return value


def _end_children() -> None:
    """Kill the child process, with all that it started."""
    while _children:
        _children.popitem()[1].kill()


def _lost(task: RunTask, loss: CallLostError) -> RunReport:
    """Build the report of a run whose process did not finish it."""
    if loss.cause is Cause.RAISED:
        return record_failure(failed(task, Failure.ERROR, str(loss)))
    wall = task.timeout if loss.cause is Cause.TIME else None
    words = str(loss)
    if loss.cause is Cause.DIED:
        words = f"the process of the episode {words}"
    failure = _FAILURES[loss.cause]
    code = loss.exit_code if loss.cause is not Cause.TIME else None
    return failed(task, failure, words, wall=wall, exit_code=code)


def _leave(*_: object) -> NoReturn:
    """End on SIGTERM, with everything that runs below."""
    _end_children()
    os._exit(128 + signal.SIGTERM)


def _send_output_to(file: Path) -> None:
    """Append stdout and stderr, also of libraries, to a file."""
    sys.stdout.flush()
    sys.stderr.flush()
    with suppress(OSError):  # a full disk is reported by the run
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(descriptor, 1)
        os.dup2(descriptor, 2)
        os.close(descriptor)
    faulthandler.enable()
    logging.basicConfig(level=logging.WARNING)
