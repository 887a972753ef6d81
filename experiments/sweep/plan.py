"""Runs of a sweep from its axes, each with its id before anything runs."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from experiments.config import Scenario
from experiments.config.axes import Point, axis_points
from experiments.config.scenario_file import (
    Change,
    changed,
    check_scenario,
    named_scenario,
    parse_key,
)
from experiments.config.sweep import Sweep, SweptPlanner
from experiments.config.yaml_reader import Document, KeyPath
from experiments.episode.identity import run_hashes
from experiments.errors import ConfigError
from experiments.planners.registry import PLANNERS, make_planner
from experiments.sweep.claim import check_claim
from experiments.sweep.trial import make_apart
from sumo_nets import catalogue
from sumo_nets.errors import NetworkError

ID_LENGTH = 16  # characters of the run's hash: 64 bits, enough for a million runs

_NOT_FOR_AXES = (("name",), ("planner",), ("planner", "name"), ("simulation", "seed"))


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One planned run."""

    run_id: str
    scenario: Scenario
    label: str  # of the planner
    point: Point  # on the axes
    hashes: dict[str, str | None] = field(repr=False)


class Plan:
    """The runs of a sweep, created one by one; only their ids are kept."""

    def __init__(self, sweep: Sweep, document: Document) -> None:
        self._sweep = sweep
        self._places = document
        self._planners_place = document.where(("planners",))
        self._seeds_place = document.where(("seeds",))
        check_claim(sweep, document)
        self._bases = [
            named_scenario(
                name, f"{document.where(('scenarios', index))}: scenarios[{index}]"
            )
            for index, name in enumerate(sweep.scenarios)
        ]
        self._set = [
            self._change(("set",), key, value) for key, value in sweep.set.items()
        ]
        self._own = {
            planner.shown: [
                self._change(("planners", index, "set"), key, value)
                for key, value in planner.set.items()
            ]
            for index, variants in enumerate(sweep.labelled)
            for planner in variants
        }

    def __len__(self) -> int:
        return self._sweep.count

    def __iter__(self) -> Iterator[PlannedRun]:
        """Yield the runs; the planner varies fastest, the seed slowest.

        So a sweep that is stopped has all its cells with as many seeds, and the runs
        that share their traffic without the ego follow each other. Planners of users
        come one after the other: each has a process of its own.

        Raises:
            ConfigError: If a scenario with these values is invalid, or two runs are the
                same.
        """
        seen: set[str] = set()
        for run in self._all():
            if run.run_id in seen:
                raise ConfigError(
                    f"{self._places.name}: a run is there twice: {shown(run)}"
                )
            seen.add(run.run_id)
            yield run

    def _all(self) -> Iterator[PlannedRun]:
        """Yield the runs in order."""
        sweep = self._sweep
        points = list(enumerate(axis_points(sweep.axes)))
        for planners in _by_process(sweep.variants):
            for seed, base in product(sweep.all_seeds, self._bases):
                for (index, point), planner in product(points, planners):
                    yield self._run(base, planner, point, seed, first=index == 0)

    def _run(
        self,
        base: Document,
        planner: SweptPlanner,
        point: Point,
        seed: int,
        *,
        first: bool,
    ) -> PlannedRun:
        """Create one run; `first`: of its planner."""
        place = self._planners_place
        changes: list[Change] = [(("planner",), planner.name, place)]
        changes += [
            (("planner", "settings", key), plain(value), place)
            for key, value in planner.settings.items()
        ]
        changes += self._set
        changes += self._own[planner.shown]
        changes += [self._change(("axes",), key, value) for key, value in point.items()]
        changes.append((("simulation", "seed"), seed, self._seeds_place))
        scenario = check_scenario(changed(base, changes))
        if seed == self._sweep.all_seeds[0]:
            self._check_planner(scenario, point, first=first)
        hashes = run_hashes(scenario, net_file_of(scenario))
        run_id = str(hashes["run_hash"])[:ID_LENGTH]
        return PlannedRun(run_id, scenario, planner.shown, point, hashes)

    def _check_planner(self, scenario: Scenario, point: Point, *, first: bool) -> None:
        """Create the planner to check its settings.

        That of a user once only: it may be slow.
        """
        choice = scenario.planner
        if not (first or choice.name in PLANNERS):
            return
        try:
            if choice.name in PLANNERS:
                make_planner(choice.name, choice.settings)
            else:
                make_apart(choice.name, choice.settings)
        except ConfigError as error:
            raise ConfigError(f"{self._blamed(point, str(error))}: {error}") from error

    def _blamed(self, point: Point, problem: str) -> str:
        """Return the place where a setting that a planner rejects was written."""
        key = problem.partition(": ")[0]
        for section, keys in (("axes", point), ("set", self._sweep.set)):
            for written in keys:
                if f"{key}.".startswith(f"{written}."):
                    return self._where((section,), written)
        return self._planners_place

    def _change(self, section: KeyPath, key: str, value: Any) -> Change:
        """Return the key of the scenario, its value, and where they were written."""
        where = self._where(section, key)
        path = parse_key(key)
        if path is None:
            raise ConfigError(f"{where}: {key}: is not a key; allowed: key.path")
        if path in _NOT_FOR_AXES:
            raise ConfigError(
                f"{where}: {key}: is not for axes; allowed: seeds, planners, scenarios"
            )
        return path, plain(value), where

    def _where(self, section: KeyPath, key: str) -> str:
        """Return the place where an axis was written."""
        paths: list[KeyPath] = [
            (*section, key),
            *((*section, kind, key) for kind in ("grid", "zip")),
            (*section, "sample", "ranges", key),
        ]
        for path in paths:
            if path in self._places.places:
                return self._places.places[path]
        return self._places.where(section)


def _by_process(planners: Iterable[SweptPlanner]) -> list[list[SweptPlanner]]:
    """Group planners that run in one process: ours, and each user's."""
    groups: dict[str, list[SweptPlanner]] = {}
    for planner in planners:
        owner = "" if planner.name in PLANNERS else planner.name
        groups.setdefault(owner, []).append(planner)
    return list(groups.values())


def plain(value: Any) -> Any:
    """Convert the schema's tuples to lists."""
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return value


def net_file_of(scenario: Scenario) -> Path | None:
    """Return the network file of a scenario."""
    network = scenario.network
    if network is None:
        return None
    try:
        return _existing(network.file, network.name)
    except NetworkError as error:
        raise scenario.error(("network",), str(error)) from error


@cache
def _existing(file: str | None, name: str | None) -> Path:
    """Return an existing network file, of the catalogue or a user's."""
    path = Path(file) if file else catalogue.network(name or "").net_file
    if not path.is_file():
        raise NetworkError(f"{path}: no such file")
    return path


def shown(run: PlannedRun) -> str:
    """Describe a run in a few words."""
    seed = run.scenario.simulation.seed
    point = "".join(f", {key} = {value}" for key, value in run.point.items())
    return f"{run.scenario.name}, {run.label}, seed {seed}{point}"
