"""Files that are given by a shipped name or a path: of sweeps and of searches."""

from pathlib import Path
from typing import Any

from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError


def shipped_names(folder: Path) -> list[str]:
    """List the shipped files of a folder."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def find_file(name: str, folder: Path, what: str, hint: str | None) -> Path:
    """Resolve a shipped name or a path to the path of a file.

    Args:
        name: As given.
        folder: Of the shipped files.
        what: They are: `sweep`.
        hint: What the name is if it is none of them.

    Raises:
        ConfigError: If there is neither a file nor a shipped one of that name.
    """
    path, known = Path(name), shipped_names(folder)
    if name and path.is_dir() and name not in known:
        raise ConfigError(f"{name}: is a folder; allowed: a {what} file")
    if name.endswith((".yaml", ".yml")) or "/" in name:
        return path
    if name not in known:
        if hint is not None:
            raise ConfigError(f"{name}: {hint}")
        words = f"no such {what}; {unknown_name(name, known)}"
        raise ConfigError(f"{name or repr(name)}: {words}, or a .yaml file")
    return folder / f"{name}.yaml"


def anchored(name: Any, folder: Path) -> Any:
    """Resolve the path of a scenario file, relative to the file that names it."""
    is_file = isinstance(name, str) and (
        name.endswith((".yaml", ".yml", ".xml")) or "/" in name
    )
    return str((folder / name).resolve()) if is_file else name
