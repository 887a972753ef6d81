"""What is shipped: scenarios, networks, sweeps and planners, with one line each."""

from experiments.config.scenario_file import load_scenario, scenario_names
from experiments.config.sweep_file import load_sweep, sweep_names
from experiments.planners.registry import PLANNERS
from sumo_nets import catalogue


def scenarios() -> dict[str, str]:
    """Return the shipped scenarios, each with its purpose."""
    return {name: load_scenario(name).purpose for name in scenario_names()}


def networks() -> dict[str, str]:
    """Return the shipped networks, each with its description."""
    return {name: net.description for name, net in catalogue.networks().items()}


def sweeps() -> dict[str, str]:
    """Return the shipped sweeps, each with its purpose."""
    return {name: load_sweep(name)[0].purpose for name in sweep_names()}


def planners() -> dict[str, str]:
    """Return the registered planners, each with its purpose."""
    return {name: known.purpose for name, known in PLANNERS.items()}
