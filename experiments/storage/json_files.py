"""JSON from files that may be damaged: every mistake is one line about file and key."""

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from experiments.errors import ResultsError

MAX_DEPTH = 50  # levels of nesting; our own files have five
SHOWN = 60  # characters of a wrong value in a message
_LARGEST = 2**63  # DuckDB's whole numbers are below

Model = TypeVar("Model", bound=BaseModel)


class FileSchema(BaseModel):
    """Base of the schemas of files: nothing is converted, unknown keys are kept."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        ResultsError: If the file is missing or is not a JSON object of finite numbers.
    """
    try:
        content = parse_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path}: cannot be read: {_reason(error)}") from error
    if not isinstance(content, dict):
        raise ResultsError(f"{path}: is damaged: not a JSON object")
    return content


def parse_json(text: str, *, finite: bool = True) -> Any:
    """Parse JSON; texts can be written as UTF-8.

    Args:
        text: JSON.
        finite: Whether NaN and infinite numbers are refused.

    Returns:
        Plain data.

    Raises:
        ValueError: Otherwise, and where it is nested too deeply.
    """
    try:
        number = _finite_number if finite else float
        content = json.loads(
            text, parse_constant=number, parse_float=number, parse_int=_whole_number
        )
    except RecursionError:
        raise _too_deep() from None
    if text.count("[") + text.count("{") > MAX_DEPTH:
        _check_depth(content)
    if "\\ud" in text.lower():  # half of a pair of surrogates is not a character
        json.dumps(content, ensure_ascii=False).encode()
    return content


def checked(schema: type[Model], content: Any, place: Path | str) -> Model:
    """Check parsed JSON against a schema.

    Args:
        schema: What is allowed.
        content: Parsed JSON.
        place: Named in the message.

    Returns:
        The schema's record.

    Raises:
        ResultsError: One line that names the place and the first wrong key.
    """
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        raise ResultsError(f"{place}: is damaged: {first_mistake(error)}") from error


def first_mistake(error: ValidationError) -> str:
    """Describe the first mistake as `key: what is wrong, is VALUE`."""
    first = error.errors(include_url=False)[0]
    key = dotted_key(first["loc"]) or "the file"
    if first["type"] == "missing":
        return f"{key} is missing"
    message = str(first["msg"])
    words = message[:1].lower() + message[1:]
    return f"{key}: {words}, is {short(first['input'])}"


def dotted_key(parts: Iterable[str | int]) -> str:
    """Format the place of a value: `lanes[3].width_m`."""
    text = ""
    for part in parts:
        text += f"[{part}]" if isinstance(part, int) else f".{short_text(part)}"
    return text.removeprefix(".")


def short(value: Any) -> str:
    """Show a value of JSON in one line, cut where it is long."""
    return short_text(json.dumps(value, default=str))


def short_text(text: str) -> str:
    """Cut a long text."""
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."


def _finite_number(text: str) -> float:
    """Read a number; NaN, Infinity and 1e999 are refused."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{short_text(text)} is not a finite number")
    return value


def _whole_number(text: str) -> int:
    """Read a whole number that fits 64 bits."""
    value = int(text)
    if not -_LARGEST < value < _LARGEST:
        raise ValueError(f"{short_text(text)} is too large a number")
    return value


def _check_depth(content: Any) -> None:
    """Raise if lists and objects are nested too deeply."""
    level = [content]
    for _ in range(MAX_DEPTH):
        level = [
            inner
            for outer in level
            if isinstance(outer, list | dict)
            for inner in (outer.values() if isinstance(outer, dict) else outer)
        ]
        if not level:
            return
    raise _too_deep()


def _too_deep() -> ValueError:
    """Build the error of a text that is nested too deeply."""
    return ValueError(f"is nested more than {MAX_DEPTH} levels deep")


def _reason(error: Exception) -> str:
    """Return the operating system's message, or that of the parser, cut."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    if isinstance(error, UnicodeEncodeError):
        return "holds half of a surrogate pair"
    if isinstance(error, UnicodeDecodeError):
        return "is not UTF-8"
    return short_text(str(error))
