"""One readable line about a configuration that does not fit its schema."""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError

from experiments.config.yaml_reader import Document, KeyPath, dotted

Schema = Mapping[str, Any]

# A list whose items were refused is reported as too short as well.
LONGEST_SHOWN = 60  # characters of a text that is wrong
_CONSEQUENCES = ("too_short", "default_factory_not_called")

_TYPES = {
    "string": "text",
    "integer": "a whole number",
    "number": "a number",
    "boolean": "true or false",
    "array": "a list",
    "object": "a section with keys",
    "null": "nothing",
}
_BOUNDS = {
    "minimum": ">=",
    "exclusiveMinimum": ">",
    "maximum": "<=",
    "exclusiveMaximum": "<",
}


def describe(error: ValidationError, document: Document, schema: Schema) -> str:
    """Format the first mistake as `FILE:LINE: key.path: what; allowed: ...`.

    Args:
        error: What pydantic found.
        document: The data that was checked, with its places.
        schema: JSON Schema of the same classes; it knows what is allowed.

    Returns:
        One line; it counts further mistakes at other keys.
    """
    found: dict[KeyPath, tuple[str, str]] = {}  # problem, and options beside it
    items = error.errors(include_url=False)
    causes = [item for item in items if item["type"] not in _CONSEQUENCES] or items
    for item in causes:
        path = _written_path(item, document.data)
        clash = document.beside(path) if item["type"] == "inconsistent" else ""
        found.setdefault(path, (_problem(item, path, document, schema), clash))
    path, (problem, clash) = next(iter(found.items()))
    others = len(found) - 1
    mistakes = "mistake" if others == 1 else "mistakes"
    more = f" ({others} more {mistakes} in the file)" if others else ""
    key = dotted(path) or "the file"
    return f"{document.where(path)}{clash}: {key}: {problem}{more}"


def unknown_name(name: str, allowed: list[str]) -> str:
    """Suggest the closest name, and list the allowed ones."""
    close = get_close_matches(name, allowed, n=1)
    hint = f"did you mean {close[0]}? " if close else ""
    return f"{hint}allowed: {', '.join(allowed)}"


def _written_path(item: Mapping[str, Any], data: Any) -> KeyPath:
    """Map an error's location to the keys that stand in the file.

    pydantic adds names of union members and of sections that a short form stands for.
    """
    loc = list(item["loc"])
    if item["type"] == "inconsistent":
        return _inconsistent_path(item, loc, data)
    path: list[str | int] = []
    for index, part in enumerate(loc):
        inside = range(len(data)) if isinstance(data, list) else data
        if isinstance(data, list | dict) and part in inside:
            data = data[part]
        elif index < len(loc) - 1 or not _is_missing_key(item):
            continue
        path.append(part)
    return tuple(path)


def _is_missing_key(item: Mapping[str, Any]) -> bool:
    """Check for a missing key, as opposed to a list that is too short."""
    return item["type"] == "missing" and isinstance(item["loc"][-1], str)


def _inconsistent_path(
    item: Mapping[str, Any], loc: list[str | int], data: Any
) -> KeyPath:
    """Append the key named by a section's own check to the path of the section."""
    section = _written_path({"type": "", "loc": loc}, data)
    key = item["ctx"]["key"]
    parts = [part for part in key.replace("[", ".[").split(".") if part]
    return (*section, *(int(p[1:-1]) if p[0] == "[" else p for p in parts))


def _problem(
    item: Mapping[str, Any], path: KeyPath, document: Document, schema: Schema
) -> str:
    """Describe the problem at `path`."""
    kind = item["type"]
    if kind == "inconsistent":
        return str(item["ctx"]["problem"])
    if kind == "extra_forbidden":
        section = _value_at(document.data, path[:-1])
        return _foreign_key(
            str(path[-1]), section, _branches(schema, path[:-1], schema)
        )
    if item["loc"][-1] == "[key]":
        keys = _names(_branches(schema, path[:-1], schema))
        return f"unknown key; {unknown_name(str(path[-1]), keys)}"
    allowed = _allowed(_branches(schema, path, schema))
    if _is_missing_key(item):
        return f"is missing; allowed: {allowed}"
    value = _value_at(document.data, path)
    return f"is {_shown(value)}; allowed: {allowed}"


def _foreign_key(name: str, section: Any, kinds: list[Schema]) -> str:
    """Describe a key that its section cannot have.

    Args:
        name: The key.
        section: As it is written.
        kinds: What such a section may be; another one than this may have the key.
    """
    without = _keys([kind for kind in kinds if name not in kind.get("properties", {})])
    having = _keys([kind for kind in kinds if name in kind.get("properties", {})])
    written = section if isinstance(section, dict) else ()
    beside = [key for key in written if key in without and key not in having]
    if having and beside:
        return f"does not go with {beside[0]}; allowed: {', '.join(without)}"
    return f"unknown key; {unknown_name(name, without or having)}"


def _value_at(data: Any, path: KeyPath) -> Any:
    """Look a value up."""
    for part in path:
        data = data[part]
    return data


def _shown(value: Any) -> str:
    """Show a value so that its type can be told."""
    if isinstance(value, dict):
        return "a section with keys" if value else "a section without keys"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, str):
        return f"{value}"
    shown = value if len(value) <= LONGEST_SHOWN else f"{value[:LONGEST_SHOWN]}..."
    return f"the text '{shown}'"


def _branches(node: Schema, path: KeyPath, root: Schema) -> list[Schema]:
    """Return every alternative that the schema allows at `path`."""
    nodes = _expand(node, root)
    for part in path:
        nodes = [
            inner
            for outer in nodes
            for child in _children(outer, part)
            for inner in _expand(child, root)
        ]
    return nodes


def _expand(node: Schema, root: Schema) -> list[Schema]:
    """Resolve references and alternatives."""
    if "$ref" in node:
        name = node["$ref"].rsplit("/", 1)[1]
        return _expand(root["$defs"][name], root)
    for key in ("anyOf", "oneOf", "allOf"):
        if key in node:
            return [leaf for option in node[key] for leaf in _expand(option, root)]
    return [node]


def _children(node: Schema, part: str | int) -> list[Schema]:
    """Return the schemas of one key or one item."""
    if isinstance(part, str):
        named = node.get("properties", {})
        child = named.get(part, node.get("additionalProperties"))
    else:
        fixed = node.get("prefixItems", [])
        child = fixed[part] if part < len(fixed) else node.get("items")
    return [child] if isinstance(child, dict) else []


def _keys(nodes: list[Schema]) -> list[str]:
    """List all keys of all alternatives."""
    return [key for node in nodes for key in node.get("properties", {})]


def _names(nodes: list[Schema]) -> list[str]:
    """List the names that all alternatives allow as keys of their values."""
    return [name for node in nodes for name in _names_of(node)]


def _names_of(node: Schema) -> list[str]:
    """List the names that sections of one schema may have as keys."""
    return list(node.get("propertyNames", {}).get("enum", ()))


def _allowed(nodes: list[Schema]) -> str:
    """Describe what the alternatives allow."""
    texts = [_words(node) for node in nodes if node.get("type") != "null"]
    return " or ".join(dict.fromkeys(texts)) or "nothing"


def _words(node: Schema) -> str:
    """Describe what one schema allows."""
    if "const" in node:
        return str(node["const"])
    if "enum" in node:
        return ", ".join(str(value) for value in node["enum"])
    kind = _TYPES.get(node.get("type", ""), "anything")
    if node.get("type") == "array" and "prefixItems" in node:
        items = ", ".join(_words(item) for item in node["prefixItems"])
        return f"[{items}]"
    if node.get("type") == "object" and "properties" in node:
        return f"a section with {', '.join(node['properties'])}"
    if names := _names_of(node):
        each = _words(node["additionalProperties"])
        kind = f"a section with {', '.join(names)}, each {each}"
    least = node.get("minItems") or node.get("minProperties")
    if least:
        kind = f"{kind}, at least {least}"
    bounds = [
        f"{sign} {node[key]:.10g}" for key, sign in _BOUNDS.items() if key in node
    ]
    pattern = [f"of the form {node['pattern']}"] if "pattern" in node else []
    most = node.get("maxLength")
    length = [] if most is None else [f"of at most {most} characters"]
    return (
        " ".join([kind, " and ".join(bounds), *pattern, *length])
        .strip()
        .replace("  ", " ")
    )
