"""Reads XML that may be anyone's: bounded, without entities, with lines for messages.

A document type definition is refused: entities that expand without end, or name files,
need one. Depth, size and number of elements are bounded.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from xml.parsers import expat

from experiments.errors import ConfigError, in_one_line

MOST_BYTES: Final = 500_000_000
MOST_ELEMENTS: Final = 20_000_000
DEEPEST: Final = 60
LARGEST: Final = 1e8  # coordinates of UTM reach 1e7 [m]
SHOWN: Final = 40  # characters of a value in a message


class Node:
    """An element of a file: what it holds, and where it was written."""

    __slots__ = ("attributes", "children", "file", "line", "tag", "text")

    def __init__(
        self, file: Path, tag: str, attributes: dict[str, str], line: int
    ) -> None:
        self.file = file
        self.tag = tag
        self.attributes = attributes
        self.line = line
        self.text = ""
        self.children: list[Node] = []

    def error(self, problem: str) -> ConfigError:
        """Build the error about this element."""
        name = self.attributes.get("id")
        shown = self.tag if name is None else f"{self.tag} {short(name)}"
        return ConfigError(f"{self.file}:{self.line}: {shown}: {problem}")

    def child(self, tag: str) -> "Node | None":
        """Return the first child of a name, None without one."""
        return next((node for node in self.children if node.tag == tag), None)

    def all(self, *tags: str) -> Iterator["Node"]:
        """Yield the children of these names."""
        return (node for node in self.children if node.tag in tags)

    def need(self, tag: str) -> "Node":
        """Return the first child of a name; raise a ConfigError without one."""
        found = self.child(tag)
        if found is None:
            raise self.error(f"has no {tag}")
        return found

    def number(self) -> float:
        """Return the text as a finite number."""
        try:
            value = float(self.text)
        except ValueError:
            value = math.nan
        if not abs(value) <= LARGEST:
            raise self.error(f"is {short(self.text)}; allowed: a number")
        return value

    def positive(self) -> float:
        """Return the text as a number above 0."""
        value = self.number()
        if value <= 0.0:
            raise self.error(f"is {value:g}; allowed: more than 0")
        return value

    def whole(self) -> int:
        """Return the text as a whole number; 3.0 is one."""
        value = self.number()
        if value != round(value):
            raise self.error(f"is {value:g}; allowed: a whole number")
        return round(value)

    def key(self, name: str = "id") -> int:
        """Return an attribute that names an object."""
        text = self.attributes.get(name)
        if text is None:
            raise self.error(f"has no {name}")
        try:
            return int(text)
        except ValueError:
            problem = f"{name} is {short(text)}; allowed: a whole number"
            raise self.error(problem) from None

    def refs(self, tag: str) -> tuple[int, ...]:
        """Return what the children of a name refer to."""
        return tuple(node.key("ref") for node in self.all(tag))


def short(text: str) -> str:
    """Quote a value, cut to what a message holds."""
    line = in_one_line(text)
    return repr(line if len(line) <= SHOWN else f"{line[:SHOWN]}...")


class _Builder:
    """Collects the elements as expat reports them."""

    def __init__(self, file: Path, parser: expat.XMLParserType) -> None:
        self._file = file
        self._parser = parser
        self._open: list[Node] = []
        self._text: list[str] = []
        self._count = 0
        self.root: Node | None = None

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Open an element."""
        line = self._parser.CurrentLineNumber
        self._count += 1
        if len(self._open) >= DEEPEST or self._count > MOST_ELEMENTS:
            raise ConfigError(
                f"{self._file}:{line}: allowed: at most {DEEPEST} elements inside "
                f"each other, {MOST_ELEMENTS} in all"
            )
        node = Node(self._file, tag, attributes, line)
        if self._open:
            self._open[-1].children.append(node)
        else:
            self.root = node
        self._open.append(node)
        self._text.clear()

    def end(self, _tag: str) -> None:
        """Close an element; text counts where it has no children."""
        node = self._open.pop()
        if not node.children:
            node.text = "".join(self._text).strip()
        self._text.clear()

    def data(self, text: str) -> None:
        """Add text."""
        self._text.append(text)

    def doctype(self, *_: object) -> None:
        """Refuse a document type."""
        line = self._parser.CurrentLineNumber
        problem = "has a document type (DOCTYPE); allowed: a file without one"
        raise ConfigError(f"{self._file}:{line}: {problem}")


def read_xml(file: Path) -> Node:
    """Read a file.

    Returns:
        Its root element.

    Raises:
        ConfigError: If it cannot be read, is too large or is no XML.
    """
    try:
        size = file.stat().st_size
        if size > MOST_BYTES:
            allowed = f"allowed: at most {MOST_BYTES // 1_000_000} MB"
            raise ConfigError(f"{file}: has {size // 1_000_000} MB; {allowed}")
        content = file.read_bytes()
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read: {error.strerror}") from error
    parser = expat.ParserCreate()
    builder = _Builder(file, parser)
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = builder.doctype
    parser.buffer_text = True
    try:
        parser.Parse(content, True)  # noqa: FBT003 - expat's own
    except expat.ExpatError as error:
        words = expat.ErrorString(error.code)
        raise ConfigError(f"{file}:{error.lineno}: is no XML: {words}") from error
    except (LookupError, ValueError) as error:  # an encoding that is none
        raise ConfigError(f"{file}: is no XML: {in_one_line(str(error))}") from error
    assert builder.root is not None  # noqa: S101 - expat reports files without one
    return builder.root
