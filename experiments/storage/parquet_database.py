"""Databases in memory that a process keeps, to read and to write Parquet files.

Opening one takes as long as reading all tables of a run.
"""

import atexit
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import duckdb


@contextmanager
def writing() -> Iterator["duckdb.DuckDBPyConnection"]:
    """Lend a database to write with; an error ends what is lent only."""
    with _for_writing(os.getpid()).cursor() as database:
        yield database


@contextmanager
def reading() -> Iterator["duckdb.DuckDBPyConnection"]:
    """Lend a database to read with.

    A damaged file may end a database: not the one that writes, and after any error
    there is a new one.
    """
    try:
        with _for_reading(os.getpid()).cursor() as database:
            yield database
    except BaseException:
        _for_reading.cache_clear()
        raise


@cache
def _for_writing(_process: int) -> "duckdb.DuckDBPyConnection":
    """Open this process's database for writing."""
    return _opened()


@cache
def _for_reading(_process: int) -> "duckdb.DuckDBPyConnection":
    """Open this process's database for reading."""
    return _opened()


@atexit.register
def _close() -> None:
    """Close them before the interpreter ends, where the library would complain."""
    for kept in (_for_writing, _for_reading):
        kept.cache_clear()


def _opened() -> "duckdb.DuckDBPyConnection":
    """Open a database."""
    import duckdb

    return duckdb.connect(config={"threads": 1})
