"""The JSON files of a run folder: their names, reading and writing."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import ResultsError

MANIFEST = "manifest.json"
METRICS = "metrics.json"


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file of a run folder.

    Raises:
        ResultsError: If it is missing or is not JSON.
    """
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultsError(
            f"{path}: is damaged ({error}); remove its folder and run the sweep again"
        ) from error
    return content


def read_manifest(run: Path) -> dict[str, Any]:
    """Read the manifest of a run folder.

    Raises:
        ResultsError: If it is missing or is not JSON.
    """
    return read_json(run / MANIFEST)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write indented JSON."""
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
