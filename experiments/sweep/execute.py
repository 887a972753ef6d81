"""Execute one run of a sweep: a scenario in, a run folder out."""

import logging
from time import perf_counter

from experiments.config import Scenario
from experiments.config.scenario_file import check_scenario
from experiments.config.sweep import KeepTraces
from experiments.config.yaml_reader import Document
from experiments.cosim.records import Ending, EpisodeStatus
from experiments.episode.drive import run_scenario
from experiments.episode.identity import code_hash
from experiments.episode.run_folder import OutputOptions
from experiments.episode.without_ego import SharedTraffic
from experiments.errors import ConfigError, ExperimentError, ResultsError, described
from experiments.interrupts import is_interrupt
from experiments.sweep.task import (
    Failure,
    RunReport,
    RunTask,
    facts_of,
    failed,
    record_failure,
)

log = logging.getLogger(__name__)

# Of this process: the runs of one seed follow each other.
_shared = SharedTraffic()


def execute_run(task: RunTask) -> RunReport:
    """Execute a run and write its run folder; every failure becomes a report.

    A process that dies, hangs or exceeds the memory limit is handled by its executor.
    """
    started = perf_counter()
    if code_hash() != task.facts["code_hash"]:
        words = "a worker has another version of the code than the sweep"
        return failed(task, Failure.OTHER_CODE, words)
    try:
        scenario = scenario_of(task)
        outcome = run_scenario(scenario, output=_run_folder(task))
    except ResultsError as error:
        return failed(task, Failure.DISK, str(error))
    except ConfigError as error:
        report = failed(task, Failure.INVALID, str(error), wall=since(started))
    except ExperimentError as error:
        report = failed(task, Failure.ERROR, str(error), wall=since(started))
    except BaseException as error:  # one run must not end the sweep
        if is_interrupt(error):
            raise
        log.exception("run %s", task.run_id)
        report = failed(task, Failure.ERROR, described(error), wall=since(started))
    else:
        ending = outcome.ending
        status, wall = str(ending.status), since(started)
        return RunReport(task, status, wall, reason=ending.reason)
    return record_failure(report)


def since(started: float) -> float:
    """Return the wall-clock time since a reading of perf_counter [s]."""
    return perf_counter() - started


def scenario_of(task: RunTask) -> Scenario:
    """Read the scenario of a run."""
    return check_scenario(Document(f"run {task.run_id}", dict(task.config)))


def _run_folder(task: RunTask) -> OutputOptions:
    """Choose the run folder and whether it keeps the trace."""

    def keeps(ending: Ending) -> bool:
        arrived = ending.status is EpisodeStatus.ARRIVED
        only_failures = task.keep_traces is KeepTraces.FAILURES
        return not arrived if only_failures else task.keep_traces is KeepTraces.ALL

    return OutputOptions(
        task.folder,
        keeps,
        facts_of(task),
        full_statistics=task.full_statistics,
        shared=_shared,
    )
