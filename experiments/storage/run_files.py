"""JSON files of run folders and sweeps: names, reading, writing."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import ResultsError

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
    """Write indented JSON."""
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
