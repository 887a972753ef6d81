"""The results of a sweep: one row per run, collected from the run folders.

The run folders are the truth; `results.parquet` can be rebuilt from them at any time.
"""

import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import numpy as np

from experiments.errors import ConfigError, ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import ALL_COLUMNS
from experiments.metrics.row import read_row
from experiments.storage import parquet_database
from experiments.storage.parquet_source import (
    parquet_source,
    quoted_name,
    quoted_text,
)
from experiments.storage.run_files import MANIFEST, METRICS, read_manifest
from experiments.storage.sql_errors import sql_mistake
from experiments.sweep.folder import RESULTS, require_sweep, run_folders

if TYPE_CHECKING:
    import pandas as pd

RUN_ID, LABEL, REASON, FAILURE = "run_id", "label", "reason", "failure"
ATTEMPTS, EXIT_CODE, WALL = "attempts", "exit_code", "wall_s"
TRACE_HASH, TRACE_KEPT = "trace_hash", "trace_kept"

SQL_TIME = 60.0  # of one query [s]
SQL_MEMORY = "4GB"

ALL_RUNS = "SELECT * FROM runs"

Row = dict[str, Any]

_BEHIND = (REASON, FAILURE, ATTEMPTS, EXIT_CODE, TRACE_HASH, TRACE_KEPT, WALL)
_TEXTS = {REASON, FAILURE, TRACE_HASH, columns.FIRST_COLLISION_WITH, columns.VERDICT}
_COUNTS = {EXIT_CODE}
_ROW_FILES = (MANIFEST, METRICS)  # of a run, that its row is made from


def rebuild(folder: Path) -> int:
    """Write `results.parquet` from the run folders.

    Args:
        folder: Of a sweep.

    Returns:
        The number of rows.

    Raises:
        ResultsError: If a run folder is damaged or the disk refuses.
    """
    rows = [_row(run) for run in run_folders(folder)]
    rows.sort(key=_order)
    path = folder / RESULTS
    aside = path.with_name(f".{RESULTS}.{os.getpid()}")  # others may rebuild too
    try:
        _write(rows, aside)
        aside.replace(path)
    except (duckdb.Error, ValueError, OSError) as error:
        aside.unlink(missing_ok=True)
        line = str(error).splitlines()[0][:200]
        raise ResultsError(f"{path}: cannot be written: {line}") from error
    return len(rows)


def refresh(folder: Path) -> Path:
    """Return the Parquet file, rebuilt if a run has come, gone or changed since."""
    require_sweep(folder)
    path = folder / RESULTS
    if not _is_current(path, folder):
        rebuild(folder)
    return path


def query(
    folder: Path, sql: str = ALL_RUNS, option: str = "--sql"
) -> duckdb.DuckDBPyRelation:
    """Query the results of a sweep.

    Args:
        folder: Of the sweep.
        sql: One SELECT about the table `runs`.
        option: Where the question was written, for messages.

    Returns:
        The relation; `.fetchall()`, `.fetchnumpy()`, `.columns`.

    Raises:
        ConfigError: If the question is not one SELECT, or SQL cannot understand it.
    """
    connection = _runs_alone(folder)
    names = connection.table("runs").columns
    try:
        statements = connection.extract_statements(sql)
        if [one.type for one in statements] != [duckdb.StatementType.SELECT]:
            raise ConfigError(f"{option}: allowed: one SELECT on the table runs")
        answer = f"CREATE TEMP TABLE answer AS {statements[0].query}"
        _execute(connection, answer, option)
        return connection.table("answer")
    except duckdb.Error as error:
        raise _misunderstood(option, error, names) from error


def fetch(
    relation: duckdb.DuckDBPyRelation, option: str = "--sql"
) -> list[tuple[Any, ...]]:
    """Fetch the rows of a query; some errors appear only here."""
    try:
        found: list[tuple[Any, ...]] = relation.fetchall()
    except duckdb.Error as error:
        raise _misunderstood(option, error) from error
    return found


def _runs_alone(folder: Path) -> duckdb.DuckDBPyConnection:
    """Load a sweep's rows into a database that can reach nothing else.

    SQL may read and write any file (`read_text('/etc/passwd')`), and load extensions
    from the network.
    """
    connection = _load_runs(folder)
    connection.execute(f"SET memory_limit = '{SQL_MEMORY}'")
    connection.execute("SET enable_external_access = false")
    connection.execute("SET lock_configuration = true")
    return connection


def _execute(connection: duckdb.DuckDBPyConnection, sql: str, option: str) -> None:
    """Execute a statement for at most `SQL_TIME`, in a thread.

    DuckDB does not look for Ctrl-C while it computes; waiting for a thread does.

    Raises:
        ConfigError: If it takes longer.
        KeyboardInterrupt: After Ctrl-C.
    """
    with ThreadPoolExecutor(max_workers=1) as pool:
        executed = pool.submit(connection.execute, sql)
        try:
            executed.result(timeout=SQL_TIME)
        except TimeoutError as error:
            raise ConfigError(f"{option}: takes more than {SQL_TIME:.0f} s") from error
        finally:
            while not executed.done():  # it may not have begun yet
                connection.interrupt()
                wait((executed,), timeout=0.1)


def rows(folder: Path, sql: str = ALL_RUNS, option: str = "--sql") -> list[Row]:
    """Query the results of a sweep, see `query`, and return rows as dictionaries."""
    relation = query(folder, sql, option)
    names = relation.columns
    return [dict(zip(names, row, strict=True)) for row in fetch(relation, option)]


def dataframe(folder: Path, sql: str = ALL_RUNS) -> "pd.DataFrame":
    """Query the results of a sweep and return a pandas DataFrame, without pyarrow.

    Raises:
        ConfigError: If pandas is not there.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise ConfigError("a DataFrame needs pandas: pip install pandas") from error
    relation = query(folder, sql)
    frame: pd.DataFrame = relation.df()
    return frame


def axis_columns(names: Sequence[str]) -> list[str]:
    """Return the columns that are axes of the sweep."""
    known = {RUN_ID, LABEL, *ALL_COLUMNS, *_BEHIND}
    return [name for name in names if name not in known]


def _misunderstood(
    option: str, error: duckdb.Error, names: Sequence[str] = ()
) -> ConfigError:
    """Build the error of an invalid query; `names` are the columns of `runs`."""
    return ConfigError(f"{option}: {sql_mistake(str(error), names)}")


def _row(run: Path) -> Row:
    """Read the row of one run: identity, axes, metrics, execution."""
    try:
        about, metrics = read_manifest(run), read_row(run)
    except ResultsError as error:
        raise ResultsError(
            f"{error}; remove its folder and run the sweep again"
        ) from error
    sweep = about.get("sweep") or {}
    point = {key: _cell(value) for key, value in sweep.get("point", {}).items()}
    row = {
        **{key: value for key, value in point.items() if key not in ALL_COLUMNS},
        RUN_ID: run.name,
        LABEL: sweep.get("label"),
        **metrics,
        **{key: about.get(key) for key in _BEHIND},
    }
    # shared keys save two thirds of the memory of a row
    return {sys.intern(key): value for key, value in row.items()}


def _cell(value: Any) -> Any:
    """Format a list or a section on an axis as text."""
    return json.dumps(value) if isinstance(value, list | dict) else value


def _order(row: Row) -> tuple[Any, ...]:
    """Return the sort key: scenario, planner, axes, seed; numbers before text."""
    axes = sorted(axis_columns(list(row)))
    keys = (columns.SCENARIO, LABEL, *axes, columns.SEED)
    return tuple(
        (0, value, "") if isinstance(value, int | float) else (1, 0, str(value))
        for value in map(row.get, keys)
    )


def _names(rows: Sequence[Row]) -> list[str]:
    """Return the column names: identity, axes, metrics, execution."""
    found = list(dict.fromkeys(chain.from_iterable(rows)))
    axes = axis_columns(found)
    metrics = [name for name in found if name not in {RUN_ID, LABEL, *axes, *_BEHIND}]
    return [RUN_ID, LABEL, *axes, *metrics, *_BEHIND]


def _write(rows: Sequence[Row], path: Path) -> None:
    """Write rows as Parquet."""
    names = _names(rows) if rows else [RUN_ID, LABEL, *ALL_COLUMNS, *_BEHIND]
    table, types = {}, {}
    for name in names:
        values = [row.get(name) for row in rows]
        types[name] = _sql_type(name, values)
        table[name] = np.array(
            [None if v is None else _typed(v, types[name]) for v in values],
            dtype=object,
        )
    selected = ", ".join(
        f"CAST({quoted_name(name)} AS {kind}) AS {quoted_name(name)}"
        for name, kind in types.items()
    )
    with parquet_database.writing() as database:
        database.register("source", table)
        database.execute(
            f"COPY (SELECT {selected} FROM source) TO {quoted_text(str(path))} "
            "(FORMAT parquet, COMPRESSION zstd)"
        )


def _sql_type(name: str, values: Sequence[Any]) -> str:
    """Infer the type of a column from its values."""
    kinds = {type(value) for value in values if value is not None}
    if name in _TEXTS or str in kinds:
        return "VARCHAR"
    if kinds == {bool}:
        return "BOOLEAN"
    if name in _COUNTS or kinds == {int}:
        return "BIGINT"
    return "DOUBLE"


def _typed(value: Any, kind: str) -> Any:
    """Convert a value to the type of its column."""
    return {"VARCHAR": str, "BOOLEAN": bool, "BIGINT": int, "DOUBLE": float}[kind](
        value
    )


def _is_current(path: Path, folder: Path) -> bool:
    """Check whether a file of results is younger than all runs and has all of them."""
    try:
        written = path.stat().st_mtime_ns
        count = 0
        for run in run_folders(folder):
            count += 1
            changed = max((run / name).stat().st_mtime_ns for name in _ROW_FILES)
            if changed > written:
                return False
    except OSError:  # the file is not there, or one of a run: reading says which
        return False
    return _rows_in(path) == count


def _rows_in(path: Path) -> int:
    """Count the rows of a file of results; -1 if it is not one."""
    source = parquet_source(path)
    try:
        with parquet_database.reading() as database:
            described = database.execute(f"DESCRIBE SELECT * FROM {source}").fetchall()
            found = database.execute(f"SELECT count(*) FROM {source}").fetchone()
    except (duckdb.Error, ValueError):
        return -1
    missing = {RUN_ID, LABEL, *ALL_COLUMNS, *_BEHIND} - {name for name, *_ in described}
    return int(found[0]) if found and not missing else -1


def _load_runs(folder: Path) -> duckdb.DuckDBPyConnection:
    """Open a database with the table `runs`; damaged results are built anew."""
    create = f"CREATE TABLE runs AS SELECT * FROM {parquet_source(refresh(folder))}"
    connection = duckdb.connect()
    try:
        connection.execute(create)
    except duckdb.Error:  # a fatal one ends the database
        connection.close()
        rebuild(folder)
        connection = duckdb.connect()
        connection.execute(create)
    return connection
