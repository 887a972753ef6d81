"""Everything recorded in one episode, as tables of columns.

A column is a NumPy array; one that may hold nothing is a masked array. Text columns
have dtype object. Units stand in the names. `steps` has one row a step, the other
tables refer to it by `index`. Wall-clock times are apart, in `timing`: they are no part
of the hash and of what 'identical' means.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import ResultsError

SCHEMA_VERSION = 6

Column = NDArray[Any]
Table = Mapping[str, Column]


class Kind(StrEnum):
    """Type of a column."""

    NUMBER = "number"  # float64
    COUNT = "count"  # int64
    TEXT = "text"  # str; some hold JSON


_NUMBER, _COUNT, _TEXT = Kind.NUMBER, Kind.COUNT, Kind.TEXT

_POSE = {"x_m": _NUMBER, "y_m": _NUMBER, "heading_rad": _NUMBER}
_SIZE = {"length_m": _NUMBER, "width_m": _NUMBER}

# table -> column -> kind; the order is that of the files
TABLES: Mapping[str, Mapping[str, Kind]] = {
    "episode": {  # one row
        "scenario": _TEXT,
        "planner": _TEXT,
        "seed": _COUNT,
        "status": _TEXT,
        "reason": _TEXT,
        "step_s": _NUMBER,
        "goal_m": _NUMBER,
        "target_speed_mps": _NUMBER,
        **_SIZE,  # of the ego
        "wheelbase_m": _NUMBER,
        "rear_overhang_m": _NUMBER,
    },
    "steps": {
        "index": _COUNT,
        "time_s": _NUMBER,
        **_POSE,  # rear axle of the ego
        "curvature_1pm": _NUMBER,
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "s_m": _NUMBER,  # Frenet state; null where the ego has left the frame
        "s_dot_mps": _NUMBER,
        "s_ddot_mps2": _NUMBER,
        "l_m": _NUMBER,
        "l_dot_mps": _NUMBER,
        "l_ddot_mps2": _NUMBER,
        "l_prime": _NUMBER,
        "l_second_1pm": _NUMBER,
        "centre_s_m": _NUMBER,  # centre of the ego's rectangle
        "centre_l_m": _NUMBER,
        "heading_error_rad": _NUMBER,  # against the reference path
        "plan_status": _TEXT,  # null without a plan, as all until explanation
        "reason": _TEXT,
        "candidates": _COUNT,
        "survivors": _COUNT,
        "removed": _TEXT,  # JSON: check -> candidates removed by it
        "costs": _TEXT,  # JSON: term -> cost of the chosen trajectory
        "blocker": _TEXT,
        "explanation": _TEXT,  # why this plan; empty where a planner says nothing
        "stop_line_m": _NUMBER,  # nearest one that holds now
        "stop_lines": _TEXT,  # JSON list of all of them [m]
        "gives_way_to": _TEXT,  # at a junction; a vehicle, or why else the ego waits
        "clearance_m": _NUMBER,  # null without any body
        "nearest": _TEXT,
        "contacts": _TEXT,  # JSON list of ids
        "off_road_m": _NUMBER,
        "ghost_x_m": _NUMBER,
        "ghost_y_m": _NUMBER,
        "ghost_heading_rad": _NUMBER,
    },
    "vehicles": {
        "index": _COUNT,
        "id": _TEXT,
        **_POSE,  # centre of the rectangle
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "lateral_speed_mps": _NUMBER,  # across its lane, positive to its left
        **_SIZE,
        "s_m": _NUMBER,  # on the ego's reference path; null far from it
        "l_m": _NUMBER,
        "s_dot_mps": _NUMBER,
        "l_dot_mps": _NUMBER,
        "heading_error_rad": _NUMBER,
    },
    "plans": {
        "index": _COUNT,
        "k": _COUNT,
        "t_s": _NUMBER,
        **_POSE,
        "speed_mps": _NUMBER,
        "s_m": _NUMBER,
        "l_m": _NUMBER,
    },
    "obstacles": {"id": _TEXT, **_POSE, **_SIZE, "radius_m": _NUMBER},
    "signals": {"index": _COUNT, "id": _TEXT, "stop_m": _NUMBER, "state": _TEXT},
    "road": {  # sampled evenly, for pictures and metrics
        "s_m": _NUMBER,
        **_POSE,
        "curvature_1pm": _NUMBER,
        "left_m": _NUMBER,
        "right_m": _NUMBER,
    },
    # The road as the planner got it, so that a cycle can be planned again.
    "path": {  # knots of the reference path
        "s_m": _NUMBER,
        **_POSE,
        "curvature_1pm": _NUMBER,
        "curvature_rate_1pm2": _NUMBER,
    },
    "bounds": {"s_m": _NUMBER, "left_m": _NUMBER, "right_m": _NUMBER},
    # each holds from its s on; none are null
    "speed_limits": {"s_m": _NUMBER, "limit_mps": _NUMBER},
    "lanes": {  # marked ones, right to left; all have the same s
        "lane": _COUNT,
        "s_m": _NUMBER,
        "centre_m": _NUMBER,
        "width_m": _NUMBER,
        "left_hand": _COUNT,  # 1 where traffic keeps to the left
        "solid": _COUNT,  # 1 where it may not be left to the left, 2 to the right, 3
    },
    # Junctions where the ego meets others; places along its path [m].
    "junctions": {
        "index": _COUNT,
        "junction": _TEXT,
        "rule": _TEXT,  # letter of the ego's right of way
        "stop_m": _NUMBER,
        "exit_m": _NUMBER,
        "speed_mps": _NUMBER,  # at which it can drive through
        "wait_m": _NUMBER,  # where it may wait inside; null where it may not
    },
    "foes": {  # as in planner.right_of_way.records.Foe
        "index": _COUNT,
        "junction": _COUNT,  # place among the junctions of the step
        "vehicle": _TEXT,
        "begin_m": _NUMBER,
        "end_m": _NUMBER,
        "entry_m": _NUMBER,
        "exit_m": _NUMBER,
        "to_line_m": _NUMBER,
        "speed_mps": _NUMBER,
        "limit_mps": _NUMBER,
        "turn_speed_mps": _NUMBER,
        "road_m": _NUMBER,
        "merges": _COUNT,  # 0 or 1, as the next three
        "stood_s": _NUMBER,
        "goes_first": _COUNT,
        "gives_way": _COUNT,
        "held": _COUNT,
    },
    "vehicle_ways": {  # of those near junctions whose way is known
        "index": _COUNT,
        "id": _TEXT,
        "way": _COUNT,
        "stop_m": _NUMBER,  # that it goes until it waits; null if it does not
    },
    "ways": {"way": _COUNT, "s_m": _NUMBER, "x_m": _NUMBER, "y_m": _NUMBER},
}
# Recorded only where there is something in it (vehicle, eyes or drivers that are not
# perfect, vehicles that show something): an empty one has no file and no part in the
# hash.
MODEL_TABLES: Mapping[str, Mapping[str, Kind]] = {
    "tracking": {  # one row a step from the second on: how the plan was followed
        "index": _COUNT,
        "lateral_error_m": _NUMBER,  # of the rear axle, positive to the plan's left
        "behind_m": _NUMBER,  # the plan's point of this time, along the plan
        "plan_heading_error_rad": _NUMBER,
        "steering_command_rad": _NUMBER,
        "steering_rad": _NUMBER,
        "drive_command_mps2": _NUMBER,
        "drive_mps2": _NUMBER,
        "limited": _NUMBER,  # share of the step at a limit of steering, drive or grip
        "grip": _NUMBER,  # largest share of the friction used
    },
    "starts": {  # of the plans that begin elsewhere than the ego is
        "index": _COUNT,
        "rule": _TEXT,  # stitched, measured, anew
        **_POSE,
        "curvature_1pm": _NUMBER,
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "lead_s": _NUMBER,  # the plan begins this much later than its step
    },
    "perceived": {  # the vehicles that the ego believed in
        "index": _COUNT,
        "id": _TEXT,
        **_POSE,
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "lateral_speed_mps": _NUMBER,
        **_SIZE,
    },
    "looks": {  # one row when a vehicle is first seen, and when its lights change
        "index": _COUNT,
        "id": _TEXT,
        "kind": _TEXT,  # SUMO's vehicle class, or pedestrian
        "indicator": _TEXT,  # left, right, both; empty without
    },
    "driver_errors": {  # of the traffic: who errs in a step, and how
        "index": _COUNT,
        "id": _TEXT,
        "error": _TEXT,  # looks_away, brakes, stalls, cuts_in, swerves, ...
    },
    "weights": {  # of errors that were drawn more often than asked for
        "index": _COUNT,
        "log_weight": _NUMBER,  # how much likelier the run so far is as asked for
    },
}
# of `vehicles`, in the order of the table of road users
ROAD_USER_COLUMNS = (
    "x_m",
    "y_m",
    "heading_rad",
    "speed_mps",
    "acceleration_mps2",
    "lateral_speed_mps",
    "length_m",
    "width_m",
)
TIMING: Mapping[str, Kind] = {
    "index": _COUNT,
    "planning_ms": _NUMBER,  # wall clock
    "planning_cpu_ms": _NUMBER,  # CPU time of the planning thread
    "elapsed_s": _NUMBER,  # wall clock since the first step
}

_DTYPES: Mapping[Kind, Any] = {_NUMBER: np.float64, _COUNT: np.int64, _TEXT: object}


def empty_table(name: str) -> Table:
    """Return a table of `MODEL_TABLES` without rows."""
    return {key: column([], kind) for key, kind in MODEL_TABLES[name].items()}


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Trace:
    """One recorded episode; the columns of each table stand in `TABLES`."""

    episode: Table
    steps: Table
    vehicles: Table
    plans: Table
    obstacles: Table
    signals: Table
    road: Table
    path: Table
    bounds: Table
    speed_limits: Table
    lanes: Table
    junctions: Table
    foes: Table
    vehicle_ways: Table
    ways: Table
    timing: Table
    tracking: Table = field(default_factory=lambda: empty_table("tracking"))
    starts: Table = field(default_factory=lambda: empty_table("starts"))
    perceived: Table = field(default_factory=lambda: empty_table("perceived"))
    looks: Table = field(default_factory=lambda: empty_table("looks"))
    driver_errors: Table = field(default_factory=lambda: empty_table("driver_errors"))
    weights: Table = field(default_factory=lambda: empty_table("weights"))

    def __post_init__(self) -> None:
        """Check that every table has its columns and all of one length."""
        for name in TABLES:
            _check(name, getattr(self, name), TABLES[name])
        _check("timing", self.timing, TIMING)
        for name, columns in MODEL_TABLES.items():
            _check(name, getattr(self, name), columns)

    def model_tables(self) -> Mapping[str, Mapping[str, Kind]]:
        """Return those of `MODEL_TABLES` that have rows."""
        return {
            name: columns
            for name, columns in MODEL_TABLES.items()
            if len(getattr(self, name)["index"])
        }

    def fact(self, column: str) -> Any:
        """Return a value of the one row about the whole episode."""
        return self.episode[column][0]


def column(values: object, kind: Kind) -> Column:
    """Return a column; None, and NaN among numbers, are masked."""
    if kind is Kind.NUMBER:
        numbers = np.array(values, dtype=np.float64)
        nothing = np.isnan(numbers)
        return np.ma.masked_array(numbers, nothing) if nothing.any() else numbers
    items = list(values)  # type: ignore[call-overload]
    missing = np.array([item is None for item in items], dtype=bool)
    filler: object = 0 if kind is Kind.COUNT else ""
    filled = [filler if item is None else item for item in items]
    array = np.empty(len(filled), dtype=_DTYPES[kind])
    array[:] = filled
    return np.ma.masked_array(array, missing) if missing.any() else array


def trace_hash(trace: Trace) -> str:
    """Hash all columns but the timings; sha256, hexadecimal.

    The hash covers names, order, values bit by bit, and which values are null.
    """
    digest = hashlib.sha256(f"rearview trace {SCHEMA_VERSION}".encode())
    for name, columns in {**TABLES, **trace.model_tables()}.items():
        table = getattr(trace, name)
        for key, kind in columns.items():
            digest.update(f"\n{name}.{key}:{len(table[key])}\n".encode())
            digest.update(canonical_bytes(table[key], kind))
    return digest.hexdigest()


def canonical_bytes(values: Column, kind: Kind) -> bytes:
    """Return a column as bytes that do not depend on the machine."""
    mask = np.ma.getmaskarray(values)
    data = np.ma.getdata(values)
    if kind is Kind.TEXT:
        texts = [
            b"-" if m else f"+{t}".encode() for t, m in zip(data, mask, strict=True)
        ]
        return b"\0".join(texts)
    little = "<f8" if kind is Kind.NUMBER else "<i8"
    return mask.tobytes() + np.where(mask, 0, data).astype(little).tobytes()


def _check(name: str, table: Table, columns: Mapping[str, Kind]) -> None:
    """Raise unless the table has exactly these columns, of one length."""
    if list(table) != list(columns):
        odd = sorted(set(table) ^ set(columns)) or "the order"
        raise ResultsError(f"table {name}: columns differ from the schema: {odd}")
    lengths = {len(values) for values in table.values()}
    if len(lengths) > 1:
        raise ResultsError(f"table {name}: columns of different lengths {lengths}")
