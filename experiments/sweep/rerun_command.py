"""The command that repeats a run of a sweep."""

import shlex
from collections.abc import Iterable

from experiments.config.planner_modules import ALLOW_PLANNER, OWN_MODULES
from experiments.planners.registry import user_module


def rerun_command(place: str, planners: Iterable[str], run_id: str = "") -> str:
    """Write the command, with leave for the modules of users' planners.

    Args:
        place: Of the sweep's folder.
        planners: Names of those that may have driven.
        run_id: Of the run; "" if it is to be written behind the command.
    """
    modules = {module for name in planners if (module := user_module(name))}
    words = ["rearview", "rerun", place, *([run_id] if run_id else [])]
    for module in sorted(modules - OWN_MODULES):
        words += [ALLOW_PLANNER, module]
    return shlex.join(words)
