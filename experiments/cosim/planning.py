"""Calls of a planner: its failures, its time, and many scenes at once.

A planner may be anyone's code: whatever it raises or returns ends here as a plan, or as
a `PlannerOutputError` that says what was wrong.
"""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter, thread_time
from types import TracebackType
from typing import TypeVar

from experiments.cosim.plant import PlannerOutputError
from experiments.cosim.records import PlanningTime
from experiments.errors import described
from experiments.interrupts import is_interrupt
from planner.interface import BatchPlanner, Planner, PlanResult
from planner.scene import Scene

log = logging.getLogger(__name__)

TO_MS = 1e3  # from seconds
Found = TypeVar("Found")


class FailuresOfThePlanner:
    """Turns whatever a planner raises into a PlannerOutputError.

    A planner may raise SystemExit, CancelledError or an exception of its own that has
    no text. A class, since it is entered several times in every step and a generator
    takes five times as long.
    """

    __slots__ = ()

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Raise another error instead of one that is not ours."""
        if error is None or isinstance(error, PlannerOutputError):
            return
        if is_interrupt(error):
            return
        log.warning("the planner raised", exc_info=True)
        raise PlannerOutputError(described(error)) from error


FAILURES_OF_THE_PLANNER = FailuresOfThePlanner()


@dataclass(frozen=True, slots=True, eq=False)
class PlannedCycle:
    """What a planner has returned, and how long that took."""

    plan: PlanResult
    timing: PlanningTime


def plan_once(planner: Planner, scene: Scene, memory: object) -> PlannedCycle:
    """Plan one cycle of one ego.

    Raises:
        PlannerOutputError: If the planner raises, or returns no plan.
    """
    plan, timing = _timed(lambda: planner.plan(scene, memory))
    return PlannedCycle(_checked(plan, "plan()"), timing)


def plan_many(
    planner: BatchPlanner, scenes: Sequence[Scene], memories: Sequence[object]
) -> list[PlannedCycle | PlannerOutputError]:
    """Plan one cycle of several egos in one call; each counts an equal share of time.

    Returns:
        For each its plan, or what is wrong with it.

    Raises:
        PlannerOutputError: If the planner raises, or does not return a plan for each.
    """
    found, timing = _timed(lambda: planner.plan_many(scenes, memories))
    with FAILURES_OF_THE_PLANNER:
        plans = list(found)
    if len(plans) != len(scenes):
        raise PlannerOutputError(
            f"plan_many() returned {len(plans)} plans for {len(scenes)} scenes"
        )
    n = max(len(scenes), 1)
    share = PlanningTime(timing.wall_ms / n, timing.cpu_ms / n)
    out: list[PlannedCycle | PlannerOutputError] = []
    for plan in plans:
        try:
            out.append(PlannedCycle(_checked(plan, "plan_many()"), share))
        except PlannerOutputError as error:
            out.append(error)
    return out


def _timed(call: Callable[[], Found]) -> tuple[Found, PlanningTime]:
    """Call a planner and measure its time.

    Raises:
        PlannerOutputError: Whatever the planner raises.
    """
    process = os.getpid()
    started, cpu_started = perf_counter(), thread_time()
    try:
        with FAILURES_OF_THE_PLANNER:
            found = call()
    finally:
        if os.getpid() != process:  # the planner forked: end the copy of the run
            os._exit(0)
    timing = PlanningTime(
        (perf_counter() - started) * TO_MS, (thread_time() - cpu_started) * TO_MS
    )
    return found, timing


def _checked(plan: object, call: str) -> PlanResult:
    """Return what should be a plan.

    Raises:
        PlannerOutputError: If it is something else.
    """
    if not isinstance(plan, PlanResult):
        raise PlannerOutputError(f"{call} returned {type(plan).__name__}")
    return plan
