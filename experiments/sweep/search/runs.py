"""Runs the points of a search as runs of a sweep, and reads what is there already."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from experiments.config.axes import Point
from experiments.config.scenario_file import named_scenario, tuples
from experiments.config.search import Search
from experiments.config.sweep import Sweep
from experiments.config.yaml_reader import Document, KeyPath
from experiments.errors import ConfigError
from experiments.metrics.row import read_row
from experiments.storage.run_files import read_manifest
from experiments.sweep.executors.executor import Executor
from experiments.sweep.folder import finished, run_folder, take
from experiments.sweep.plan import Plan, PlannedRun
from experiments.sweep.progress import SweepProgress
from experiments.sweep.schedule import drive_missing, survey
from experiments.sweep.search.exploration import Tried
from experiments.sweep.search.objective import TrialJudgement, judge

NO_POINT = TrialJudgement(None)


class LimitReachedError(Exception):
    """No more runs may be executed in this call; the next one goes on."""


class KeptExecutor:
    """An executor that lives through many batches; `stop` leaves it as it is."""

    def __init__(self, make: Callable[[], Executor]) -> None:
        self._make = make
        self._real: Executor | None = None

    def __call__(self) -> "KeptExecutor":
        """Return itself, started."""
        if self._real is None:
            self._real = self._make()
        return self

    def __getattr__(self, name: str) -> Any:
        """Hand everything else to the real one."""
        return getattr(self._real, name)

    def stop(self) -> None:
        """Do nothing: the next batch needs it."""

    def end(self) -> None:
        """Stop the real one."""
        if self._real is not None:
            self._real.stop()


class SearchRuns:
    """The runs of a search in the folder of a sweep, which is locked.

    Args:
        search: The search.
        document: Its file, for messages.
        folder: Absolute.
        make_executor: Starts the executor.
        progress: Shows how far it is.
        limit: Largest number of runs to execute.
    """

    def __init__(
        self,
        search: Search,
        document: Document,
        folder: Path,
        make_executor: Callable[[], Executor],
        progress: SweepProgress,
        limit: int | None = None,
    ) -> None:
        self._search, self._document, self._folder = search, document, folder
        self._executor = KeptExecutor(make_executor)
        self._progress = progress
        self._left = limit
        self._points: dict[str, Point] = {}
        self._known: dict[str, Tried] = {}

    def run(self, points: Sequence[Point]) -> list[Tried]:
        """Run those points that have not been run; return all results in order.

        Raises:
            LimitReachedError: If there was not enough of the limit left.
        """
        keys = [json.dumps(point, sort_keys=True) for point in points]
        new = {
            key: point
            for key, point in zip(keys, points, strict=True)
            if key not in self._known
        }
        if new:
            self._run_new(new)
        return [self._known[key] for key in keys]

    def end(self) -> None:
        """Stop the worker processes."""
        self._executor.end()

    def _run_new(self, new: dict[str, Point]) -> None:
        """Run points that are not known yet."""
        planned = self._planned(new)
        valid = {key: new[key] for key, run in planned.items() if run is not None}
        self._points |= valid
        there = finished(self._folder)
        ids = {run.run_id for run in planned.values() if run is not None}
        missing = ids - there
        counts = self._progress.counts
        counts.there += len(ids) - len(missing)
        counts.missing -= len(new) - len(missing)
        counts.missing = max(counts.missing, counts.done + len(missing))
        if missing:
            self._drive(list(valid.values()), len(missing))
        for key, run in planned.items():
            self._known[key] = Tried(None, NO_POINT) if run is None else self._read(run)

    def _drive(self, points: list[Point], missing: int) -> None:
        """Execute the runs of some points."""
        if self._left == 0:
            raise LimitReachedError
        batch, plan = sweep_of_points(self._search, self._document, points)
        everything, _ = sweep_of_points(
            self._search, self._document, list(self._points.values())
        )
        take(self._folder, everything, survey(plan, self._folder).code)
        drive_missing(
            plan, batch, self._folder, self._executor, self._progress, self._left
        )
        if self._left is not None:
            short = missing > self._left
            self._left = max(self._left - missing, 0)
            if short:
                raise LimitReachedError

    def _planned(self, new: dict[str, Point]) -> dict[str, PlannedRun | None]:
        """Return the run of each point; None if it is no valid scenario."""
        points = list(new.values())
        try:
            runs: list[PlannedRun | None] = list(self._plan(points))
        except ConfigError:  # of one of them: plan each by itself
            runs = [self._planned_alone(point) for point in points]
        return dict(zip(new, runs, strict=True))

    def _planned_alone(self, point: Point) -> PlannedRun | None:
        """Return the run of a point; None if it is no valid scenario."""
        try:
            return next(iter(self._plan([point])))
        except ConfigError:
            return None

    def _plan(self, points: list[Point]) -> Plan:
        """Return the plan of some points."""
        return sweep_of_points(self._search, self._document, points)[1]

    def _read(self, run: PlannedRun) -> Tried:
        """Read and judge a finished run."""
        folder = run_folder(self._folder, run.run_id)
        failure = read_manifest(folder).get("failure")
        judgement = judge(self._search.objective, read_row(folder), failure)
        return Tried(run.run_id, judgement)


def sweep_of_points(
    search: Search, document: Document, points: Sequence[Point]
) -> tuple[Sweep, Plan]:
    """Return the sweep whose runs are those of some points, and its plan.

    Args:
        search: The search.
        document: Its file, for messages.
        points: Distinct ones; without any the scenario as it is.
    """
    where = f"{document.where(('scenario',))}: scenario"
    base = named_scenario(search.scenario, where)
    axes = {key: [point[key] for point in points] for key in search.space}
    content = {
        "name": search.name,
        "purpose": search.purpose,
        "scenarios": [search.scenario],
        "planners": [search.planner.model_dump(exclude_none=True)],
        "set": dict(search.set),
        "axes": {"zip": axes} if points else {},
        "seeds": [own_seed(search, base)],
        "timeout_s": search.timeout_s,
        "memory_mb": search.memory_mb,
        "keep_traces": str(search.keep_traces),
    }
    places: dict[KeyPath, str] = {
        ("axes", "zip", key): document.where(("space", key)) for key in search.space
    }
    places |= {("set", key): document.where(("set", key)) for key in search.set}
    places["planners",] = document.where(("planner",))
    places["planners", 0, "set"] = document.where(("planner", "set"))
    sweep = Sweep.model_validate(tuples(content))
    return sweep, Plan(sweep, Document(document.name, None, places))


def own_seed(search: Search, base: Document) -> int:
    """Return the seed of all trials, so that they compare: that of the scenario."""
    if search.scenario_seed is not None:
        return search.scenario_seed
    data = base.data
    simulation = data.get("simulation") if isinstance(data, dict) else None
    seed = simulation.get("seed", 0) if isinstance(simulation, dict) else 0
    return seed if isinstance(seed, int) else 0
