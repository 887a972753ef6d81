"""Makes a user's planner in a process of its own, which it may take down."""

import json
import os
from collections.abc import Mapping
from typing import Any

from experiments.errors import ConfigError
from experiments.planners.registry import make_planner
from experiments.sweep.processes.guarded import (
    CallLimits,
    CallLostError,
    GuardedProcess,
)

_MADE: set[tuple[str, str]] = set()  # by this process: a search plans many batches
TRIAL_LIMITS = CallLimits(time=600.0, memory_mb=16_000.0)  # it may load a large model


def make_apart(name: str, settings: Mapping[str, Any]) -> None:
    """Check that a planner can be made.

    Raises:
        ConfigError: If it cannot, or its process dies, hangs or takes too much memory.
    """
    asked = name, json.dumps(settings, sort_keys=True, default=str)
    if asked in _MADE:
        return
    _make_apart(name, settings)
    _MADE.add(asked)


def _make_apart(name: str, settings: Mapping[str, Any]) -> None:
    """Make a planner in a process of its own; raises ConfigError."""
    if not hasattr(os, "fork"):
        make_planner(name, settings)
        return
    guarded = GuardedProcess()
    try:
        problem = guarded.call(_problem, (name, settings), TRIAL_LIMITS)
    except CallLostError as loss:
        problem = f"planner: {name}: the process that makes it {loss}"
    finally:
        guarded.kill()
    if problem is not None:
        raise ConfigError(problem)


def _problem(planner: tuple[str, Mapping[str, Any]]) -> str | None:
    """Make a planner; return what is wrong with it."""
    try:
        make_planner(*planner)
    except ConfigError as error:
        return str(error)
    return None
