"""One run of each kind before a sweep: how long will it take, and what can get warm.

It also fills the cache of compiled loops before several workers would do so at once.
"""

import logging
import statistics
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

from pebble import ProcessExpired

from experiments.config import Scenario
from experiments.config.scenario_file import check_scenario
from experiments.config.yaml_reader import Document
from experiments.cosim.records import StepRecord
from experiments.episode.run import run_episode
from experiments.errors import ExperimentError
from experiments.interrupts import interrupts_between_steps
from experiments.planners.registry import PLANNERS
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.isolation import IsolatedWorkers
from experiments.sweep.executors.worker import drive_shortly
from experiments.sweep.schedule import Kind, Missing, Survey

COMPILE_PATIENCE = 600.0  # for the first run of a planner with nothing compiled [s]
LOADED = 0.5  # of its steps is what a run takes beside them once all is loaded
PATIENCE = 0.2  # between two looks whether it was interrupted [s]
STAND_IN = "cruise"  # for users' planners, while loops are compiled
MAX_KINDS = 12  # kinds that are tried; more would take longer than they tell

T = TypeVar("T")

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Pilot:
    """What the first runs told."""

    seconds: float | None  # of all missing runs on one worker; None if unknown [s]
    warm_up: tuple[Mapping[str, Any], ...]  # scenarios, one for each planner and world


def fly(
    survey: Survey, settings: WorkerSettings, timeout: float, workers: int
) -> Pilot:
    """Drive one missing run of each kind, in processes that may die of it.

    Args:
        survey: What is missing.
        settings: Of the workers.
        timeout: Of a run [s].
        workers: Processes at a time.

    Returns:
        The estimate, and the scenarios that are safe to warm up with.
    """
    kinds = dict(list(survey.kinds.items())[:MAX_KINDS])
    with interrupts_between_steps() as check_interrupt:
        stand_ins = _loaded(_stand_ins(kinds), settings, check_interrupt)
        pool = IsolatedWorkers(
            min(workers, len(kinds)), replace(settings, warm_up=stand_ins)
        )
        times: dict[Kind, float] = {}
        try:
            futures = {
                kind: _try(pool, missing.first.scenario, timeout)
                for kind, missing in kinds.items()
            }
            for kind, future in futures.items():
                seconds = _outcome(future, check_interrupt)
                times |= {} if seconds is None else {kind: seconds}
        finally:
            pool.stop()
    warm_up = (*stand_ins, *_warm_up(survey, times))
    return Pilot(_total(survey, times), warm_up)


def _try(
    pool: IsolatedWorkers, scenario: Scenario, timeout: float
) -> Future[float | None]:
    """Have a run driven; what is ours may have to be compiled first."""
    known = scenario.planner.name in PLANNERS
    patience = timeout + (COMPILE_PATIENCE if known else 0.0)
    return pool.call(time_of, scenario.resolved(), patience)


def time_of(config: Mapping[str, Any]) -> float | None:
    """Drive a run and say how long it takes once everything is loaded [s].

    The first drive loads or compiles something; where that took the most of it, the
    run is driven again. None if it raises.
    """
    try:
        first, steps = _drive(config)
        return first if first - steps < LOADED * steps else _drive(config)[0]
    except (Exception, KeyboardInterrupt, SystemExit):  # the run itself will tell
        log.exception("pilot")
        return None


def load(config: Mapping[str, Any]) -> bool:
    """Drive the begin of a scenario, so that its loops are compiled."""
    drive_shortly(check_scenario(Document("pilot", dict(config))))
    return True


def _stand_ins(kinds: Mapping[Kind, Missing]) -> tuple[Mapping[str, Any], ...]:
    """Put a planner of this project into the worlds of users' planners.

    Theirs have no patience for the compiling of our loops: they may hang.
    """
    worlds: dict[str, Mapping[str, Any]] = {}
    for missing in kinds.values():
        scenario = missing.first.scenario
        if scenario.planner.name not in PLANNERS:
            config = {**scenario.resolved(), "planner": {"name": STAND_IN}}
            worlds.setdefault(scenario.world, config)
    return tuple(worlds.values())


def _loaded(
    configs: tuple[Mapping[str, Any], ...],
    settings: WorkerSettings,
    check_interrupt: Callable[[], None],
) -> tuple[Mapping[str, Any], ...]:
    """Compile what scenarios need; give those with which it worked."""
    if not configs:
        return ()
    pool = IsolatedWorkers(1, replace(settings, warm_up=()))
    try:
        futures = [pool.call(load, config, COMPILE_PATIENCE) for config in configs]
        done = [_outcome(future, check_interrupt) for future in futures]
    finally:
        pool.stop()
    return tuple(config for config, ok in zip(configs, done, strict=True) if ok)


def _outcome(future: Future[T], check_interrupt: Callable[[], None]) -> T | None:
    """Wait for what comes out of a worker; None if it dies or raises."""
    while not wait((future,), PATIENCE).done:
        check_interrupt()
    try:
        return future.result()
    except (TimeoutError, ProcessExpired, RuntimeError, ExperimentError) as error:
        log.warning("pilot: %s", error)
        return None


def _drive(config: Mapping[str, Any]) -> tuple[float, float]:
    """Drive a run; give its wall clock and what the steps account for [s].

    The median step stands for all: some load or compile something.
    """
    at: list[float] = []

    def on_step(_: StepRecord) -> None:
        at.append(perf_counter())

    scenario = check_scenario(Document("pilot", dict(config)))
    started = perf_counter()
    with tempfile.TemporaryDirectory(prefix="rearview-") as out:
        run_episode(scenario, out=Path(out), on_step=on_step)
    ended = perf_counter()
    lasted = [after - before for before, after in pairwise(at)]
    steps = statistics.median(lasted) * len(lasted) if lasted else 0.0
    between = at[-1] - at[0] if at else 0.0
    return ended - started - between + steps, steps


def _total(survey: Survey, times: Mapping[Kind, float]) -> float | None:
    """Add up all missing runs; a kind that was not tried takes the mean."""
    if not times:
        return None
    mean = statistics.mean(times.values())
    return sum(times.get(kind, mean) * m.count for kind, m in survey.kinds.items())


def _warm_up(
    survey: Survey, times: Mapping[Kind, float]
) -> tuple[Mapping[str, Any], ...]:
    """Choose a scenario for each planner in each kind of world."""
    chosen: dict[tuple[str, str], Mapping[str, Any]] = {}
    for kind in times:
        scenario = survey.kinds[kind].first.scenario
        key = (scenario.planner.name, scenario.world)
        chosen.setdefault(key, scenario.resolved())
    return tuple(chosen.values())
