"""A YAML reader without traps: YAML 1.2 scalars, no repeated keys, no aliases.

PyYAML by itself reads `1e-3` as a string, `12:30` as 750, `NO` as false and lets a
repeated key win silently. Here `1e-3` is a number, `12:30` and `NO` are strings, and a
repeated key is an error. Every value keeps the line it was written on.
"""

import re
from dataclasses import dataclass, field
from functools import lru_cache
from math import inf, nan
from pathlib import Path
from typing import ClassVar

import yaml

from experiments.errors import ConfigError

KeyPath = tuple[str | int, ...]
Plain = None | bool | int | float | str | list["Plain"] | dict[str, "Plain"]

OPTION = "--"  # how the place of a value begins that was not in the file

MAX_SIZE = 1_000_000  # of a file; 1 MB takes seconds [bytes]

_TAG = "tag:yaml.org,2002:"
_KINDS = ("str", "bool", "int", "float", "null", "seq", "map")
_FLOAT = (
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
_CORE_SCHEMA = (  # kind, pattern, first characters; the first match wins
    ("bool", "true|True|TRUE|false|False|FALSE", "tTfF"),
    ("int", "[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", "-+0123456789"),
    ("float", _FLOAT, "-+.0123456789"),
    ("null", "~|null|Null|NULL|", ["~", "n", "N", ""]),
)


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data and where each key path was written: `FILE:LINE` or an option."""

    name: str
    data: Plain
    places: dict[KeyPath, str] = field(default_factory=dict)

    def where(self, path: KeyPath) -> str:
        """Return where a key path was written.

        An option that wrote something below it counts more than the file; where nothing
        wrote it, the nearest key above does.
        """
        below = [
            place
            for key, place in self.places.items()
            if key[: len(path)] == path and place.startswith(OPTION)
        ]
        if below and path:
            return below[-1]
        while path and path not in self.places:
            path = path[:-1]
        return self.places.get(path, self.name)

    def beside(self, path: KeyPath) -> str:
        """List the options that may conflict with the file at a key path.

        Returns:
            Words to put behind the place; none if an option wrote the value itself.
        """
        options = [p for p in self.places.values() if p.startswith(f"{OPTION}set ")]
        if not options or self.where(path).startswith(OPTION):
            return ""
        return f" with {', '.join(dict.fromkeys(options))}"


class _CoreLoader(yaml.SafeLoader):
    """Resolves plain scalars as YAML 1.2's core schema does."""

    yaml_implicit_resolvers: ClassVar = {}  # type: ignore[misc]  # the stubs say instance


for _kind, _pattern, _first in _CORE_SCHEMA:
    _CoreLoader.add_implicit_resolver(
        _TAG + _kind, re.compile(f"^(?:{_pattern})$"), list(_first)
    )


def read_document(path: Path) -> Document:
    """Read a YAML file.

    Args:
        path: The file.

    Returns:
        Its data, with line numbers.

    Raises:
        ConfigError: If the file cannot be read, is not plain YAML or larger than
            `MAX_SIZE`.
    """
    try:
        if path.is_fifo():  # nobody may ever write into it
            raise ConfigError(f"{path}: is a pipe; allowed: a file")
        with path.open("rb") as file:
            read = file.read(MAX_SIZE + 1)
        _require_small(len(read), str(path))
        text = read.decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not UTF-8 text"
        raise ConfigError(f"{path}: cannot be read: {reason}") from error
    return parse_document(text, str(path))


def parse_document(text: str, name: str) -> Document:
    """Parse YAML text; `name` stands in the messages. Raises ConfigError."""
    _require_small(len(text), name)
    try:
        root = _composed(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(
            error, "context_mark", None
        )
        problem = getattr(error, "problem", None) or "not readable as text"
        where = f"{name}:{mark.line + 1}" if mark else name
        raise ConfigError(f"{where}: is not YAML: {problem}") from error
    except RecursionError as error:
        raise ConfigError(f"{name}: is nested too deeply") from error
    if root is None:
        return Document(name, None)
    places: dict[KeyPath, str] = {}
    try:
        return Document(name, _Converter(name, places).convert(root, ()), places)
    except RecursionError as error:
        raise ConfigError(f"{name}: is nested too deeply") from error


@lru_cache(maxsize=64)
def _composed(text: str) -> yaml.Node | None:
    """Parse text into nodes, which are only read: sweeps read a file for each run."""
    root: yaml.Node | None = yaml.compose(text, _CoreLoader)
    return root


def _require_small(size: int, name: str) -> None:
    """Reject what would take many seconds to parse."""
    if size > MAX_SIZE:
        raise ConfigError(
            f"{name}: is too large; allowed: up to {MAX_SIZE // 10**6} MB"
        )


def parse_scalar(text: str) -> Plain:
    """Read one value as it would be read in a file: `true`, `3`, `[1, 2]`, `none`."""
    return parse_document(text, "value").data


class _Converter:
    """Turns a node graph into plain data."""

    def __init__(self, name: str, places: dict[KeyPath, str]) -> None:
        self.name = name
        self.places = places
        self.seen: set[int] = set()

    def convert(self, node: yaml.Node, path: KeyPath) -> Plain:
        """Convert one node and everything below it."""
        self.places.setdefault(path, self.place(node))
        if id(node) in self.seen:
            raise self.error(node, path, "is an alias (*name); write the value out")
        self.seen.add(id(node))
        if node.tag.removeprefix(_TAG) not in _KINDS:
            raise self.error(node, path, f"has an unknown type {node.tag}")
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            return [self.convert(n, (*path, i)) for i, n in enumerate(node.value)]
        return self.scalar(node, path)

    def mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Plain]:
        """Convert a mapping; its keys are strings and unique."""
        result: dict[str, Plain] = {}
        for key_node, value_node in node.value:
            if key_node.tag != _TAG + "str" or key_node.value == "<<":
                raise self.error(
                    key_node, path, f"has a key that is not a name: {key_node.value!r}"
                )
            key = key_node.value
            inner = (*path, key)
            if key in result:
                first = self.places[inner]
                raise self.error(key_node, inner, f"is given twice, first at {first}")
            self.places[inner] = self.place(key_node)
            result[key] = self.convert(value_node, inner)
        return result

    def scalar(self, node: yaml.Node, path: KeyPath) -> Plain:
        """Convert a scalar by its tag."""
        text = node.value
        kind = node.tag.removeprefix(_TAG)
        if kind == "str":
            return str(text)
        if kind == "bool":
            return bool(text.lower() == "true")
        if kind == "null":
            return None
        try:
            return _integer(text) if kind == "int" else _number(text)
        except ValueError:  # a tag forced onto another text: !!int abc
            raise self.error(node, path, f"is not a valid {kind}: {text!r}") from None

    def error(self, node: yaml.Node, path: KeyPath, problem: str) -> ConfigError:
        """Build the error about `node`."""
        key = dotted(path) or "the file"
        return ConfigError(f"{self.place(node)}: {key}: {problem}")

    def place(self, node: yaml.Node) -> str:
        """Return where `node` begins."""
        return f"{self.name}:{node.start_mark.line + 1}"


def dotted(path: KeyPath) -> str:
    """Write a key path as `a.b[0].c`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".")


def _integer(text: str) -> int:
    """Read a decimal, octal (0o) or hexadecimal (0x) integer."""
    prefix = text[:2]
    return int(text, {"0o": 8, "0x": 16}.get(prefix, 10))


def _number(text: str) -> float:
    """Read a YAML float."""
    lowered = text.lower()
    if lowered.endswith("inf"):
        return -inf if lowered.startswith("-") else inf
    return nan if lowered.endswith("nan") else float(text)
