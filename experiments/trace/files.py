"""Traces as Parquet: one file a table, `trace.parquet` for the steps.

duckdb takes columns straight from NumPy, masked ones as null. One thread and no time
stamps: the same trace gives the same bytes.
"""

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.errors import ResultsError
from experiments.storage import parquet_database
from experiments.storage.parquet_source import (
    literal_path,
    parquet_source,
    quoted_name,
    quoted_text,
)
from experiments.trace.content_check import check_table, check_trace
from experiments.trace.schema import (
    MODEL_TABLES,
    SCHEMA_VERSION,
    TABLES,
    TIMING,
    Column,
    Kind,
    Table,
    Trace,
    column,
)

if TYPE_CHECKING:
    import duckdb  # takes 0.1 s to import, which an episode needs at its end only

_SQL_TYPES = {Kind.NUMBER: "DOUBLE", Kind.COUNT: "BIGINT", Kind.TEXT: "VARCHAR"}
_VERSION_KEY = "rearview_schema"
# What reading a damaged file raises beside DuckDB's own errors: texts that are not
# UTF-8, numbers beyond the type of their column.
_DAMAGE = (ValueError, OverflowError, RuntimeError, MemoryError)


MANY_EGOS = "fleet.parquet"  # instead of a trace, where there are many egos


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
        for name, kinds in {
            **TABLES,
            "timing": TIMING,
            **trace.model_tables(),
        }.items()
    )


def write_tables(tables: Iterable[tuple[Table, Mapping[str, Kind], Path]]) -> None:
    """Write tables, each with its kinds to its file.

    Raises:
        ResultsError: If a file cannot be written.
    """
    import duckdb

    with parquet_database.writing() as database:
        for table, kinds, path in tables:
            try:
                _write(database, table, kinds, path)
            except duckdb.Error as error:
                problem = f"{path}: cannot be written: {_short(error)}"
                raise ResultsError(problem) from error


def read_trace(folder: Path) -> Trace:
    """Read a trace that `write_trace` wrote.

    Raises:
        ResultsError: If a file is missing, damaged or of another schema version, or
            its content cannot be that of a trace.
    """
    trace = read_tables(folder)
    tables = {**TABLES, "timing": TIMING, **trace.model_tables()}
    files = {name: folder / file_name(name) for name in tables}
    for name, kinds in tables.items():
        check_table(name, kinds, getattr(trace, name), files[name])
    check_trace(trace, files)
    return trace


def require_single_ego(folder: Path) -> None:
    """Raise unless a folder is of a run with one ego; many have other tables.

    Raises:
        ResultsError: If it is not, or is no run folder.
    """
    if any((folder / file_name(name)).exists() for name in ("steps", "episode")):
        return
    if (folder / MANY_EGOS).exists():
        raise ResultsError(
            f"{folder}: is a run with many egos, whose tables begin with {MANY_EGOS}; "
            "allowed: a run with one ego"
        )
    raise ResultsError(
        f"{folder}: is not a run folder; allowed: one written by rearview run, with "
        f"{file_name('steps')} in it"
    )


def read_tables(folder: Path) -> Trace:
    """Read all tables of a trace, whatever they hold.

    Raises:
        ResultsError: If a file is missing, damaged or of another schema version, or the
            run has many egos.
    """
    require_single_ego(folder)
    with parquet_database.reading() as database:
        return Trace(
            **{
                name: _read_or_refuse(database, kinds, folder / file_name(name))
                for name, kinds in {
                    **TABLES,
                    "timing": TIMING,
                    **_written(folder),
                }.items()
            }
        )


def _written(folder: Path) -> Mapping[str, Mapping[str, Kind]]:
    """Return those of `MODEL_TABLES` that have a file."""
    return {
        name: kinds
        for name, kinds in MODEL_TABLES.items()
        if (folder / file_name(name)).exists()
    }


def read_table(kinds: Mapping[str, Kind], path: Path) -> Table:
    """Read one table that `write_tables` wrote.

    Raises:
        ResultsError: If the file is missing, damaged or of another schema version.
    """
    with parquet_database.reading() as database:
        table = _read_or_refuse(database, kinds, path)
    check_table(path.stem, kinds, table, path)
    return table


def _read_or_refuse(
    database: "duckdb.DuckDBPyConnection", kinds: Mapping[str, Kind], path: Path
) -> Table:
    """Read one table; raise a one-line error if that fails."""
    import duckdb

    try:
        return _read(database, kinds, path)
    except (duckdb.Error, *_DAMAGE) as error:
        raise ResultsError(f"{path}: cannot be read: {_short(error)}") from error


def _write(
    database: "duckdb.DuckDBPyConnection",
    table: Table,
    kinds: Mapping[str, Kind],
    path: Path,
) -> None:
    """Write one table."""
    database.register("source", dict(table))
    columns = ", ".join(
        f"CAST({quoted_name(key)} AS {_SQL_TYPES[kind]}) AS {quoted_name(key)}"
        for key, kind in kinds.items()
    )
    database.execute(
        f"COPY (SELECT {columns} FROM source) TO {quoted_text(str(path))} "
        f"(FORMAT parquet, "
        f"COMPRESSION zstd, KV_METADATA {{{_VERSION_KEY}: '{SCHEMA_VERSION}'}})"
    )
    database.unregister("source")


def _read(
    database: "duckdb.DuckDBPyConnection", kinds: Mapping[str, Kind], path: Path
) -> Table:
    """Read one table after checking its schema version and its columns."""
    if not path.is_file():
        raise ResultsError(f"{path}: cannot be read: No such file")
    found = database.execute(
        f"SELECT value FROM parquet_kv_metadata({literal_path(path)}) "
        f"WHERE key = '{_VERSION_KEY}'::BLOB"
    ).fetchone()
    version = bytes(found[0]).decode() if found else "none"
    if version != str(SCHEMA_VERSION):
        raise ResultsError(
            f"{path}: has trace schema version {version[:20]}; "
            f"allowed: {SCHEMA_VERSION}"
        )
    source = parquet_source(path)
    described = database.execute(f"DESCRIBE SELECT * FROM {source}").fetchall()
    types = {name: kind for name, kind, *_ in described}
    for key, kind in kinds.items():
        if types.get(key) != _SQL_TYPES[kind]:
            has = f"holds {types[key]}" if key in types else "is missing"
            raise ResultsError(
                f"{path}: column {key} {has}; allowed: {_SQL_TYPES[kind]}"
            )
    names = ", ".join(map(quoted_name, kinds))
    columns = database.execute(f"SELECT {names} FROM {source}").fetchnumpy()
    return {key: _restored(columns[key], kind) for key, kind in kinds.items()}


def _restored(values: Column, kind: Kind) -> Column:
    """Return a column in the form it was written from."""
    if not np.ma.getmaskarray(values).any():
        plain = np.ma.getdata(values)
        return column(plain, kind) if kind is Kind.NUMBER else plain  # NaN is nothing
    if kind is Kind.TEXT:
        return column(values.tolist(), kind)
    return values


def _short(error: Exception) -> str:
    """Return the operating system's message if there is one, else the first line."""
    text = str(error)
    number = re.search(r"errno\W+([0-9]+)", text)
    line = (text.splitlines() or [type(error).__name__])[0]
    return os.strerror(int(number[1])) if number else line[:200]
