"""The identity of a run: a hash of everything that it is made from."""

from functools import cache
from pathlib import Path
from typing import Any

from experiments.config import Scenario
from experiments.config.ego import TUBE_WORDS
from experiments.config.scenario_file import config_hash
from experiments.planners.registry import user_module
from experiments.planners.source_files import planner_sources
from experiments.storage import provenance as manifest
from experiments.world_setup.demand_files import demand_files
from sumo_nets.errors import NetworkError

SHAPING = ("python", "libsumo", "numpy", "scipy", "numba")


def run_identity(scenario: Scenario, net_file: Path | None) -> dict[str, Any]:
    """Return what a run is made from.

    Args:
        scenario: Checked.
        net_file: Its network, None in the world without a simulator.

    Returns:
        The hashes, scenario, planner and seed, versions, and the state of git.
    """
    return {
        **run_hashes(scenario, net_file),
        "scenario": scenario.name,
        "planner": scenario.driven_by,
        "seed": scenario.simulation.seed,
        "versions": _versions(),
        "git": _git_state(),
    }


def run_hashes(scenario: Scenario, net_file: Path | None) -> dict[str, str | None]:
    """Hash configuration, network, code and a user's planner, and all in one."""
    configuration = config_hash(scenario.resolved())
    network = _file_hash(*_stamp(net_file)) if net_file else None
    modules = [user_module(choice.name) for _, choice in scenario.planner_choices()]
    planner = " ".join(dict.fromkeys(filter(None, map(_planner_hash, modules)))) or None
    code = code_hash()
    return {
        "run_hash": manifest.text_hash(
            f"{configuration} {network} {code} {planner}{_demand_hashes(scenario)}"
            f"{_tube_hash(scenario)}"
        ),
        "config_hash": configuration,
        "network_hash": network,
        "code_hash": code,
        "planner_hash": planner,
    }


def _planner_hash(module_name: str | None) -> str | None:
    """Hash a user's planner with what it imports from beside it, None for ours."""
    sources = planner_sources(module_name) if module_name else ()
    hashes = [f"{file.name} {_file_hash(*_stamp(file))}" for file in sources]
    return manifest.text_hash("\n".join(hashes)) if hashes else None


def _demand_hashes(scenario: Scenario) -> str:
    """Hash the files of a user's own demand; "" without them."""
    try:
        demand = demand_files(scenario)
    except NetworkError as error:
        raise scenario.error(("traffic",), str(error)) from error
    files = () if demand is None else demand.files
    hashes = (_file_hash(*_stamp(file)) for file in files if file.is_file())
    options = () if demand is None else (demand.begin, *demand.options)
    return "".join(f" {item}" for item in (*hashes, *options))


def _tube_hash(scenario: Scenario) -> str:
    """Hash the file of a tube; "" without one."""
    if scenario.single_ego is None:
        return ""
    tube = scenario.single_ego.tube
    if tube is None or tube in TUBE_WORDS or not Path(tube).is_file():
        return ""
    return f" {_file_hash(*_stamp(Path(tube)))}"


@cache
def code_hash() -> str:
    """Hash the code as it was at this process's first call: that is what it runs."""
    return manifest.code_hash()


def shaping_versions() -> dict[str, str | None]:
    """Return the versions of the libraries that determine the traces."""
    found = _versions()
    return {name: found[name] for name in SHAPING}


@cache
def _versions() -> dict[str, str | None]:
    """Return all versions, read once a process: it takes milliseconds."""
    return manifest.versions()


@cache
def _git_state() -> dict[str, Any] | None:
    """Return the state of git, read once a process: it takes two processes."""
    return manifest.git_state()


def _stamp(file: Path) -> tuple[Path, int]:
    """Return a file with the time of its last change."""
    return file, file.stat().st_mtime_ns


@cache
def _file_hash(file: Path, _changed: int) -> str:
    """Hash a file once for each of its versions."""
    return manifest.file_hash(file)
