"""Reads sweep files: a file or a shipped name."""

import sys
from collections.abc import Collection, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from experiments.config.file_kinds import hint_at_scenario, hint_at_search
from experiments.config.planner_modules import require_allowed
from experiments.config.scenario_file import tuples
from experiments.config.shipped_files import anchored, find_file, shipped_names
from experiments.config.sweep import Sweep
from experiments.config.validation_errors import describe
from experiments.config.yaml_reader import Document, read_document
from experiments.errors import ConfigError

SWEEP_FOLDER = Path(__file__).parent.parent / "sweeps"
SCHEMA_FILE = SWEEP_FOLDER / "sweep.schema.json"


def sweep_names() -> list[str]:
    """List the shipped sweeps."""
    return shipped_names(SWEEP_FOLDER)


def find_sweep(name: str) -> Path:
    """Resolve a shipped name or a path to the path of the file.

    Raises:
        ConfigError: If there is neither a file nor a shipped sweep of that name.
    """
    other = hint_at_scenario(name) or hint_at_search(name)
    return find_file(name, SWEEP_FOLDER, "sweep", other)


def load_sweep(
    name: str, allow_planners: Collection[str] = ()
) -> tuple[Sweep, Document]:
    """Read and check a sweep.

    Args:
        name: Shipped name, or path of a YAML file.
        allow_planners: Modules of planners that the file may name though they are not
            beside it.

    Returns:
        The sweep, its scenario files absolute, and the document for messages.

    Raises:
        ConfigError: One line that names the file, the key and what is allowed.
    """
    path = find_sweep(name)
    document = read_document(path)
    if not isinstance(document.data, dict):
        raise ConfigError(f"{path}: holds no keys; allowed: a sweep")
    other = hint_at_search(name, document.data) or hint_at_scenario(name, document.data)
    if other is not None:
        raise ConfigError(f"{path}: {other}")
    sweep = _checked(document, path.parent)
    for index, planner in enumerate(sweep.planners):
        where = document.where(("planners", index))
        require_allowed(planner.name, where, path.parent, allow_planners)
    return sweep, document


def sweep_of(content: Mapping[str, Any]) -> tuple[Sweep, Document]:
    """Check a sweep that a program has made; see `load_sweep`.

    Args:
        content: As a sweep file holds it. Scenario files are relative to the working
            folder, and any planner is allowed: the program could run its code itself.
    """
    document = Document("sweep", deepcopy(dict(content)))
    return _checked(document, Path()), document


def _checked(document: Document, folder: Path) -> Sweep:
    """Check the keys of a sweep; raises ConfigError."""
    assert isinstance(document.data, dict)  # noqa: S101 - of both callers
    _anchor_scenarios(document.data, folder)
    try:
        return Sweep.model_validate(tuples(document.data))
    except ValidationError as error:
        raise ConfigError(describe(error, document, sweep_schema())) from error


def planner_folders(sweep: Sweep, document: Document) -> tuple[str, ...]:
    """Return the folders that workers have to search for a sweep's planners."""
    folder = str(Path(document.name).parent.absolute())
    own = any(":" in planner.name for planner in sweep.planners)
    return (folder,) if own and folder in sys.path else ()


def sweep_schema() -> dict[str, Any]:
    """Build the JSON Schema of a sweep file."""
    schema = Sweep.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _anchor_scenarios(data: dict[str, Any], folder: Path) -> None:
    """Resolve the paths of scenario files, which are relative to the sweep file."""
    scenarios = data.get("scenarios")
    if not isinstance(scenarios, list):
        return
    data["scenarios"] = [anchored(name, folder) for name in scenarios]
