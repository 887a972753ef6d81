"""A scenario in Python: load, change, run."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.api.runs import Run
from experiments.config.planner_modules import require_allowed
from experiments.config.scenario import Scenario as CheckedScenario
from experiments.config.scenario_file import (
    Change,
    changed,
    check_scenario,
    parse_key,
    scenario_document,
)
from experiments.config.yaml_reader import Document
from experiments.episode.drive import run_scenario
from experiments.episode.newest_run import RUNS
from experiments.episode.run_folder import OutputOptions
from experiments.errors import ConfigError
from experiments.planners.registry import require_planner_name


class Scenario:
    """A checked scenario; never changes, `with_` makes another one.

    Made by `Scenario.load`.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._checked = check_scenario(document)

    @classmethod
    def load(
        cls, name: str | Path, *, allow_planners: Collection[str] = ()
    ) -> "Scenario":
        """Read a scenario.

        Args:
            name: Shipped name, see `rearview.scenarios`, or a `.yaml` file; a SUMO
                configuration or a network file too.
            allow_planners: Modules of planners that the file may name though they are
                not beside it; their code is run.

        Returns:
            The scenario.

        Raises:
            ConfigError: One line that names the file, the key and what is allowed.
        """
        document = changed(scenario_document(str(name)), ())
        loaded = cls(document)
        planner = loaded._checked.planner.name
        place = document.where(("planner", "name"))
        require_allowed(planner, place, Path(document.name).parent, allow_planners)
        return loaded

    def with_(
        self,
        changes: Mapping[str, Any] | None = None,
        *,
        planner: str | None = None,
        seed: int | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> "Scenario":
        """Return a scenario with other values.

        Args:
            changes: Key to value, as `--set` takes them:
                `{"traffic.density": "dense"}`.
            planner: Registered planner, or `module:factory` of one's own. Another
                planner drops the settings of the one before.
            seed: Seed of traffic and obstacles.
            settings: Of the planner, laid over those that it has.

        Returns:
            The changed scenario; this one stays as it is.

        Raises:
            ConfigError: One line that names the key and what is allowed.
        """
        listed: list[Change] = []
        if planner is not None:
            require_planner_name(planner)
            listed.append((("planner",), planner, f"planner={planner!r}"))
        if seed is not None:
            key = ("simulation", "seed")
            listed.append((key, _plain(seed), f"seed={seed!r}"))
        for name, value in _mapping(settings, "settings").items():
            words = f"settings[{name!r}]"
            listed.append((("planner", "settings", name), _plain(value), words))
        for name, value in _mapping(changes, "changes").items():
            path = parse_key(str(name))
            if path is None:
                problem = "is not a key; allowed: key.path, as in traffic.density"
                raise ConfigError(f"with_: {name!r}: {problem}")
            listed.append((path, _plain(value), "with_"))
        return Scenario(changed(self._document, listed))

    def run(self, out: str | Path = RUNS) -> Run:
        """Run one episode in this process and write its run folder.

        Args:
            out: Parent of the run folder, whose name is made of scenario, planner, seed
                and a hash.

        Returns:
            The run, whatever its outcome: failures of planner and simulator are
            outcomes too.

        Raises:
            ConfigError: If the scenario cannot be run as written.
            SimulationError: If the simulator cannot be loaded, or runs already.
            ResultsError: If the run folder cannot be written.
        """
        options = OutputOptions(keeps_candidates=True)
        outcome = run_scenario(self._checked, out=Path(out), output=options)
        return Run.open(outcome.folder)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self._checked.name

    @property
    def planner(self) -> str:
        """Name of its planner."""
        return self._checked.planner.name

    @property
    def seed(self) -> int:
        """Seed of traffic and obstacles."""
        return self._checked.simulation.seed

    @property
    def config(self) -> dict[str, Any]:
        """Every key with its value, defaults included, as in a run's `config.yaml`."""
        return self._checked.resolved()

    @property
    def checked(self) -> CheckedScenario:
        """The record inside, which is not part of the stable API."""
        return self._checked

    def __repr__(self) -> str:
        """Name scenario, planner and seed."""
        return f"<Scenario {self.name}: {self.planner}, seed {self.seed}>"

    def __eq__(self, other: object) -> bool:
        """Two scenarios are the same if all their keys are."""
        return isinstance(other, Scenario) and self.config == other.config

    __hash__ = None  # type: ignore[assignment] # holds dictionaries


def _mapping(given: object, name: str) -> Mapping[Any, Any]:
    """Take what is to map keys to values; nothing is an empty mapping."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        problem = "allowed: a mapping of keys to values"
        raise ConfigError(f"with_: {name} is {given!r}; {problem}")
    return given


def _plain(value: Any) -> Any:
    """Turn values of Python and NumPy into those that YAML has."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | range):
        return [_plain(item) for item in value]
    return value
