"""Traces as Parquet: one file a table, `trace.parquet` for the steps.

duckdb takes columns straight from NumPy, masked ones as null. One thread and no time
stamps: the same trace gives the same bytes.
"""

import os
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import duckdb
import numpy as np

from experiments.errors import ResultsError
from experiments.trace.schema import (
    SCHEMA_VERSION,
    TABLES,
    TIMING,
    Column,
    Kind,
    Table,
    Trace,
    column,
)

_SQL_TYPES = {Kind.NUMBER: "DOUBLE", Kind.COUNT: "BIGINT", Kind.TEXT: "VARCHAR"}
_VERSION_KEY = "rearview_schema"


def file_name(table: str) -> str:
    """Return the file name of a table."""
    return "trace.parquet" if table == "steps" else f"{table}.parquet"


def write_trace(trace: Trace, folder: Path) -> None:
    """Write all tables of a trace into an existing folder.

    Raises:
        ResultsError: If a file cannot be written, for example on a full disk.
    """
    write_tables(
        (getattr(trace, name), kinds, folder / file_name(name))
        for name, kinds in {**TABLES, "timing": TIMING}.items()
    )


def write_tables(tables: Iterable[tuple[Table, Mapping[str, Kind], Path]]) -> None:
    """Write tables, each with its kinds to its file.

    Raises:
        ResultsError: If a file cannot be written.
    """
    database = _database(os.getpid())
    for table, kinds, path in tables:
        try:
            _write(database, table, kinds, path)
        except duckdb.Error as error:
            problem = f"{path}: cannot be written: {_short(error)}"
            raise ResultsError(problem) from error


def read_trace(folder: Path) -> Trace:
    """Read a trace that `write_trace` wrote.

    Raises:
        ResultsError: If a file is missing, damaged or of another schema version.
    """
    database = _database(os.getpid())
    tables = {
        name: _read_or_refuse(database, kinds, folder / file_name(name))
        for name, kinds in {**TABLES, "timing": TIMING}.items()
    }
    return Trace(**tables)


def read_table(kinds: Mapping[str, Kind], path: Path) -> Table:
    """Read one table that `write_tables` wrote.

    Raises:
        ResultsError: If the file is missing, damaged or of another schema version.
    """
    return _read_or_refuse(_database(os.getpid()), kinds, path)


@cache
def _database(_process: int) -> duckdb.DuckDBPyConnection:
    """Open this process's database, in memory: opening takes as long as a table."""
    return duckdb.connect(config={"threads": 1})


def _read_or_refuse(
    database: duckdb.DuckDBPyConnection, kinds: Mapping[str, Kind], path: Path
) -> Table:
    """Read one table; raise a one-line error if that fails."""
    try:
        return _read(database, kinds, path)
    except duckdb.Error as error:
        raise ResultsError(f"{path}: cannot be read: {_short(error)}") from error


def _write(
    database: duckdb.DuckDBPyConnection,
    table: Table,
    kinds: Mapping[str, Kind],
    path: Path,
) -> None:
    """Write one table."""
    database.register("source", dict(table))
    columns = ", ".join(
        f'CAST("{key}" AS {_SQL_TYPES[kind]}) AS "{key}"' for key, kind in kinds.items()
    )
    database.execute(
        f"COPY (SELECT {columns} FROM source) TO '{_quoted(path)}' (FORMAT parquet, "
        f"COMPRESSION zstd, KV_METADATA {{{_VERSION_KEY}: '{SCHEMA_VERSION}'}})"
    )
    database.unregister("source")


def _read(
    database: duckdb.DuckDBPyConnection, kinds: Mapping[str, Kind], path: Path
) -> Table:
    """Read one table after checking its schema version."""
    source = _quoted(path)
    found = database.execute(
        f"SELECT value FROM parquet_kv_metadata('{source}') "
        f"WHERE key = '{_VERSION_KEY}'::BLOB"
    ).fetchone()
    version = bytes(found[0]).decode() if found else "none"
    if version != str(SCHEMA_VERSION):
        raise ResultsError(
            f"{path}: has trace schema version {version}; allowed: {SCHEMA_VERSION}"
        )
    names = ", ".join(f'"{key}"' for key in kinds)
    columns = database.execute(f"SELECT {names} FROM '{source}'").fetchnumpy()
    return {key: _restored(columns[key], kind) for key, kind in kinds.items()}


def _restored(values: Column, kind: Kind) -> Column:
    """Return a column in the form it was written from."""
    if not np.ma.getmaskarray(values).any():
        plain = np.ma.getdata(values)
        return column(plain, kind) if kind is Kind.NUMBER else plain  # NaN is nothing
    if kind is Kind.TEXT:
        return column(values.tolist(), kind)
    return values


def _quoted(path: Path) -> str:
    """Return a path quoted for an SQL string."""
    return str(path).replace("'", "''")


def _short(error: Exception) -> str:
    """Return the operating system's message if there is one, else the first line."""
    text = str(error)
    number = re.search(r"errno\W+([0-9]+)", text)
    return os.strerror(int(number[1])) if number else text.splitlines()[0]
