"""Turns the step records of an episode into its trace."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from operator import attrgetter
from typing import Any

import numpy as np

from experiments.cosim.records import (
    Ending,
    PlanStart,
    StepRecord,
    TrafficState,
    VehicleLook,
)
from experiments.cosim.road import EgoTask, Road
from experiments.trace.junction_tables import (
    foe_table,
    junction_table,
    vehicle_way_table,
    way_table,
)
from experiments.trace.road_tables import (
    bounds_table,
    lane_table,
    obstacle_table,
    path_table,
    road_table,
    speed_limit_table,
)
from experiments.trace.schema import (
    Table,
    Trace,
)
from experiments.trace.table_rows import from_arrays, from_rows
from planner.interface import PlanResult
from planner.reference_path.frenet import FRENET_REACH, MIN_STRETCH
from planner.reference_path.path import ReferencePath
from planner.scene import COLUMNS
from planner.states import FloatArray
from planner.vehicle import Vehicle

N_PLAN_CELLS = 8  # about a plan, in a row of a step
# column of the table of plans -> field of a trajectory, in their order
PLAN_COLUMNS = {
    "t_s": "t",
    "x_m": "x",
    "y_m": "y",
    "heading_rad": "heading",
    "speed_mps": "speed",
    "s_m": "s",
    "l_m": "l",
}


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Name, planner, seed and time step of a run."""

    scenario: str
    planner: str
    seed: int
    step: float  # [s]


def build_trace(
    facts: RunFacts,
    road: Road,
    task: EgoTask,
    records: Sequence[StepRecord],
    ending: Ending,
    elapsed: Sequence[float],
) -> Trace:
    """Build the tables of an episode.

    Args:
        facts: About the run.
        road: Of the episode.
        task: Of the ego.
        records: One for each step, in order.
        ending: How it ended.
        elapsed: Wall clock at each record, (n_steps,) [s].

    Returns:
        The trace.
    """
    return Trace(
        episode=_episode(facts, task, ending),
        steps=_steps(road.path, task.vehicle, records),
        vehicles=vehicle_table(road.path, [(r.index, r.traffic) for r in records]),
        plans=_plans(records),
        obstacles=obstacle_table(road.obstacles),
        signals=_signals(records),
        road=road_table(road),
        path=path_table(road.path),
        bounds=bounds_table(road.bounds),
        speed_limits=speed_limit_table(road.speed_limits),
        lanes=lane_table(road.lanes),
        junctions=junction_table(records),
        foes=foe_table(records),
        vehicle_ways=vehicle_way_table(records),
        ways=way_table(records),
        timing=from_rows(
            "timing",
            [
                (r.index, *planning_cells(r), at)
                for r, at in zip(records, elapsed, strict=True)
            ],
        ),
        tracking=from_rows(
            "tracking",
            [(r.index, *_numbers(r.tracking)) for r in records if r.tracking],
        ),
        starts=from_rows(
            "starts", [_start_row(r.index, r.start) for r in records if r.start]
        ),
        perceived=_perceived(records),
        looks=_looks(records),
        driver_errors=from_rows(
            "driver_errors",
            [(r.index, *error) for r in records for error in r.traffic.erring],
        ),
        weights=from_rows(
            "weights",
            [
                (r.index, r.traffic.log_weight)
                for r in records
                if r.traffic.log_weight is not None
            ],
        ),
    )


def _episode(facts: RunFacts, task: EgoTask, ending: Ending) -> Table:
    """Make the one row about the episode."""
    vehicle = task.vehicle
    row = (
        facts.scenario,
        facts.planner,
        facts.seed,
        str(ending.status),
        ending.reason,
        facts.step,
        task.goal,
        task.target_speed,
        vehicle.length,
        vehicle.width,
        vehicle.wheelbase,
        vehicle.rear_overhang,
    )
    return from_rows("episode", [row])


def _steps(
    path: ReferencePath, vehicle: Vehicle, records: Sequence[StepRecord]
) -> Table:
    """Make one row a step."""
    ego = np.array(
        [(r.ego.x, r.ego.y, r.ego.heading) for r in records], dtype=np.float64
    ).reshape(-1, 3)
    near = np.array([r.ego_frenet.s if r.ego_frenet else math.nan for r in records])
    framed = np.isfinite(near)
    offset = vehicle.centre_offset
    centre = np.full((len(records), 3), np.nan)
    if framed.any():
        x, y, heading = ego[framed].T
        centre[framed] = np.column_stack(
            _place_ego(path, x, y, heading, offset, near[framed])
        )
    return from_rows(
        "steps",
        [_step_row(r, tuple(c)) for r, c in zip(records, centre.tolist(), strict=True)],
    )


def _place_ego(
    path: ReferencePath,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    offset: float,
    near: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (s, l) of the ego's centre and its heading against the path."""
    s, l = path.project(
        x + offset * np.cos(heading), y + offset * np.sin(heading), near=near
    )
    error = heading - path.at(near).heading
    return s, l, np.arctan2(np.sin(error), np.cos(error))


def _step_row(record: StepRecord, centre: tuple[float, ...]) -> tuple[Any, ...]:
    """Make the row of one step."""
    frenet = record.ego_frenet
    ghost = record.traffic.ghost
    return (
        record.index,
        record.time,
        *_numbers(record.ego),
        *((math.nan,) * 8 if frenet is None else _numbers(frenet)),
        *centre,
        *((None,) * N_PLAN_CELLS if record.plan is None else plan_cells(record.plan)),
        min(record.stop_lines, default=math.nan),
        _as_json(record.stop_lines),
        record.gives_way_to,
        record.clearance if math.isfinite(record.clearance) else math.nan,
        record.nearest,
        _as_json(list(record.contacts)),
        record.off_road,
        *((math.nan,) * 3 if ghost is None else (ghost.x, ghost.y, ghost.heading)),
    )


def _start_row(index: int, start: PlanStart) -> tuple[Any, ...]:
    """Make the row of a plan that begins elsewhere than the ego is."""
    return (index, str(start.kind), *_numbers(start.state), start.lead)


def _perceived(records: Sequence[StepRecord]) -> Table:
    """Make one row for each vehicle that the ego believed in, in each step."""
    seen = [(r.index, r.seen) for r in records if r.seen is not None]
    index = np.repeat([number for number, _ in seen], [len(u.ids) for _, u in seen])
    ids = [name for _, users in seen for name in users.ids]
    columns = np.concatenate(
        [np.empty((len(COLUMNS), 0)), *(users.table for _, users in seen)], axis=1
    )
    return from_arrays("perceived", index, ids, *columns)


def _looks(records: Sequence[StepRecord]) -> Table:
    """Make one row for each vehicle first seen, and for each change of its lights."""
    last: dict[str, VehicleLook] = {}
    rows = []
    for record in records:
        for name in record.traffic.vehicles.ids:
            look = record.traffic.looks.get(name)
            if look is not None and last.get(name) != look:
                last[name] = look
                rows.append((record.index, name, *look))
    return from_rows("looks", rows)


def _numbers(state: Any) -> tuple[float, ...]:
    """Return the numbers of a record of scalars."""
    kind: Any = type(state)
    return _reader_of(kind)(state)


@cache
def _reader_of(kind: type) -> Callable[[Any], tuple[float, ...]]:
    """Return what reads all fields of a record of a class."""
    return attrgetter(*(f.name for f in fields(kind)))


def _as_json(values: Any) -> str:
    """Encode values; there are none in most steps."""
    if not values:
        return "{}" if isinstance(values, Mapping) else "[]"
    return json.dumps(values, sort_keys=True)


def planning_cells(record: StepRecord) -> tuple[float | None, float | None]:
    """Make the cells about the time of planning, wall clock and CPU [ms]."""
    timing = record.planning
    return (None, None) if timing is None else (timing.wall_ms, timing.cpu_ms)


def plan_cells(plan: PlanResult) -> tuple[object, ...]:
    """Make the cells about a plan, from plan_status to explanation."""
    stats = plan.stats
    return (
        str(plan.status),
        stats.reason,
        stats.candidates,
        stats.survivors,
        _as_json(dict(stats.removed)),
        _as_json({k: float(v) for k, v in stats.costs.items()}),
        stats.blocker,
        stats.explanation,
    )


def vehicle_table(
    path: ReferencePath, moments: Sequence[tuple[int, TrafficState]]
) -> Table:
    """Make one row for each vehicle in each step."""
    users = [state.vehicles for _, state in moments]
    index = np.repeat([number for number, _ in moments], [len(u.ids) for u in users])
    ids = [name for u in users for name in u.ids]
    columns = np.concatenate(
        [np.empty((len(COLUMNS), 0)), *(u.table for u in users)], axis=1
    )
    x, y, heading, speed, *rest = columns
    places = _place_vehicles(path, x, y, heading, speed)
    return from_arrays("vehicles", index, ids, x, y, heading, speed, *rest, *places)


def _place_vehicles(
    path: ReferencePath,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    speed: FloatArray,
) -> tuple[FloatArray, ...]:
    """Return (s, l, s_dot, l_dot, heading error), NaN where there is no Frenet frame.

    Predictions have places of their own: they cover fewer vehicles, and do not use
    the heading, which decides between two legs of the path that are about as near.
    """
    if x.size == 0:
        return (x,) * 5
    s, l = path.project(x, y, heading=heading)
    foot = path.at(s)
    error = np.arctan2(np.sin(heading - foot.heading), np.cos(heading - foot.heading))
    stretch = 1.0 - foot.curvature * l
    framed = (np.abs(l) <= FRENET_REACH) & (stretch >= MIN_STRETCH)
    rates = speed * np.cos(error) / np.where(framed, stretch, 1.0)
    places = (s, l, rates, speed * np.sin(error), error)
    return tuple(np.where(framed, place, np.nan) for place in places)


def _plans(records: Sequence[StepRecord]) -> Table:
    """Make one row for each point of each plan."""
    plans = [
        (r.index, r.plan.trajectory)
        for r in records
        if r.plan is not None and r.plan.trajectory is not None
    ]
    sizes = [trajectory.t.size for _, trajectory in plans]

    def joined(name: str) -> FloatArray:
        parts = [getattr(trajectory, name) for _, trajectory in plans]
        return np.concatenate(parts) if parts else np.empty(0)

    index = np.repeat([number for number, _ in plans], sizes)
    k = [number for size in sizes for number in range(size)]
    return from_arrays("plans", index, k, *map(joined, PLAN_COLUMNS.values()))


def _signals(records: Sequence[StepRecord]) -> Table:
    """Make one row for each signal in each step."""
    return from_rows(
        "signals",
        [
            (r.index, signal.id, signal.stop_s, signal.state)
            for r in records
            for signal in r.traffic.signals
        ],
    )
