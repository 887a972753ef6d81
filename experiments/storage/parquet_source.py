"""Parquet files as tables of SQL, whatever their folders are called."""

import re
from pathlib import Path


def parquet_source(path: Path) -> str:
    """Return the SQL for the table of one Parquet file.

    DuckDB would read `seed=77` in a path as a column of a Hive partition, and `*`, `?`
    and `[` as patterns for several files.
    """
    return f"read_parquet({literal_path(path)}, hive_partitioning = false)"


def literal_path(path: Path) -> str:
    """Return the SQL string that makes a table function read exactly this file."""
    # absolute: what looks like an address (s3:...) or a home (~) is a folder too
    return quoted_text(re.sub(r"([*?\[])", r"[\1]", str(path.absolute())))


def quoted_text(text: str) -> str:
    """Return a text as an SQL string."""
    return "'" + text.replace("'", "''") + "'"


def quoted_name(name: str) -> str:
    """Return the name of a column as an SQL identifier."""
    return '"' + name.replace('"', '""') + '"'
