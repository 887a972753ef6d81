"""The JSON files that every run folder has: names, schema, reading, writing."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from experiments.storage.atomic_folder import write_atomically
from experiments.storage.json_files import FileSchema, checked, read_json

MANIFEST = "manifest.json"
METRICS = "metrics.json"


class GitState(FileSchema):
    """State of the repository."""

    commit: str
    dirty: bool


class SweepPoint(FileSchema):
    """Place of a run in its sweep."""

    name: str | None = None
    label: str | None = None
    point: dict[str, Any] = Field(default_factory=dict)


class Manifest(FileSchema):
    """What a run was made from, and how it ended; the optional keys came later."""

    scenario: str
    planner: str
    seed: int
    status: str
    reason: str | None = None
    run_hash: str | None = None
    config_hash: str | None = None
    network_hash: str | None = None
    code_hash: str | None = None
    planner_hash: str | None = None
    trace_hash: str | None = None
    trace_schema: int | None = None
    trace_kept: bool | None = None
    moments: dict[str, int] | None = None  # of metrics, beside those in the trace
    versions: dict[str, str | None] | None = None
    git: GitState | None = None
    wall_s: float | None = None
    ended_at: str | None = None
    command: str | None = None
    sweep: SweepPoint | None = None
    run_id: str | None = None
    attempts: int | None = None
    exit_code: int | None = None
    failure: str | None = None


def read_manifest(run: Path) -> dict[str, Any]:
    """Read the manifest of a run folder.

    Raises:
        ResultsError: If it is missing or does not fit its schema.
    """
    content = read_json(run / MANIFEST)
    checked(Manifest, content, run / MANIFEST)
    return content


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
