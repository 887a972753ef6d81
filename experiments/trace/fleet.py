"""Everything recorded in a run with many egos: long tables, vehicle x step.

`fleet` has a row for every vehicle in every step, egos and others alike; `egos` one for
every ego in every step with what its driver did; `ego_ends` says how egos ceased to be
ones; `fleet_steps` has one row a step. Text columns repeat, and are packed by the file
format. Planning times are apart, as in the trace of a single ego.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from experiments.cosim.fleet.records import HUMAN, EgoStep, FleetStep, Leaving
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
        "group": _COUNT,  # of egos; -1: SUMO's driver
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
    egos: tuple[tuple[int, EgoStep], ...]  # with the index of the step
    leavings: tuple[Leaving, ...]

    @property
    def speed(self) -> FloatArray:
        """Speed of each row [m/s]."""
        return np.asarray(self.table[3])

    @property
    def position(self) -> FloatArray:
        """Position of the front bumper on its lane [m]."""
        return np.asarray(self.numbers[0])


@dataclass(slots=True)
class FleetRecorder:
    """Keeps the steps of a run with many egos; the loop calls it with each."""

    _steps: list[FleetStep] = field(default_factory=list)
    _numbers: dict[str, int] = field(default_factory=dict)
    _columns: list[IntArray] = field(default_factory=list)

    def __call__(self, step: FleetStep) -> None:
        """Add one step."""
        known = self._numbers
        ids = step.snapshot.users.ids
        places = [known.setdefault(name, len(known)) for name in ids]
        self._columns.append(np.array(places, dtype=np.int64))
        self._steps.append(step)

    @property
    def n_steps(self) -> int:
        """Number of steps so far."""
        return len(self._steps)

    def trace(self, step: float, lanes: Sequence[str]) -> FleetTrace:
        """Return what was recorded.

        Args:
            step: Of the loop [s].
            lanes: Names of the lanes by their numbers.
        """
        steps = self._steps
        shots = [one.snapshot for one in steps]
        sizes = [len(one.users.ids) for one in shots]
        indices = np.array([one.index for one in steps], dtype=np.int64)
        nothing = np.empty(0, dtype=np.int64)
        return FleetTrace(
            step,
            tuple(self._numbers),
            tuple(lanes),
            np.repeat(indices, sizes),
            np.concatenate([nothing, *self._columns]),
            np.concatenate([nothing, *(one.group for one in steps)]),
            np.concatenate([nothing, *(one.lane for one in shots)]),
            np.hstack([np.empty((8, 0)), *(one.users.table for one in shots)]),
            np.hstack(
                [
                    np.empty((4, 0)),
                    *(
                        np.vstack([x.position, x.wished_speed, x.fuel, x.co2])
                        for x in shots
                    ),
                ]
            ),
            np.array([one.time for one in shots]),
            np.array([one.pending for one in shots], dtype=np.int64),
            np.array([one.cpu_s for one in steps]),
            indices,
            tuple((one.index, x) for one in steps for x in one.egos),
            tuple(x for one in steps for x in one.leavings),
        )


def fleet_tables(trace: FleetTrace) -> Mapping[str, Table]:
    """Return the tables of a run, all but the timing."""
    names = np.array(trace.ids, dtype=object)
    lanes = np.array([*trace.lanes, None], dtype=object)
    t, numbers = trace.table, trace.numbers
    egos = trace.egos
    return {
        "fleet": _table(
            "fleet",
            trace.index,
            names[trace.vehicle],
            trace.group,
            lanes[trace.lane],
            numbers[0],
            *(t[k] for k in (0, 1, 2, 3, 4, 6, 7)),
            *numbers[1:],
        ),
        "egos": _table(
            "egos",
            [index for index, _ in egos],
            [x.id for _, x in egos],
            [x.group for _, x in egos],
            *(
                [getattr(x.ego, name) for _, x in egos]
                for name in ("x", "y", "heading", "curvature", "speed", "acceleration")
            ),
            [x.status or None for _, x in egos],
            [x.clearance if np.isfinite(x.clearance) else np.nan for _, x in egos],
            [x.off_road for _, x in egos],
            [json.dumps(x.contacts) for _, x in egos],
        ),
        "ego_ends": _table(
            "ego_ends",
            *(
                [getattr(x, name) for x in trace.leavings]
                for name in ("index", "id", "how", "reason")
            ),
        ),
        "fleet_steps": _table(
            "fleet_steps",
            trace.step_index.tolist(),
            trace.time,
            trace.pending,
        ),
    }


def _table(name: str, *values: object) -> Table:
    """Return a table from its columns in order."""
    kinds = FLEET_TABLES[name]
    return {
        key: column(value, kind)
        for (key, kind), value in zip(kinds.items(), values, strict=True)
    }


def timing_table(trace: FleetTrace) -> Table:
    """Return how long the steps took."""
    place = np.searchsorted(trace.step_index, [index for index, _ in trace.egos])
    spent = np.nan_to_num([one.planning_ms for _, one in trace.egos])
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


def write_fleet(tables: Mapping[str, Table], timing: Table, folder: Path) -> None:
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
        ]
    )


def is_ego(trace: FleetTrace) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Mark the rows that are of egos, (n,)."""
    return np.asarray(trace.group != HUMAN)
