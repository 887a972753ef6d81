"""Tables as data frames of pandas or polars, neither of which has to be there."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from experiments.errors import ConfigError
from experiments.trace.schema import Column, Table

if TYPE_CHECKING:
    import pandas as pd

Library = Literal["pandas", "polars"]
LIBRARIES = ("pandas", "polars")


@overload
def frame(table: Table, library: Literal["pandas"] = "pandas") -> "pd.DataFrame": ...


@overload
def frame(table: Table, library: str) -> Any: ...


def frame(table: Table, library: str = "pandas") -> Any:
    """Make a data frame of a table.

    Args:
        table: Column to values, (n_rows,) each; masked values are missing ones.
        library: `pandas` or `polars`.

    Returns:
        The data frame. Missing values are null in polars; in pandas NaN among numbers,
        `<NA>` among whole numbers (`Int64`), None among texts.

    Raises:
        ConfigError: If the library is not there, or is not one of the two.
    """
    if library not in LIBRARIES:
        allowed = ", ".join(LIBRARIES)
        raise ConfigError(f"frames: {library!r}: no such library; allowed: {allowed}")
    try:
        return _polars(table) if library == "polars" else _pandas(table)
    except ImportError as error:
        install = f"install it: pip install {library}"
        raise ConfigError(f"frames: needs {library} ({error}); {install}") from error


def table_of(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Make a table of dictionaries that have the same keys; None is missing."""
    names = list(rows[0]) if rows else []
    return {name: _column([row[name] for row in rows]) for name in names}


def _column(values: Sequence[Any]) -> Column:
    """Make a column in the type of its values."""
    missing = np.array([value is None for value in values])
    known = [value for value in values if value is not None]
    kinds = {type(value) for value in known}
    dtype: Any = object
    if kinds == {bool}:
        dtype = np.bool_
    elif kinds == {int}:
        dtype = np.int64
    elif kinds and kinds <= {int, float}:
        dtype = np.float64
    filler: Any = "" if dtype is object else 0
    array = np.empty(len(values), dtype=dtype)
    array[:] = [filler if value is None else value for value in values]
    return np.ma.masked_array(array, missing) if missing.any() else array


def _pandas(table: Table) -> "pd.DataFrame":
    """Make a DataFrame of pandas."""
    import pandas as pd

    series: dict[str, Any] = {}
    for name, values in table.items():
        data, mask = np.ma.getdata(values), np.ma.getmaskarray(values)
        if not mask.any():
            series[name] = data
        elif data.dtype == np.float64:
            series[name] = np.where(mask, np.nan, data)
        elif data.dtype == np.int64:
            series[name] = pd.arrays.IntegerArray(data.copy(), mask.copy())
        elif data.dtype == np.bool_:
            series[name] = pd.arrays.BooleanArray(data.copy(), mask.copy())
        else:
            texts = data.copy()
            texts[mask] = None
            series[name] = texts
    return pd.DataFrame(series)


def _polars(table: Table) -> Any:
    """Make a DataFrame of polars, without pyarrow."""
    import polars as pl

    series = []
    for name, values in table.items():
        data, mask = np.ma.getdata(values), np.ma.getmaskarray(values)
        text = data.dtype == object
        items = [
            None if gone else value
            for value, gone in zip(data.tolist(), mask.tolist(), strict=True)
        ]
        series.append(pl.Series(name, items, dtype=pl.String if text else None))
    return pl.DataFrame(series)
