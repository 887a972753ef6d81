"""JSON files of run folders and sweeps: names, reading, writing."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import ResultsError
from experiments.storage.atomic_folder import write_atomically

MANIFEST = "manifest.json"
METRICS = "metrics.json"


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        ResultsError: If the file is missing or is not a JSON object.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error
    if not isinstance(content, dict):
        raise ResultsError(f"{path}: is damaged: not a JSON object")
    return content


def read_manifest(run: Path) -> dict[str, Any]:
    """Read the manifest of a run folder.

    Raises:
        ResultsError: If it is missing or is not a JSON object.
    """
    return read_json(run / MANIFEST)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write indented JSON into a folder that is being filled."""
    path.write_text(_indented(content), encoding="utf-8")


def replace_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write indented JSON so that readers see the old file or the new one.

    Raises:
        ResultsError: If it cannot be written, for example on a full disk.
    """
    write_atomically(path, _indented(content))


def _indented(content: Mapping[str, Any]) -> str:
    """Format JSON for people."""
    return json.dumps(content, indent=2) + "\n"
