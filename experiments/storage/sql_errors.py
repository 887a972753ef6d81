"""Mistakes in a user's SQL, in a user's words."""

import re
from collections.abc import Sequence
from difflib import get_close_matches

_UNKNOWN_COLUMN = re.compile(r'column (?:named )?"(.+?)"(?: not found|$)', re.MULTILINE)
_UNKNOWN_TABLE = re.compile(r"Table with name (\S+) does not exist")
_SYNTAX = re.compile(r'syntax error at or near "(.*)"')
_KIND = re.compile(r"^[A-Z][A-Za-z ]+ Error: ")
_MAX_NAMES = 400  # characters of a list of columns


def sql_mistake(message: str, columns: Sequence[str]) -> str:
    """Turn a message of DuckDB's into one line without its vocabulary.

    Args:
        message: Of DuckDB, several lines.
        columns: Of the table `runs`.
    """
    found = _UNKNOWN_COLUMN.search(message)
    if found is not None:
        return _unknown_column(found[1], columns)
    found = _UNKNOWN_TABLE.search(message)
    if found is not None:
        return f"there is no table {found[1].rstrip('!')}; allowed: runs"
    found = _SYNTAX.search(message)
    if found is not None:
        example = "scenario = 'curved' AND seed < 10"
        return f"is not SQL at {found[1]!r}; for example: {example}"
    line = (message.partition("Traceback")[0].splitlines() or [""])[0]
    return _KIND.sub("", line) or "is not understood"


def _unknown_column(name: str, columns: Sequence[str]) -> str:
    """Describe a column that is not there; a text in the wrong quotes is one too."""
    close = get_close_matches(name, columns, n=1)
    hint = f"did you mean {close[0]}? " if close else f"for a text write '{name}'; "
    names = ", ".join(columns)
    cut = names if len(names) <= _MAX_NAMES else f"{names[:_MAX_NAMES]} ..."
    return f"there is no column {name}; {hint}allowed: {cut}"
