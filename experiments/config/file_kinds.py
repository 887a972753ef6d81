"""Tells scenarios, sweeps and searches apart for whom gives one to another command."""

from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parent.parent
_SCENARIOS, _SWEEPS = _FOLDER / "scenarios", _FOLDER / "sweeps"
_SEARCHES = _FOLDER / "searches"


def hint_at_sweep(name: str, data: Any = None) -> str | None:
    """Return a hint if what was given as a scenario is a sweep.

    Args:
        name: As given: a file, or a name that no shipped scenario has.
        data: Content of the file, if there is one.
    """
    if data is None:
        is_sweep = _is_shipped(name, _SWEEPS)
    else:
        is_sweep = bool({"scenarios", "seeds"} & _keys(data)) and not {
            "ego",
            "egos",
        } & _keys(data)
    return f"is a sweep; did you mean rearview sweep {name}?" if is_sweep else None


def hint_at_search(name: str, data: Any = None) -> str | None:
    """Return a hint if what was given as a scenario or sweep is a search, see above."""
    if data is None:
        is_search = _is_shipped(name, _SEARCHES)
    else:
        is_search = {"scenario", "space"} <= _keys(data)
    return f"is a search; did you mean rearview search {name}?" if is_search else None


def hint_at_scenario(name: str, data: Any = None) -> str | None:
    """Return a hint if what was given as a sweep is a scenario, see above."""
    if data is None:
        is_scenario = _is_shipped(name, _SCENARIOS)
    else:
        egos = {"ego", "egos"} & _keys(data)
        is_scenario = bool(egos) and "scenarios" not in data
    return f"is a scenario; did you mean rearview run {name}?" if is_scenario else None


def _keys(data: Any) -> set[Any]:
    """Return the keys of a file's content, none if it has none."""
    return set(data) if isinstance(data, dict) else set()


def _is_shipped(name: str, folder: Path) -> bool:
    """Check for a shipped file of a plain name."""
    return name.isidentifier() and (folder / f"{name}.yaml").is_file()
