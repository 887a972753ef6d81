"""Rows or arrays as a table of the trace."""

from collections.abc import Sequence
from typing import Any

from experiments.trace.schema import (
    MODEL_TABLES,
    TABLES,
    TIMING,
    Column,
    Table,
    column,
)

_KINDS = {**TABLES, **MODEL_TABLES, "timing": TIMING}


def from_rows(name: str, rows: Sequence[tuple[Any, ...]]) -> Table:
    """Return rows as the columns of a table; None is null."""
    kinds = _KINDS[name]
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(kinds)
    return {
        key: column(values, kind)
        for (key, kind), values in zip(kinds.items(), columns, strict=True)
    }


def from_arrays(name: str, *arrays: Column | Sequence[object]) -> Table:
    """Return a table of columns in the order of the schema."""
    return {
        key: column(values, kind)
        for (key, kind), values in zip(_KINDS[name].items(), arrays, strict=True)
    }
