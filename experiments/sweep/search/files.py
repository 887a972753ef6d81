"""The files of a search in its folder, for those who read them and run nothing."""

from collections.abc import Mapping
from typing import Any

ASKED = "asked.json"  # what the folder was searched for
FOUND = "search.json"  # what was found, once it is finished
PROBABILITY = "probability"  # key of the latter: of a failure
STOPS = "stop_after_failures"  # key of the latter: None where the budget ends it


def probability_words(value: float, low: float, high: float) -> str:
    """Say how probable a failure is, with its interval."""
    if not value:
        return f"below {high:.2g} (95 %)"
    return f"{value:.2g} (95 %: {low:.2g} to {high:.2g})"


def shown(point: Mapping[str, Any]) -> str:
    """Show the values of a point."""
    return ", ".join(f"{key} {value}" for key, value in point.items())
