"""What a folder was searched for; the same trials come back only for the same."""

from pathlib import Path
from typing import Any

from experiments.config.scenario_file import config_hash
from experiments.config.search import Search
from experiments.errors import ConfigError
from experiments.storage.json_files import read_json
from experiments.storage.run_files import replace_json
from experiments.sweep.search.files import ASKED

_MAY_CHANGE = frozenset(  # without a trial that changes
    (
        "purpose",
        "budget",
        "stop_after_failures",
        "against",
        "reduce",
        "reduction_runs",
        "timeout_s",
        "memory_mb",
        "keep_traces",
    )
)


def asked_content(search: Search, base: dict[str, Any]) -> dict[str, Any]:
    """Return what decides the trials of a search.

    Args:
        search: The search.
        base: The resolved scenario of the mild point.
    """
    content = search.model_dump(mode="json")
    kept = {key: content[key] for key in content if key not in _MAY_CHANGE}
    if search.method == "sobol":
        kept["budget"] = search.budget  # the scramble depends on the length
    return {**kept, "scenario_hash": config_hash(base)}


def require_same(folder: Path, asked: dict[str, Any]) -> None:
    """Reject going on in a folder that was searched for something else.

    Raises:
        ConfigError: One line that names the first key that differs.
    """
    path = folder / ASKED
    if not path.is_file():
        return
    before = read_json(path)
    for key, now in asked.items():
        was = before.get(key)
        if was != now:
            name, old, new = _difference(key, was, now)
            raise ConfigError(
                f"{folder}: was searched with {name} {_words(old)}, now "
                f"{_words(new)}; allowed: the same, or another --out"
            )


def _difference(key: str, was: Any, now: Any) -> tuple[str, Any, Any]:
    """Return what differs, in a section its first key, and both values."""
    if not (isinstance(was, dict) and isinstance(now, dict)):
        return key, was, now
    missing = object()
    inner = next(k for k in (*was, *now) if was.get(k, missing) != now.get(k, missing))
    return f"{key}.{inner}", was.get(inner), now.get(inner)


def note_asked(folder: Path, asked: dict[str, Any]) -> None:
    """Write what a folder is searched for."""
    replace_json(folder / ASKED, asked)


def _words(value: Any) -> str:
    """Show a value: of a range its ends, of a section what is set."""
    if value is None:
        return "not there"
    if isinstance(value, dict):
        given = {k: v for k, v in value.items() if v not in (None, False)}
        if set(given) == {"range"}:
            return str(given["range"])
        return ", ".join(f"{k} {v}" for k, v in given.items()) or "none"
    text = str(value)
    return text[:16] if len(text) > 40 else text  # noqa: PLR2004 - a hash
