"""Inside of a worker process: start, warm-up, execution."""

import ctypes
import faulthandler
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from experiments.config import Scenario
from experiments.config.scenario_file import check_scenario
from experiments.config.yaml_reader import Document
from experiments.cosim.records import StepRecord
from experiments.episode.run import run_episode
from experiments.sweep.execute import execute_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.task import (
    Failure,
    RunReport,
    RunTask,
    failed,
    record_failure,
)

WARM_UP_DRIVE = 10.0  # of each warm-up scenario, after which all loops are loaded [s]
_PR_SET_PDEATHSIG = 1  # of prctl(2)

T = TypeVar("T")

log = logging.getLogger(__name__)


class _WarmError(Exception):
    """Ends the warm-up episode."""


def start_worker(settings: WorkerSettings) -> None:
    """Initialise a worker process."""
    _die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the sweep handles Ctrl-C
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _send_output_to(settings.log)
    if settings.directory.is_dir():
        os.chdir(settings.directory)
        sys.path.insert(0, str(settings.directory))
    warm_up(settings.warm_up)


def drive_watched(task: RunTask, register: Path) -> RunReport:
    """Execute a run under the memory watch.

    Args:
        task: The run.
        register: Folder where the process leaves its id while it drives. One that
            waits for work must not be ended: it may hold the lock of the queue.
    """
    with _watched(register):
        try:
            return execute_run(task)
        except (KeyboardInterrupt, SystemExit) as error:  # raised by a user's planner
            words = f"{type(error).__name__}: {error}"
            return record_failure(failed(task, Failure.ERROR, words))


def call_watched(function: Callable[[Any], T], argument: Any, register: Path) -> T:
    """Call a function under the memory watch; arguments as above."""
    with _watched(register):
        return function(argument)


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

    def on_step(record: StepRecord) -> None:
        if record.index * scenario.simulation.step_s >= WARM_UP_DRIVE:
            raise _WarmError

    with tempfile.TemporaryDirectory(prefix="rearview-") as out, suppress(_WarmError):
        run_episode(scenario, out=Path(out), on_step=on_step)


@contextmanager
def _watched(register: Path) -> Iterator[None]:
    """Register this process with the memory watch."""
    mark = register / str(os.getpid())
    mark.touch()
    try:
        yield
    finally:
        mark.unlink(missing_ok=True)


def _die_with_parent() -> None:
    """Let the kernel end this process when its parent dies."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))


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
