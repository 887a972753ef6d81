"""Estimate how long a sweep takes, and compile the planners' loops before it starts.

Compiling once, in one process, keeps several workers from compiling the same loops at
the same time; one run of each kind is then timed.
"""

import logging
import statistics
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

from experiments.config import Scenario
from experiments.config.scenario_file import check_scenario
from experiments.config.yaml_reader import Document
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.records import StepRecord
from experiments.episode.drive import run_scenario
from experiments.errors import ExecutorError, described
from experiments.interrupts import interrupts_between_steps
from experiments.planners.registry import PLANNERS
from experiments.sweep.executors.executor import POLL_INTERVAL, WorkerSettings
from experiments.sweep.executors.isolation import IsolatedWorkers
from experiments.sweep.executors.worker import drive_shortly
from experiments.sweep.schedule import Survey

COMPILE_TIMEOUT = 600.0  # of the first run of a planner with an empty cache [s]
STAND_IN = "cruise"  # compiles the loops outside the planner for users' planners
MAX_KINDS = 12  # kinds of runs that are timed
TIMED = 20.0  # after this a run that is timed has shown how slow it is [s]

Config = Mapping[str, Any]
T = TypeVar("T")

log = logging.getLogger(__name__)


class _TimedError(Exception):
    """A run has been timed for long enough."""


@dataclass(frozen=True, slots=True)
class DurationEstimate:
    """Duration of a sweep, and scenarios that load all loops into a worker."""

    seconds: float | None  # of all missing runs on one worker; None if unknown [s]
    warm_up: tuple[Config, ...]


def estimate_duration(
    survey: Survey, settings: WorkerSettings, timeout: float, workers: int
) -> DurationEstimate:
    """Compile what the missing runs need, and time one run of each kind.

    Args:
        survey: The missing runs, by kind.
        settings: Of the worker processes, which may crash or hang without harm.
        timeout: Of a run [s].
        workers: Number of processes.

    Returns:
        The estimate; the mean of the timed kinds stands for those that failed or were
        left out.
    """
    kinds = list(survey.kinds)[:MAX_KINDS]
    scenarios = [survey.kinds[kind].first.scenario for kind in kinds]
    warm_up = _warm_up(scenarios)
    compiled = _call_each(compile_loops, warm_up, settings, COMPILE_TIMEOUT, 1)
    warm_up = [config for config, done in zip(warm_up, compiled, strict=True) if done]
    settings = replace(settings, warm_up=tuple(warm_up))
    configs = [scenario.resolved() for scenario in scenarios]
    found = _call_each(time_run, configs, settings, timeout, min(workers, len(kinds)))
    times = {k: s for k, s in zip(kinds, found, strict=True) if s is not None}
    if not times:
        return DurationEstimate(None, settings.warm_up)
    mean = statistics.mean(times.values())
    total = sum(times.get(kind, mean) * m.count for kind, m in survey.kinds.items())
    return DurationEstimate(total, settings.warm_up)


def compile_loops(config: Config) -> bool:
    """Drive the beginning of a scenario, so that its loops are compiled."""
    try:
        drive_shortly(check_scenario(Document("warm-up", dict(config))))
    except Exception as error:  # noqa: BLE001, any may happen in any planner
        # errors of validation cannot be sent to another process
        raise ExecutorError(described(error)) from None
    return True


def time_run(config: Config) -> float | None:
    """Return the wall-clock time of a run [s]; None if it raises.

    Of one with many egos, which lasts its whole duration, only the beginning is timed
    if it is slow, and the rest taken to be as slow.
    """
    started = begun = perf_counter()
    driven = 0.0

    def on_step(record: StepRecord | FleetStep) -> None:
        nonlocal begun, driven
        driven = record.index * scenario.simulation.step_s
        if driven == 0.0:
            begun = perf_counter()
        elif scenario.egos and perf_counter() - begun > TIMED:
            raise _TimedError

    try:
        scenario = check_scenario(Document("estimate", dict(config)))
        with tempfile.TemporaryDirectory(prefix="rearview-") as out:
            run_scenario(scenario, out=Path(out), on_step=on_step)
    except _TimedError:
        whole = max(scenario.simulation.duration_s / driven, 1.0)
        return (begun - started) + (perf_counter() - begun) * whole
    except BaseException as error:  # noqa: BLE001, the run itself reports it
        log.warning("estimate: %s", described(error))
        return None
    return perf_counter() - started


def _warm_up(scenarios: list[Scenario]) -> list[Config]:
    """Choose a scenario for each planner and world; users' planners may hang."""
    chosen: dict[tuple[str, str], Config] = {}
    for scenario in scenarios:
        name, config = scenario.planner.name, scenario.resolved()
        if name not in PLANNERS:
            name, config = STAND_IN, {**config, "planner": {"name": STAND_IN}}
        chosen.setdefault((name, scenario.world), config)
    return list(chosen.values())


def _call_each(
    function: Callable[[Config], T],
    configs: Sequence[Config],
    settings: WorkerSettings,
    timeout: float,
    workers: int,
) -> list[T | None]:
    """Call a function on each configuration in isolated processes; None if one dies."""
    with interrupts_between_steps() as check_interrupt:
        pool = IsolatedWorkers(workers, settings)
        try:
            futures = [pool.call(function, config, timeout) for config in configs]
            return [_outcome(future, check_interrupt) for future in futures]
        finally:
            pool.stop()


def _outcome(future: Future[T], check_interrupt: Callable[[], None]) -> T | None:
    """Wait for a result; None if the process dies, hangs or raises."""
    while not wait((future,), POLL_INTERVAL).done:
        check_interrupt()
    try:
        return future.result()
    except BaseException as error:  # noqa: BLE001, the run itself reports it
        log.warning("estimate: %s", described(error))
        return None
