"""A user's own planner, watched: what it returns is checked, and it cannot just leave.

The planners of this project are checked by mypy and by tests; anyone else's code by
this. What is wrong becomes an error that names it, and the loop ends the episode with
it: the status is `planner_failed`.
"""

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from numbers import Integral, Real
from typing import cast

import numpy as np

from experiments.errors import ExperimentError, described, in_one_line
from experiments.interrupts import is_interrupt
from experiments.planners.road_seal import RoadSeal
from planner.interface import (
    Alternative,
    BatchPlanner,
    Indicator,
    Planner,
    PlanResult,
    PlanStats,
    PlanStatus,
    SpeedGraph,
)
from planner.scene import Scene
from planner.states import Trajectory

log = logging.getLogger(__name__)

MAX_POINTS = 100_000  # of a trajectory


class PlannerContractError(ExperimentError):
    """A planner returned something that no plan is, or tried to end the process."""


class CheckedPlanner:
    """Passes a planner's results on if they keep the contract."""

    def __init__(self, planner: Planner) -> None:
        self.planner = planner
        self._seal: RoadSeal | None = None

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan.

        Raises:
            PlannerContractError: If the planner breaks its contract.
        """
        if memory is None or self._seal is None:
            self._seal = RoadSeal(scene)
        with _running("plan()", self._seal):
            result = self.planner.plan(scene, memory)
        with _looked_at("plan()"):
            return checked(result)


class CheckedBatchPlanner(CheckedPlanner):
    """The same of a planner that plans for many egos at once."""

    def __init__(self, planner: BatchPlanner) -> None:
        super().__init__(planner)
        self.batch = planner
        self._calls = 0

    def plan_many(
        self, scenes: Sequence[Scene], memories: Sequence[object]
    ) -> list[PlanResult]:
        """Plan for each scene; the road of one of them, in turn, is watched.

        Raises:
            PlannerContractError: If the planner breaks its contract.
        """
        seal = RoadSeal(scenes[self._calls % len(scenes)])
        self._calls += 1
        with _running("plan_many()", seal):
            found: object = self.batch.plan_many(scenes, memories)
        with _looked_at("plan_many()"):
            if not isinstance(found, Sequence) or len(found) != len(scenes):
                raise _wrong("plan_many()", found, f"{len(scenes)} results in a list")
            return [checked(result, "plan_many()") for result in found]


@contextmanager
def _running(call: str, seal: RoadSeal) -> Iterator[None]:
    """Watch a planner while it runs: it may raise only exceptions, and change no road.

    Raises:
        PlannerContractError: If it does anything else.
    """
    try:
        yield
    except BaseException as error:
        if isinstance(error, Exception) or is_interrupt(error):
            raise
        raise PlannerContractError(f"{call} raised {described(error)}") from error
    broken = seal.broken()
    if broken is not None:
        raise PlannerContractError(f"{call} changed scene.{broken}; allowed: reading")


@contextmanager
def _looked_at(call: str) -> Iterator[None]:
    """Watch what was returned while it is looked at: it may be anyone's code, too.

    Raises:
        PlannerContractError: Whatever it raises.
    """
    try:
        yield
    except PlannerContractError:
        raise
    except BaseException as error:
        if is_interrupt(error):
            raise
        words = f"what {call} returned raises {described(error)}"
        raise PlannerContractError(words) from error


def watched(planner: Planner) -> CheckedPlanner:
    """Return a planner whose results are checked; one for many egos stays one."""
    try:
        for_many = isinstance(planner, BatchPlanner)
    except BaseException as error:  # asking anyone's object for a method
        if is_interrupt(error):
            raise
        for_many = False
    if for_many:
        return CheckedBatchPlanner(cast(BatchPlanner, planner))
    return CheckedPlanner(planner)


def checked(result: object, call: str = "plan()") -> PlanResult:
    """Check what a planner returned, and make NumPy's numbers plain ones.

    Args:
        result: What it returned.
        call: Of what.

    Raises:
        PlannerContractError: Says what is wrong and what is allowed.
    """
    if not isinstance(result, PlanResult):
        raise _wrong(call, result, "a PlanResult")
    if result.status not in list(PlanStatus):
        names = ", ".join(str(status) for status in PlanStatus)
        raise _wrong("status", result.status, names)
    if not isinstance(result.trajectory, Trajectory | None):
        raise _wrong("trajectory", result.trajectory, "a Trajectory or None")
    return PlanResult(  # a new one: a subclass may do anything
        status=PlanStatus(result.status),
        trajectory=_checked_trajectory(result.trajectory),
        memory=result.memory,
        stats=_checked_stats(result.stats),
        alternatives=_checked_alternatives(result.alternatives),
        speed_graph=_checked_graph(result.speed_graph),
        indicator=_indicator(result.indicator),
    )


def _checked_trajectory(trajectory: Trajectory | None) -> Trajectory | None:
    """Copy a trajectory, which checks its shapes and times again."""
    if trajectory is None:
        return None
    columns = {
        one.name: np.asarray(getattr(trajectory, one.name))
        for one in fields(Trajectory)
    }
    for name, column in columns.items():
        if column.size > MAX_POINTS:
            raise _wrong(f"trajectory.{name}", column, f"up to {MAX_POINTS} points")
    return Trajectory(**columns)


def _indicator(value: object) -> Indicator:
    """Return the indicator of a result; raises PlannerOutputError."""
    if value not in set(Indicator):
        raise _wrong("indicator", value, "left, right or empty")
    return Indicator(str(value))


def _checked_stats(stats: object) -> PlanStats:
    """Check the statistics."""
    if not isinstance(stats, PlanStats):
        raise _wrong("stats", stats, "PlanStats")
    if not isinstance(stats.reason, str):
        raise _wrong("stats.reason", stats.reason, "text")
    if not isinstance(stats.explanation, str):
        raise _wrong("stats.explanation", stats.explanation, "text")
    if not isinstance(stats.blocker, str | None):
        raise _wrong("stats.blocker", stats.blocker, "text or None")
    return PlanStats(
        reason=in_one_line(stats.reason),
        blocker=None if stats.blocker is None else str(stats.blocker),
        candidates=_count("stats.candidates", stats.candidates),
        survivors=None
        if stats.survivors is None
        else _count("stats.survivors", stats.survivors),
        removed={
            key: _count(f"stats.removed[{key!r}]", value)
            for key, value in _named("stats.removed", stats.removed).items()
        },
        costs={
            key: _number(f"stats.costs[{key!r}]", value)
            for key, value in _named("stats.costs", stats.costs).items()
        },
        explanation=in_one_line(stats.explanation),
    )


def _checked_alternatives(
    give: object,
) -> Callable[[], tuple[Alternative, ...]] | None:
    """Wrap what gives the candidates: a mistake in it costs only the picture."""
    if give is None:
        return None
    if not callable(give):
        raise _wrong("alternatives", give, "a function or None")

    def checked_ones() -> tuple[Alternative, ...]:
        try:
            return tuple(_plain(one) for one in give())
        except BaseException as error:  # anyone's code, called after the plan is made
            if is_interrupt(error):
                raise
            log.warning("the planner's alternatives cannot be drawn", exc_info=True)
            return ()

    return checked_ones


def _checked_graph(give: object) -> Callable[[], SpeedGraph | None] | None:
    """Wrap what gives the s-T graph: a mistake in it costs only the picture."""
    if give is None:
        return None
    if not callable(give):
        raise _wrong("speed_graph", give, "a function or None")

    def checked_one() -> SpeedGraph | None:
        try:
            return _sound_graph(give())
        except BaseException as error:  # anyone's code, called after the plan is made
            if is_interrupt(error):
                raise
            log.warning("the planner's s-T graph cannot be drawn", exc_info=True)
            return None

    return checked_one


def _sound_graph(graph: object) -> SpeedGraph:
    """Check the shapes of an s-T graph.

    Raises:
        PlannerContractError: Names what has another shape.
    """
    if not isinstance(graph, SpeedGraph):
        raise _wrong("speed_graph()", graph, "a SpeedGraph")
    names = ("t", "distance", "lower", "upper")
    arrays = {n: np.asarray(getattr(graph, n), dtype=np.float64) for n in names}
    t, n = arrays["t"], len(graph.ids)
    if t.ndim != 1 or t.size < 2:  # noqa: PLR2004, a step between two times
        raise _wrong("speed_graph.t", t, "at least two times")
    shapes = {"distance": t.shape, "lower": (n, t.size), "upper": (n, t.size)}
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise _wrong(f"speed_graph.{name}", arrays[name], f"an array {shape}")
    if len(graph.sides) != n:
        raise _wrong("speed_graph.sides", graph.sides, "one for each id")
    ids, sides = (tuple(map(str, words)) for words in (graph.ids, graph.sides))
    return SpeedGraph(
        t, arrays["distance"], ids, sides, arrays["lower"], arrays["upper"]
    )


def _plain(one: Alternative) -> Alternative:
    """Bring an alternative into arrays of one length."""
    if _is_plain(one):  # dozens in a step
        return one
    x, y = np.broadcast_arrays(
        np.atleast_1d(np.asarray(one.x, dtype=np.float64)),
        np.asarray(one.y, dtype=np.float64),
    )
    return Alternative(str(one.verdict), x, y)


def _is_plain(one: Alternative) -> bool:
    """Check whether there is nothing to be brought into shape."""
    x, y = one.x, one.y
    arrays = type(x) is type(y) is np.ndarray and type(one.verdict) is str
    return (
        arrays
        and x.dtype == y.dtype == np.float64
        and x.ndim == 1
        and x.shape == y.shape
    )


def _named(name: str, values: object) -> Mapping[str, object]:
    """Check that values have names."""
    if not isinstance(values, Mapping) or not all(isinstance(k, str) for k in values):
        raise _wrong(name, values, "a mapping from text to numbers")
    return values


def _count(name: str, value: object) -> int:
    """Make a plain int of a whole number."""
    if not isinstance(value, Integral):
        raise _wrong(name, value, "a whole number")
    return int(value)


def _number(name: str, value: object) -> float:
    """Make a plain float of a finite number."""
    if not isinstance(value, Real) or not math.isfinite(value):
        raise _wrong(name, value, "a finite number")
    return float(value)


def _wrong(name: str, value: object, allowed: str) -> PlannerContractError:
    """Make the error about one thing."""
    try:
        shown = f"{type(value).__name__} {value!r}"
    except BaseException:  # noqa: BLE001, anyone's code
        shown = type(value).__name__
    shown = f"{shown[:60]}..." if len(shown) > 60 else shown  # noqa: PLR2004, one line
    return PlannerContractError(f"{name} is {shown}; allowed: {allowed}")
