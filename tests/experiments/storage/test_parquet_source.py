"""Parquet files in folders with odd names: the file that is named is read, as it is."""

import json
import shutil

import duckdb
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from experiments.comparison.results import RESULTS, rebuild, rows
from experiments.storage.parquet_source import parquet_source, quoted_text
from experiments.trace.files import read_trace, write_trace
from experiments.trace.schema import trace_hash
from tests.experiments.report.run_folders import driven_trace, write_sweep

ODD_NAMES = (
    "seed=77",
    "scenario=evil",
    "label=a=b",
    "with space",
    "it's",
    'say "x"',
    "ünï-文",
    "*",
    "**",
    "wh?t",
    "[ab]",
    "[",
    "[!x]",
    "{a,b}",
    "~",
    "s3:",
    "%20",
    "a;b",
    "$HOME",
    "back\\slash",
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a sweep whose results are not collected yet."""
    return write_sweep(tmp_path_factory.mktemp("made") / "sweep", seeds=1)


@pytest.mark.parametrize("name", ODD_NAMES)
def test_traces_and_results_in_odd_folders(made, tmp_path, name):
    folder = tmp_path / name / "inner"
    folder.mkdir(parents=True)
    trace = driven_trace(3)
    write_trace(trace, folder)
    assert trace_hash(read_trace(folder)) == trace_hash(trace)
    sweep = shutil.copytree(made, tmp_path / name / "sweep")
    assert rebuild(sweep) == 8
    found = rows(sweep)
    assert {row["seed"] for row in found} == {0}
    assert {row["scenario"] for row in found} == {"straight", "curved"}
    assert {row["label"] for row in found} == {"cruise", "old"}


# DuckDB takes a backslash beside a pattern for a separator: that is refused in a line.
PARTS = st.text(
    st.characters(exclude_characters="/\0\\", exclude_categories=["Cs"]),
    min_size=1,
    max_size=20,
).filter(lambda name: name not in (".", ".."))


@settings(max_examples=30)
@given(name=PARTS | st.text("[]*?!=-ab^'", min_size=1, max_size=8))
@example("k=v")
@example("[[]]")
def test_the_named_file_and_no_other_is_read(tmp_path_factory, name):
    parent = tmp_path_factory.getbasetemp() / "odd"
    shutil.rmtree(parent, ignore_errors=True)
    file = parent / name / "t.parquet"
    for other in ("a", "b", "ab", "-"):  # what a pattern could match
        (parent / other).mkdir(parents=True, exist_ok=True)
        (parent / other / "t.parquet").write_bytes(b"not this one")
    file.parent.mkdir(exist_ok=True)
    file.unlink(missing_ok=True)
    with duckdb.connect() as database:
        database.execute(f"COPY (SELECT 5 AS a) TO {quoted_text(str(file))}")
        relation = database.execute(f"SELECT * FROM {parquet_source(file)}")
        assert [column[0] for column in relation.description] == ["a"]
        assert relation.fetchall() == [(5,)]


def test_a_damaged_file_of_results_is_built_anew(tmp_path):
    sweep = write_sweep(tmp_path / "sweep", seeds=1)
    expected = rows(sweep)
    data = bytearray((sweep / RESULTS).read_bytes())
    data[200:400] = np.random.default_rng(1).bytes(200)
    for content in (b"", b"PAR1", bytes(data)):
        (sweep / RESULTS).write_bytes(content)
        assert rows(sweep) == expected


def test_a_changed_run_is_noticed(tmp_path):
    sweep = write_sweep(tmp_path / "sweep", seeds=1)
    before = rows(sweep)
    (file,) = sweep.glob(f"runs/*/{before[0]['run_id']}/metrics.json")
    content = json.loads(file.read_text())
    file.write_text(json.dumps({**content, "distance_m": 12.5}))
    assert rows(sweep)[0]["distance_m"] == 12.5
