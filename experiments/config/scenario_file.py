"""Reads scenarios: a file or a shipped name, options on top, one line per mistake."""

import hashlib
import json
import re
from collections.abc import Collection, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from experiments.config import Scenario, default_planner
from experiments.config.commonroad_scenario import (
    commonroad_document,
    complete,
    is_commonroad_file,
)
from experiments.config.ego import TUBE_WORDS
from experiments.config.egos import read_groups
from experiments.config.file_kinds import hint_at_search, hint_at_sweep
from experiments.config.network_scenario import (
    drop_usual_flows,
    is_network_file,
    network_document,
)
from experiments.config.planner_modules import require_allowed
from experiments.config.route_goal import complete_goal
from experiments.config.traffic import FILES
from experiments.config.validation_errors import describe, unknown_name
from experiments.config.yaml_reader import (
    OPTION,
    Document,
    KeyPath,
    Plain,
    dotted,
    parse_scalar,
    read_document,
)
from experiments.errors import ConfigError

SCENARIO_FOLDER = Path(__file__).parent.parent / "scenarios"
CONFIG_FILE = "config.yaml"  # the scenario in a run folder
SCHEMA_FILE = SCENARIO_FOLDER / "scenario.schema.json"

Change = tuple[KeyPath, Plain, str]  # key path, value, where it was written

# keys of which a bare name is short for a section, with the name's key there
SHORT_FORMS: Mapping[str | int, str] = {
    "planner": "name",
    "network": "name",
    "plant": "model",
    "actuators": "preset",
    "controller": "name",
    "plan_start": "rule",
    "perception": "preset",
}
_DENSITY: KeyPath = ("traffic", "density")
_FLOW: KeyPath = ("traffic", "own_veh_per_h")
# keys that replace one another: an option for one takes the file's other away
_REPLACES: Mapping[KeyPath, KeyPath] = {_DENSITY: _FLOW, _FLOW: _DENSITY}
_KEY_PART = re.compile(r"\.?([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]+)\]")


def scenario_names() -> list[str]:
    """List the shipped scenarios."""
    return sorted(path.stem for path in SCENARIO_FOLDER.glob("*.yaml"))


def find_scenario(name: str) -> Path:
    """Resolve a shipped name or a path to the path of the file.

    Raises:
        ConfigError: If there is neither a file nor a shipped scenario of that name.
    """
    path = Path(name)
    if name and path.is_dir() and name not in scenario_names():
        own = path / CONFIG_FILE
        hint = f"did you mean {own}?" if own.is_file() else "allowed: a .yaml file"
        raise ConfigError(f"{name}: is a folder; {hint}")
    if name.endswith((".yaml", ".yml")) or "/" in name:
        return path
    shipped = SCENARIO_FOLDER / f"{name}.yaml"
    if name not in scenario_names():
        other = hint_at_sweep(name) or hint_at_search(name)
        if other is not None:
            raise ConfigError(f"{name}: {other}")
        near = path.with_name(f"{name}.yaml") if name else path
        hint = unknown_name(name, scenario_names())
        hint = f"did you mean {near}?" if near.is_file() else f"{hint}, or a .yaml file"
        raise ConfigError(f"{name or repr(name)}: no such scenario; {hint}")
    return shipped


def load_scenario(
    name: str,
    *,
    planner: str | None = None,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    allow_planners: Collection[str] = (),
) -> Scenario:
    """Read a scenario and lay options over it.

    Args:
        name: Shipped name, or path of a YAML file.
        planner: Planner to take instead of the file's.
        seed: Seed to take instead of the file's.
        overrides: `key.path=value`, the value written as in YAML; laid over all else,
            the last one wins.
        allow_planners: Modules of planners that the file may name though they are not
            beside it.

    Returns:
        The checked scenario; a network file's path is absolute.

    Raises:
        ConfigError: One line that names the file, the key and what is allowed.
    """
    document = scenario_document(name)
    other = hint_at_search(name, document.data) or hint_at_sweep(name, document.data)
    if other is not None:
        raise ConfigError(f"{document.name}: {other}")
    if planner is not None:
        _choose_planner(document, planner)
    if seed is not None:
        _override(document, ("simulation", "seed"), seed, f"--seed {seed}")
    for override in overrides:
        _override(document, *_parse_override(override))
    _anchor_files(document)
    drop_usual_flows(document)
    complete(document)
    complete_goal(document)
    scenario = check_scenario(document)
    for key, choice in scenario.planner_choices():
        named = document.where(key)
        if choice.name != planner and not named.startswith(OPTION):
            folder = Path(document.name).parent
            require_allowed(choice.name, named, folder, allow_planners)
    return scenario


def scenario_document(name: str) -> Document:
    """Read a scenario, a shipped name or a file, without checking it yet.

    A network file stands for a scenario on a random route through it, a CommonRoad
    file for its own.
    """
    if is_network_file(name):
        return network_document(name)
    if is_commonroad_file(name):
        return commonroad_document(name)
    path = find_scenario(name)
    document = read_document(path)
    if not isinstance(document.data, dict):
        raise ConfigError(f"{path}: holds no keys; allowed: a scenario, see the schema")
    return document


def named_scenario(name: str, where: str) -> Document:
    """Read a scenario that another file names, as `scenario_document` does.

    Args:
        name: Shipped name, or path of a YAML file.
        where: Place and key that name it; messages begin with them.
    """
    try:
        return scenario_document(name)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from error


def changed(document: Document, changes: Sequence[Change]) -> Document:
    """Copy a scenario's document with other values in it.

    Args:
        document: What `scenario_document` gave; stays as it is.
        changes: Key path, value, and the words that messages name the place with;
            the path ("planner",) takes another planner and drops the settings of the
            one before.

    Returns:
        The changed copy.

    Raises:
        ConfigError: If a path leads nowhere.
    """
    copy = Document(document.name, deepcopy(document.data), dict(document.places))
    for path, value, option in changes:
        if path == ("planner",):
            _choose_planner(copy, str(value))
        else:
            _override(copy, path, deepcopy(value), option)
    _anchor_files(copy)
    drop_usual_flows(copy)
    complete(copy)
    complete_goal(copy)
    return copy


def check_scenario(document: Document) -> Scenario:
    """Check plain data against the schema; raises ConfigError."""
    try:
        scenario = Scenario.model_validate(tuples(document.data))
    except ValidationError as error:
        raise ConfigError(describe(error, document, scenario_schema())) from error
    return scenario.from_document(document)


def scenario_schema() -> dict[str, Any]:
    """Build the JSON Schema of a scenario file."""
    schema = Scenario.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def schema_text(schema: dict[str, Any] | None = None) -> str:
    """Write a JSON Schema, of scenarios if none, as the committed file holds it."""
    return json.dumps(schema or scenario_schema(), indent=2, ensure_ascii=False) + "\n"


def config_text(resolved: Mapping[str, Any]) -> str:
    """Write a resolved configuration as YAML, by libyaml where it is there."""
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: str = yaml.dump(
        dict(resolved), Dumper=dumper, sort_keys=False, allow_unicode=True
    )
    return text


def config_hash(resolved: dict[str, Any]) -> str:
    """Hash a resolved configuration; sha256, hexadecimal.

    Files of a network and of traffic count by their contents, which the caller hashes.
    """
    network = resolved.get("network")
    if isinstance(network, dict) and "file" in network:
        network = {**network, "file": Path(network["file"]).name}
        resolved = {**resolved, "network": network}
    traffic = resolved.get("traffic")
    if isinstance(traffic, dict):
        names = {key: _without_folder(traffic[key]) for key in FILES if key in traffic}
        resolved = {**resolved, "traffic": {**traffic, **names}}
    text = json.dumps(resolved, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _without_folder(value: Any) -> Any:
    """Take the folders off a path or a list of paths."""
    if isinstance(value, list):
        return [Path(item).name for item in value]
    return Path(value).name


def tuples(value: Any) -> Any:
    """Convert lists to the tuples of strict, frozen sections."""
    if isinstance(value, list):
        return tuple(tuples(item) for item in value)
    if isinstance(value, dict):
        return {key: tuples(item) for key, item in value.items()}
    return value


def parse_key(text: str) -> KeyPath | None:
    """Split `a.b[0]` into a key path; None if invalid."""
    path: list[str | int] = []
    position = 0
    while position < len(text):
        match = _KEY_PART.match(text, position)
        if match is None or (position == 0 and match[0].startswith(".")):
            return None
        path.append(match[1] or int(match[2]))
        position = match.end()
    return tuple(path) or None


def _parse_override(text: str) -> tuple[KeyPath, Plain, str]:
    """Split `a.b[0]=c` into key path, value and the words for messages."""
    key, equals, value = text.partition("=")
    option = f"--set {text}"
    path = parse_key(key)
    if not equals or path is None:
        raise ConfigError(f"{option}: is not understood; allowed: key.path=value")
    try:
        return path, parse_scalar(value), option
    except ConfigError as error:
        problem = str(error).removeprefix("value:1: ").removeprefix("the file: ")
        raise ConfigError(f"{option}: {problem}") from error


def _override(document: Document, path: KeyPath, value: Plain, option: str) -> None:
    """Set `value` at `path`, creating the sections on the way."""
    node: Any = document.data
    for depth, following in enumerate(path[1:]):
        _check_step(node, path[: depth + 1], option)
        node = _step_into(node, path[depth], following)
    _check_step(node, path, option)
    node[path[-1]] = value
    for known in [key for key in document.places if key[: len(path)] == path]:
        del document.places[known]
    document.places[path] = option
    other = _REPLACES.get(path) or _other_share(path)
    if other is not None and value is not None:
        _take_off(document, other)


def _other_share(path: KeyPath) -> KeyPath | None:
    """Return what says in another way how many egos a group has, if a path says it."""
    names = {"penetration": "count", "count": "penetration"}
    if path[0] != "egos" or len(path) not in (2, 3) or path[-1] not in names:
        return None
    return (*path[:-1], names[str(path[-1])])


def _take_off(document: Document, path: KeyPath) -> None:
    """Remove a key that the scenario's own file wrote; what an option wrote stays."""
    place = document.where(path)
    if place != document.name and not place.startswith(f"{document.name}:"):
        return
    node: Any = document.data
    for part in path[:-1]:
        node = node[part]
    node.pop(path[-1], None)
    document.places.pop(path, None)


def _check_step(node: Any, path: KeyPath, option: str) -> None:
    """Reject a path whose last part is no key or index of what is there."""
    holder, part = dotted(path[:-1]) or "the file", path[-1]
    if isinstance(node, list):
        if isinstance(part, int) and part < len(node):
            return
        places = [f"{holder}[{k}]" for k in sorted({0, len(node) - 1}) if k >= 0]
        allowed = " to ".join(places) or "a list of its own"
        raise ConfigError(
            f"{option}: {dotted(path)}: {holder} is a list of {len(node)}; "
            f"allowed: {allowed}"
        )
    if not isinstance(node, dict):
        raise ConfigError(
            f"{option}: {dotted(path)}: {holder} is no section; allowed: {holder}=VALUE"
        )
    if not isinstance(part, str):
        raise ConfigError(
            f"{option}: {dotted(path)}: {holder} is no list; allowed: {holder}.KEY"
        )


def _step_into(node: Any, part: str | int, following: str | int) -> Any:
    """Go one key down; a short form (`planner: cruise`) becomes its section."""
    if isinstance(node, list):
        return node[int(part)]
    inner = node.get(part)
    if part == "planner" and inner is None:
        inner = default_planner(node)
    if part in SHORT_FORMS and isinstance(inner, str):
        inner = {SHORT_FORMS[part]: inner}
    if inner is None or isinstance(inner, str | bool | int | float):
        inner = [] if isinstance(following, int) else {}
    node[part] = inner
    return inner


def _choose_planner(document: Document, name: str) -> None:
    """Replace the planner; settings of the file apply only to their own planner.

    Raises:
        ConfigError: If it would drive nobody: all groups of egos name their own.
    """
    data: Any = document.data if isinstance(document.data, dict) else {}
    groups = read_groups(data.get("egos")) or ()
    if (
        isinstance(groups, (list, tuple))
        and groups
        and all(isinstance(group, dict) and group.get("planner") for group in groups)
    ):
        raise ConfigError(
            f"{document.where(('egos',))}: egos name their own planners, so that "
            f"--planner {name} drives nobody; allowed: without it, or egos without "
            "planner"
        )
    current = data.get("planner")
    if isinstance(current, dict) and current.get("name") == name:
        return
    _override(document, ("planner",), {"name": name}, f"--planner {name}")


def _anchor_files(document: Document) -> None:
    """Resolve paths of network, traffic and tube, relative to the scenario file."""
    folder = Path(document.name).parent
    network = document.data.get("network") if isinstance(document.data, dict) else None
    if isinstance(network, dict):
        file = network.get("file")
        if isinstance(file, str):
            network["file"] = str((folder / file).resolve())
    traffic = document.data.get("traffic") if isinstance(document.data, dict) else None
    if isinstance(traffic, dict):
        for key in FILES:
            value = traffic.get(key)
            if isinstance(value, str):
                traffic[key] = str((folder / value).resolve())
            elif isinstance(value, list):
                traffic[key] = [
                    str((folder / x).resolve()) if isinstance(x, str) else x
                    for x in value
                ]
    ego = document.data.get("ego") if isinstance(document.data, dict) else None
    tube = ego.get("tube") if isinstance(ego, dict) else None
    if isinstance(ego, dict) and isinstance(tube, str) and tube not in TUBE_WORDS:
        by_option = document.where(("ego", "tube")).startswith(OPTION)
        ego["tube"] = str(((Path() if by_option else folder) / tube).resolve())
