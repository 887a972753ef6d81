"""Tells scenarios from sweeps, for users who give one to the other's command."""

from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parent.parent
_SCENARIOS, _SWEEPS = _FOLDER / "scenarios", _FOLDER / "sweeps"


def hint_at_sweep(name: str, data: Any = None) -> str | None:
    """Return a hint if what was given as a scenario is a sweep.

    Args:
        name: As given: a shipped name or a file.
        data: Content of the file, if it is one.
    """
    keys = data if isinstance(data, dict) else {}
    is_sweep = {"scenarios", "seeds"} & keys.keys() and "ego" not in keys
    if is_sweep or _is_shipped(name, _SWEEPS, _SCENARIOS):
        return f"is a sweep; did you mean rearview sweep {name}?"
    return None


def hint_at_scenario(name: str, data: Any = None) -> str | None:
    """Return a hint if what was given as a sweep is a scenario, see above."""
    keys = data if isinstance(data, dict) else {}
    is_scenario = "ego" in keys and "scenarios" not in keys
    if is_scenario or _is_shipped(name, _SCENARIOS, _SWEEPS):
        return f"is a scenario; did you mean rearview run {name}?"
    return None


def _is_shipped(name: str, folder: Path, other: Path) -> bool:
    """Check for a shipped file of a plain name that is not one in the other folder."""
    there, elsewhere = ((each / f"{name}.yaml").is_file() for each in (folder, other))
    return name.isidentifier() and there and not elsewhere
