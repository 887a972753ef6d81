"""What cannot be the content of a trace is refused, with file, column and row."""

import json

import numpy as np
import pytest

from experiments.errors import ResultsError
from experiments.metrics.row import metric_row
from experiments.report.run.page import run_page
from experiments.trace.files import file_name, read_trace, write_tables
from experiments.trace.schema import TABLES, TIMING, Kind, column
from tests.experiments.report.run_folders import driven_trace, write_run

KINDS = {**TABLES, "timing": TIMING}
TRACE = driven_trace(4)


def changed(folder, table, key, row, value):
    """Write a run with one other cell."""
    write_run(folder, TRACE)
    content = dict(getattr(TRACE, table))
    cells = np.ma.getdata(content[key]).tolist()
    mask = np.ma.getmaskarray(content[key])
    cells = [None if m else c for c, m in zip(cells, mask, strict=True)]
    cells[row] = value
    kind = KINDS[table][key]
    if kind is Kind.NUMBER:
        cells = [np.nan if cell is None else cell for cell in cells]
    content[key] = column(cells, kind)
    write_tables([(content, KINDS[table], folder / file_name(table))])
    return folder


@pytest.mark.parametrize(
    ("table", "key", "row", "value", "problem"),
    [
        ("steps", "x_m", 2, None, "x_m: row 2 is null"),
        ("steps", "x_m", 1, np.inf, "x_m: row 1 is not a finite number"),
        ("steps", "s_m", 1, -1e300, "s_m: row 1 is not a finite number"),
        ("steps", "candidates", 0, -4, "candidates: row 0 is not a number from 0"),
        ("steps", "index", 2, 1, "index: row 2 is not above the one before"),
        ("steps", "time_s", 3, 0.0, "time_s: row 3 is not above the one before"),
        ("steps", "contacts", 1, "{", "contacts: { is not JSON"),
        ("steps", "contacts", 1, "5", "contacts: holds 5"),
        ("steps", "contacts", 1, "[5]", "contacts: holds [5]"),
        ("steps", "removed", 0, "[]", "removed: holds []"),
        ("steps", "removed", 0, '{"a": "b"}', 'removed: holds {"a": "b"}'),
        ("steps", "removed", 0, '{"a": NaN}', 'removed: {"a": NaN} is not JSON'),
        ("steps", "costs", 0, '{"a": {}}', 'costs: holds {"a": {}}'),
        ("steps", "costs", 0, "[" * 9999, "costs: [[[["),
        ("vehicles", "index", 1, 77, "index: row 1 is not a step"),
        ("vehicles", "id", 1, None, "id: row 1 is null"),
        ("plans", "index", 40, 0, "index: row 40 is not above the one before"),
        ("episode", "step_s", 0, 0.0, "step_s: row 0 is not above 0"),
        ("episode", "length_m", 0, None, "length_m: row 0 is null"),
        ("road", "s_m", 1, 0.0, "s_m: row 1 is not above the one before"),
        ("timing", "index", 3, 9, "index: is not that of the steps"),
    ],
)
def test_odd_cells(tmp_path, table, key, row, value, problem):
    folder = changed(tmp_path, table, key, row, value)
    with pytest.raises(ResultsError) as refusal:
        read_trace(folder)
    message = str(refusal.value)
    assert message.startswith(f"{folder / file_name(table)}: ")
    assert problem in message
    assert len(message) < len(str(folder)) + 300


@pytest.mark.parametrize("table", ["episode", "road"])
def test_tables_that_need_rows(tmp_path, table):
    write_run(tmp_path, TRACE)
    none = {key: values[:0] for key, values in getattr(TRACE, table).items()}
    write_tables([(none, KINDS[table], tmp_path / file_name(table))])
    with pytest.raises(ResultsError, match=rf"{file_name(table)}: has (0|no) rows"):
        read_trace(tmp_path)


def test_columns_of_another_type(tmp_path):
    write_run(tmp_path, TRACE)
    kinds = {**KINDS["steps"], "x_m": Kind.TEXT}
    texts = column(["1.5"] * len(TRACE.steps["x_m"]), Kind.TEXT)
    file = tmp_path / file_name("steps")
    write_tables([({**TRACE.steps, "x_m": texts}, kinds, file)])
    with pytest.raises(ResultsError, match="column x_m holds VARCHAR; allowed: DOUBLE"):
        read_trace(tmp_path)
    less = {key: values for key, values in TRACE.steps.items() if key != "x_m"}
    del kinds["x_m"]
    write_tables([(less, kinds, file)])
    with pytest.raises(ResultsError, match="column x_m is missing; allowed: DOUBLE"):
        read_trace(tmp_path)


def test_a_planner_may_report_costs_that_are_not_finite(tmp_path):
    costs = json.dumps({"jerk_integral": float("inf"), "total": float("nan"), "a": 2.0})
    folder = changed(tmp_path, "steps", "costs", 0, costs)
    assert metric_row(read_trace(folder))["mean_j_jerk"] is None
    assert '\\"total\\": null, \\"a\\": 2.0' in run_page(folder)
