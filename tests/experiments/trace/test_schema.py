"""Traces: columns, hash, and the way to Parquet and back."""

from dataclasses import replace

import duckdb
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.errors import ResultsError
from experiments.trace.files import (
    file_name,
    read_tables,
    read_trace,
    write_trace,
)
from experiments.trace.schema import TABLES, TIMING, Kind, Trace, column, trace_hash

VALUES = {
    Kind.NUMBER: [0.1, -0.0, None, np.inf, 1e-300],
    Kind.COUNT: [1, -5, 2**40, None, 0],
    Kind.TEXT: ["a", "", None, "é'\n", '{"x": 1}'],
}


def table(kinds, rows):
    return {
        key: column(
            [np.nan if v is None and kind is Kind.NUMBER else v for v in VALUES[kind]][
                :rows
            ],
            kind,
        )
        for key, kind in kinds.items()
    }


def some_trace(rows: int = 5) -> Trace:
    tables = {name: table(kinds, rows) for name, kinds in TABLES.items()}
    return Trace(**tables, timing=table(TIMING, rows))


def with_value(trace: Trace, name: str, key: str, values) -> Trace:
    kinds = {**TABLES, "timing": TIMING}[name]
    return replace(
        trace, **{name: {**getattr(trace, name), key: column(values, kinds[key])}}
    )


@pytest.mark.parametrize("rows", [5, 2, 0])
def test_round_trip(tmp_path, rows):
    trace = some_trace(rows)
    write_trace(trace, tmp_path)
    back = read_tables(tmp_path)
    for name, kinds in {**TABLES, "timing": TIMING}.items():
        for key in kinds:
            one, other = getattr(trace, name)[key], getattr(back, name)[key]
            assert one.dtype == other.dtype
            assert (
                np.ma.getmaskarray(one).tolist() == np.ma.getmaskarray(other).tolist()
            )
            assert np.ma.compressed(one).tolist() == np.ma.compressed(other).tolist()
    assert trace_hash(back) == trace_hash(trace)


def test_same_trace_same_bytes(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_trace(some_trace(), tmp_path / name)
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


def test_none_is_null_in_the_file_and_infinity_stays(tmp_path):
    write_trace(some_trace(), tmp_path)
    file = tmp_path / file_name("steps")
    found = duckdb.sql(f"SELECT s_m, candidates, reason FROM '{file}'").fetchall()
    assert [row[0] for row in found] == [0.1, -0.0, None, np.inf, 1e-300]
    assert found[3][1] is None
    assert found[2][2] is None


def test_hash_ignores_timings_only():
    trace = some_trace()
    slower = with_value(trace, "timing", "planning_ms", [9.0] * 5)
    assert trace_hash(slower) == trace_hash(trace)


@given(
    name=st.sampled_from(sorted(TABLES)),
    data=st.data(),
    row=st.integers(0, 4),
)
def test_hash_sees_every_cell(name, data, row):
    trace = some_trace()
    key = data.draw(st.sampled_from(sorted(TABLES[name])))
    kind = TABLES[name][key]
    values = list(VALUES[kind])
    values[row] = {Kind.NUMBER: 0.25, Kind.COUNT: 17, Kind.TEXT: "other"}[kind]
    if kind is Kind.NUMBER:
        values = [np.nan if v is None else v for v in values]
    assert trace_hash(with_value(trace, name, key, values)) != trace_hash(trace)


def test_hash_tells_null_from_zero_and_empty():
    trace = some_trace()
    for key, filler in (("s_m", 0.0), ("candidates", 0), ("reason", "")):
        values = list(VALUES[TABLES["steps"][key]])
        values[values.index(None)] = filler
        assert trace_hash(with_value(trace, "steps", key, values)) != trace_hash(trace)


def test_another_schema_version_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.trace.files.SCHEMA_VERSION", 2)
    write_trace(some_trace(), tmp_path)
    monkeypatch.undo()
    with pytest.raises(ResultsError, match="schema version 2; allowed: 6"):
        read_trace(tmp_path)


def test_damaged_and_missing_files_are_refused(tmp_path):
    with pytest.raises(ResultsError, match="is not a run folder"):
        read_trace(tmp_path)
    write_trace(some_trace(), tmp_path)
    file = tmp_path / file_name("vehicles")
    file.write_bytes(file.read_bytes()[:-30])
    with pytest.raises(ResultsError, match=r"vehicles\.parquet: cannot be read"):
        read_trace(tmp_path)


def test_foreign_and_uneven_columns_are_refused():
    trace = some_trace()
    with pytest.raises(ResultsError, match="columns differ"):
        replace(trace, signals={**trace.signals, "colour": column([1] * 5, Kind.COUNT)})
    with pytest.raises(ResultsError, match="different lengths"):
        with_value(trace, "signals", "index", [1])
