"""Everything recorded in a run with many egos: long tables, vehicle x step.

`fleet` has a row for every vehicle in every step, egos and others alike; `egos` one for
every ego in every step with what its driver did; `ego_ends` says how egos ceased to be
ones; `fleet_steps` has one row a step. Text columns repeat, and are packed by the file
format. Planning times are apart, as in the trace of a single ego.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.trace.files import write_tables
from experiments.trace.schema import (
    SCHEMA_VERSION,
    Kind,
    Table,
    canonical_bytes,
    column,
)
from planner.states import FloatArray, IntArray

_NUMBER, _COUNT, _TEXT = Kind.NUMBER, Kind.COUNT, Kind.TEXT

FLEET_TABLES: Mapping[str, Mapping[str, Kind]] = {
    "fleet": {
        "index": _COUNT,
        "id": _TEXT,
        "group": _COUNT,  # of egos; null: SUMO's driver
        "lane": _TEXT,  # null off the lanes
        "position_m": _NUMBER,  # of the front bumper on the lane
        "x_m": _NUMBER,  # centre of the rectangle
        "y_m": _NUMBER,
        "heading_rad": _NUMBER,
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "length_m": _NUMBER,
        "width_m": _NUMBER,
        "wished_speed_mps": _NUMBER,
        "fuel_mgps": _NUMBER,
        "co2_mgps": _NUMBER,
    },
    "egos": {
        "index": _COUNT,
        "id": _TEXT,
        "group": _COUNT,
        "x_m": _NUMBER,  # rear axle
        "y_m": _NUMBER,
        "heading_rad": _NUMBER,
        "curvature_1pm": _NUMBER,
        "speed_mps": _NUMBER,
        "acceleration_mps2": _NUMBER,
        "plan_status": _TEXT,  # null without a plan
        "clearance_m": _NUMBER,  # null without a body near
        "off_road_m": _NUMBER,
        "contacts": _TEXT,  # JSON list of ids
    },
    "ego_ends": {"index": _COUNT, "id": _TEXT, "how": _TEXT, "reason": _TEXT},
    "fleet_steps": {"index": _COUNT, "time_s": _NUMBER, "pending": _COUNT},
}
# Where plans lead, beside the tables of `egos` row by row: for pictures, not hashed.
FLEET_PLANS: Mapping[str, Kind] = {
    "x1_m": _NUMBER,  # after 1, 2 and 3 s
    "y1_m": _NUMBER,
    "x2_m": _NUMBER,
    "y2_m": _NUMBER,
    "x3_m": _NUMBER,
    "y3_m": _NUMBER,
}
PLANS_FILE = "fleet_plans.parquet"
FLEET_TIMING: Mapping[str, Kind] = {
    "index": _COUNT,
    "step_cpu_ms": _NUMBER,  # of the whole step
    "egos": _COUNT,
    "planning_cpu_ms": _NUMBER,  # of all egos together
}
TO_MS = 1e3  # from seconds


@dataclass(frozen=True, slots=True, eq=False)
class FleetTrace:
    """A recorded run as arrays; rows of `vehicles` are in the order of the steps.

    Arrays are (n,) with one row for each vehicle in each step, unless they are said to
    be of the steps (n_steps,) or of the vehicles (m,).
    """

    step_s: float  # [s]
    ids: tuple[str, ...]  # of the vehicles, in the order in which they came
    lanes: tuple[str, ...]
    index: IntArray  # step
    vehicle: IntArray  # place in `ids`
    group: IntArray
    lane: IntArray  # place in `lanes`, -1 off the lanes
    table: FloatArray  # (8, n), rows as of road users
    numbers: FloatArray  # (4, n): position [m], wished speed, fuel, CO2
    time: FloatArray  # of the steps [s]
    pending: IntArray  # of the steps
    cpu: FloatArray  # of the steps [s]
    step_index: IntArray  # of the steps
    egos: Table  # every ego in every step
    planning: FloatArray  # CPU time of planning of its rows, NaN without a plan [ms]
    ego_ends: Table
    plans: FloatArray  # of the rows of egos, (n, 6), NaN without a plan [m]

    @property
    def speed(self) -> FloatArray:
        """Speed of each row [m/s]."""
        return np.asarray(self.table[3])

    @property
    def position(self) -> FloatArray:
        """Position of the front bumper on its lane [m]."""
        return np.asarray(self.numbers[0])


def fleet_tables(trace: FleetTrace) -> Mapping[str, Table]:
    """Return the tables of a run, all but the timing."""
    names = np.array(trace.ids, dtype=object)
    lanes = np.array([*trace.lanes, None], dtype=object)
    t, numbers = trace.table, trace.numbers
    return {
        "fleet": fleet_table(
            "fleet",
            trace.index,
            names[trace.vehicle],
            [None if group < 0 else group for group in trace.group.tolist()],
            lanes[trace.lane],
            numbers[0],
            *(t[k] for k in (0, 1, 2, 3, 4, 6, 7)),
            *numbers[1:],
        ),
        "egos": trace.egos,
        "ego_ends": trace.ego_ends,
        "fleet_steps": fleet_table(
            "fleet_steps",
            trace.step_index.tolist(),
            trace.time,
            trace.pending,
        ),
    }


def fleet_table(name: str, *values: object) -> Table:
    """Return a table from its columns in order."""
    kinds = FLEET_TABLES[name]
    return {
        key: column(value, kind)
        for (key, kind), value in zip(kinds.items(), values, strict=True)
    }


def timing_table(trace: FleetTrace) -> Table:
    """Return how long the steps took."""
    place = np.searchsorted(trace.step_index, trace.egos["index"])
    spent = np.nan_to_num(trace.planning)
    n = trace.step_index.size
    values = (
        trace.step_index.tolist(),
        TO_MS * trace.cpu,
        np.bincount(place, minlength=n).tolist(),
        np.bincount(place, spent, minlength=n),
    )
    return {
        key: column(value, kind)
        for (key, kind), value in zip(FLEET_TIMING.items(), values, strict=True)
    }


def fleet_hash(tables: Mapping[str, Table]) -> str:
    """Hash all tables but the timing; sha256, hexadecimal."""
    digest = hashlib.sha256(f"rearview fleet trace {SCHEMA_VERSION}".encode())
    for name, kinds in FLEET_TABLES.items():
        for key, kind in kinds.items():
            values = tables[name][key]
            digest.update(f"\n{name}.{key}:{len(values)}\n".encode())
            digest.update(canonical_bytes(values, kind))
    return digest.hexdigest()


def plans_table(trace: FleetTrace) -> Table:
    """Return where the plans of all egos lead."""
    columns = zip(FLEET_PLANS.items(), trace.plans.T, strict=True)
    return {name: column(values, kind) for (name, kind), values in columns}


def write_fleet(
    tables: Mapping[str, Table], timing: Table, plans: Table, folder: Path
) -> None:
    """Write the tables of a run into its folder.

    Raises:
        ResultsError: If a file cannot be written.
    """
    write_tables(
        [
            *(
                (tables[name], kinds, folder / f"{name}.parquet")
                for name, kinds in FLEET_TABLES.items()
            ),
            (timing, FLEET_TIMING, folder / "fleet_timing.parquet"),
            (plans, FLEET_PLANS, folder / PLANS_FILE),
        ]
    )


def is_ego(trace: FleetTrace) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Mark the rows that are of egos, (n,)."""
    return np.asarray(trace.group >= 0)
