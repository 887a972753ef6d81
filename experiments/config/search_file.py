"""Reads search files."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from experiments.config.file_kinds import hint_at_scenario, hint_at_sweep
from experiments.config.planner_modules import require_allowed
from experiments.config.scenario_file import tuples
from experiments.config.search import Search
from experiments.config.validation_errors import describe
from experiments.config.yaml_reader import Document, read_document
from experiments.errors import ConfigError

SEARCH_FOLDER = Path(__file__).parent.parent / "searches"
SEARCH_SCHEMA_FILE = SEARCH_FOLDER / "search.schema.json"


def search_names() -> list[str]:
    """List the shipped searches."""
    return sorted(path.stem for path in SEARCH_FOLDER.glob("*.yaml"))


def load_search(
    name: str, allow_planners: Collection[str] = ()
) -> tuple[Search, Document]:
    """Read and check a search.

    Args:
        name: Shipped name, or path of a YAML file.
        allow_planners: Modules of planners that the file may name though they are not
            beside it.

    Returns:
        The search, its scenario file absolute, and the document for messages.

    Raises:
        ConfigError: One line that names the file, the key and what is allowed.
    """
    path = _find(name)
    document = read_document(path)
    data = document.data
    if not isinstance(data, dict):
        raise ConfigError(f"{path}: holds no keys; allowed: a search")
    if "space" not in data:
        other = hint_at_scenario(name, data) or hint_at_sweep(name, data)
        if other is not None:
            raise ConfigError(f"{path}: {other}")
    scenario = data.get("scenario")
    if isinstance(scenario, str) and (
        scenario.endswith((".yaml", ".yml", ".xml")) or "/" in scenario
    ):
        data["scenario"] = str((path.parent / scenario).resolve())
    try:
        search = Search.model_validate(tuples(data))
    except ValidationError as error:
        raise ConfigError(describe(error, document, search_schema())) from error
    where = document.where(("planner",))
    require_allowed(search.planner.name, where, path.parent, allow_planners)
    return search, document


def searched_against(search: Search, against: str) -> Search:
    """Return a search that is compared with another method; raises ConfigError."""
    if against != "random" or search.method == against:
        problem = f"--against {against}: the method is {search.method}"
        raise ConfigError(f"{problem}; allowed: random, with another method")
    return search.model_copy(update={"against": against})


def search_schema() -> dict[str, Any]:
    """Build the JSON Schema of a search file."""
    schema = Search.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _find(name: str) -> Path:
    """Resolve a shipped name or a path to the path of the file."""
    path = Path(name)
    if name and path.is_dir() and name not in search_names():
        raise ConfigError(f"{name}: is a folder; allowed: a search file")
    if name.endswith((".yaml", ".yml")) or "/" in name:
        return path
    if name not in search_names():
        other = hint_at_scenario(name) or hint_at_sweep(name)
        listed = ", ".join(search_names())
        words = other or f"no such search; allowed: {listed}, or a .yaml file"
        raise ConfigError(f"{name or repr(name)}: {words}")
    return SEARCH_FOLDER / f"{name}.yaml"
