"""The catalogue of metrics is complete; all that is derived from it agrees."""

import re

import pytest

from experiments.cosim.records import EpisodeStatus
from experiments.metrics import columns
from experiments.metrics.catalogue import (
    ALL_COLUMNS,
    IN_TERMINAL,
    MEANS,
    METRICS,
    RATES,
    TIMING_COLUMNS,
    markdown_table,
)
from experiments.metrics.fleet_catalogue import FLEET_METRICS

UNITS = {  # suffix of a column -> unit
    "m": "m",
    "s": "s",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps3": "m/s³",
    "1pm": "1/m",
    "rad": "rad",
    "m2": "m²",
}


def test_every_named_column_has_an_entry():
    named = {
        value
        for name, value in vars(columns).items()
        if name.isupper() and isinstance(value, str)
    }
    assert set(ALL_COLUMNS) == named | {metric.column for metric in FLEET_METRICS}


@pytest.mark.parametrize("metric", METRICS.values(), ids=ALL_COLUMNS)
def test_entry_is_complete(metric):
    assert metric.label
    assert metric.formula
    suffix = metric.column.rpartition("_")[2]
    if suffix in UNITS and metric.column != columns.STEPS_PER_SECOND:
        assert metric.unit == UNITS[suffix]
    if metric.column.startswith("planning_"):
        assert metric.unit == "ms"
        assert metric.timing
    if metric.rate:
        assert metric.compared


def test_labels_are_distinct():
    labels = [metric.label for metric in METRICS.values()]
    assert len(set(labels)) == len(labels)


def test_numbers_are_formatted_with_the_digits_of_their_metric():
    assert METRICS["min_clearance_m"].text(1.234) == "1.23"
    assert METRICS["collisions"].text(2) == "2"
    assert METRICS["changed_before_blockage"].text(value=True) == "yes"
    assert METRICS["min_ttc_s"].text(None) == "-"
    assert METRICS["rms_jerk_mps3"].label_with_unit == "RMS jerk [m/s³]"
    assert METRICS["collisions"].label_with_unit == "collisions"


def test_derived_lists():
    assert "CPU time" in METRICS["planning_cpu_ms_p50"].formula
    assert "wall-clock" in METRICS["planning_ms_p50"].formula
    compared = [name for name in TIMING_COLUMNS if METRICS[name].compared]
    assert compared == ["planning_cpu_ms_p50", "planning_cpu_ms_p99"]
    assert set(TIMING_COLUMNS) == {
        column
        for column in ALL_COLUMNS
        if column.startswith("planning_")
        or column in ("deadline_misses", "steps_per_s", "fleet_step_cpu_ms")
    }
    assert dict(RATES) == {
        "arrived": "arrived",
        "collided": "collisions",
        "off road": "off_road_steps",
    }
    assert {"min_ttc_s", "travel_time_s", "rms_jerk_mps3"} <= set(MEANS)
    assert not set(MEANS) & set(RATES.values())
    assert all(not metric.identity for metric in IN_TERMINAL)


def test_status_names_all_values_of_the_loop():
    listed = re.findall(r"`(\w+)`", METRICS["status"].formula)
    assert set(listed) == {str(status) for status in EpisodeStatus}


def test_reference_has_a_row_for_each_metric():
    header, rule, *rows = markdown_table().splitlines()
    cells = [re.split(r"(?<!\\)\|", row)[1:-1] for row in (header, rule, *rows)]
    assert {len(row) for row in cells} == {6}
    assert [row[0].strip(" `") for row in cells[2:]] == list(ALL_COLUMNS)
    ttc = next(row for row in rows if "min_ttc_s" in row)
    assert ttc.startswith("| `min_ttc_s` | min TTC | s | higher | run, compare | ")
