"""Checks of what was read as a trace: files may be damaged, or written by strangers.

What passes can be drawn and measured: the numbers are finite, nothing is null where a
step always has a value, the tables refer to steps that exist, and the cells that hold
JSON hold what the schema says.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.errors import ResultsError
from experiments.storage.json_files import parse_json, short, short_text
from experiments.trace.schema import Column, Kind, Table, Trace

LARGEST_NUMBER = 1e15  # squares and sums of such numbers are still finite
LARGEST_COUNT = 2**32 - 1  # pages hold counts in 32 bits

_PLACES = {"s_m", "l_m", "s_dot_mps", "l_dot_mps", "heading_error_rad"}
# table -> columns that hold nothing where there is nothing to record
_NULLABLE: Mapping[str, set[str]] = {
    "episode": {"reason"},
    "steps": _PLACES
    | {"s_ddot_mps2", "l_ddot_mps2", "l_prime", "l_second_1pm"}
    | {"centre_s_m", "centre_l_m", "plan_status", "reason", "candidates", "survivors"}
    | {"removed", "costs", "blocker", "explanation", "stop_line_m", "clearance_m"}
    | {
        "gives_way_to",
        "nearest",
        "off_road_m",
        "ghost_x_m",
        "ghost_y_m",
        "ghost_heading_rad",
    },
    "vehicles": _PLACES | {"acceleration_mps2", "lateral_speed_mps"},
    "plans": {"s_m", "l_m"},
    "speed_limits": {"limit_mps"},
    "junctions": {"wait_m"},
    "vehicle_ways": {"stop_m"},
    "timing": {"planning_ms", "planning_cpu_ms"},
    "fleet": {"group", "lane"},
    "egos": {"plan_status", "clearance_m"},
    "fleet_plans": {"x1_m", "y1_m", "x2_m", "y2_m", "x3_m", "y3_m"},  # without a plan
    "perceived": {"acceleration_mps2", "lateral_speed_mps"},
    "driver_errors": set(),
    "weights": set(),
}
# tables whose index is that of a step
_WITH_STEPS = (
    "vehicles",
    "plans",
    "signals",
    "junctions",
    "foes",
    "vehicle_ways",
)


def check_table(name: str, kinds: Mapping[str, Kind], table: Table, file: Path) -> None:
    """Check the columns of one table, each for itself.

    Args:
        name: Of the table.
        kinds: Of its columns.
        table: As it was read.
        file: Named in messages.

    Raises:
        ResultsError: One line about file, column and row.
    """
    for key, kind in kinds.items():
        values = table[key]
        if key not in _NULLABLE.get(name, ()):
            _refuse(file, key, np.ma.getmaskarray(values), "is null")
        data, there = np.ma.getdata(values), ~np.ma.getmaskarray(values)
        if kind is Kind.NUMBER:
            with np.errstate(invalid="ignore"):
                wrong = there & ~(np.abs(data) <= LARGEST_NUMBER)
            _refuse(file, key, wrong, "is not a finite number")
        elif kind is Kind.COUNT and key != "seed":
            wrong = there & ((data < 0) | (data > LARGEST_COUNT))
            _refuse(file, key, wrong, f"is not a number from 0 to {LARGEST_COUNT}")
    for key, is_right in _JSON_CELLS.items():
        if key in kinds:
            _check_json(file, key, table[key], is_right)


def check_trace(trace: Trace, files: Mapping[str, Path]) -> None:
    """Check what the tables of a trace say about each other.

    Args:
        trace: Its tables have passed `check_table`.
        files: Of the tables, for messages.

    Raises:
        ResultsError: One line about file and column.
    """
    if len(trace.episode["seed"]) != 1:
        count = len(trace.episode["seed"])
        raise ResultsError(f"{files['episode']}: has {count} rows; allowed: one")
    if not trace.fact("step_s") > 0.0:
        raise ResultsError(f"{files['episode']}: step_s: row 0 is not above 0")
    steps = trace.steps["index"]
    rising = ("road", "s_m"), ("path", "s_m"), ("bounds", "s_m")
    for name, key in (("steps", "index"), ("steps", "time_s"), *rising):
        falling = np.append(False, np.diff(getattr(trace, name)[key]) <= 0)
        _refuse(files[name], key, falling[: len(getattr(trace, name)[key])], _FALLS)
    if not np.array_equal(trace.timing["index"], steps):
        raise ResultsError(f"{files['timing']}: index: is not that of the steps")
    for name in ("road", "path", "bounds"):
        if len(steps) and not len(getattr(trace, name)["s_m"]):
            raise ResultsError(f"{files[name]}: has no rows; allowed: one or more")
    for name in (*_WITH_STEPS, *trace.model_tables()):
        index = getattr(trace, name)["index"]
        _refuse(files[name], "index", ~np.isin(index, steps), "is not a step")
        falling = np.append(np.zeros(min(len(index), 1), bool), np.diff(index) < 0)
        _refuse(files[name], "index", falling, _FALLS)


_FALLS = "is not above the one before"


def _refuse(file: Path, key: str, wrong: Column, problem: str) -> None:
    """Raise an error about the first row that is marked as wrong."""
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ResultsError(f"{file}: is damaged: {key}: row {row} {problem}")


def _check_json(
    file: Path, key: str, values: Column, is_right: Callable[[Any], bool]
) -> None:
    """Check a column of JSON; equal cells are parsed once."""
    for cell in dict.fromkeys(np.ma.compressed(values).tolist()):
        try:
            content = parse_json(cell, finite=key != "costs")
        except ValueError as error:
            raise ResultsError(
                f"{file}: is damaged: {key}: {short_text(cell)} is not JSON "
                f"({short_text(str(error))})"
            ) from error
        if not is_right(content):
            raise ResultsError(f"{file}: is damaged: {key}: holds {short(content)}")


def _is_text_list(content: Any) -> bool:
    """Check for a list of ids."""
    return isinstance(content, list) and all(isinstance(item, str) for item in content)


def _is_number_list(content: Any) -> bool:
    """Check for a list of numbers."""
    return isinstance(content, list) and all(isinstance(x, float) for x in content)


def _has_numbers(content: Any) -> bool:
    """Check for an object whose values are numbers."""
    return isinstance(content, dict) and all(
        isinstance(value, int | float) and not isinstance(value, bool)
        for value in content.values()
    )


_JSON_CELLS: Mapping[str, Callable[[Any], bool]] = {
    "contacts": _is_text_list,
    "stop_lines": _is_number_list,
    "removed": _has_numbers,
    "costs": _has_numbers,  # a planner may report an infinite cost
}
