"""Turns the step records of an episode into its trace."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from experiments.cosim.records import Ending, StepRecord, TrafficState
from experiments.trace.schema import TABLES, TIMING, Column, Table, Trace, column
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.states import FloatArray
from planner.vehicle import Vehicle

FRENET_REACH = 40.0  # farther from the path a vehicle has no Frenet place [m]
MIN_STRETCH = 0.2  # 1 - kappa l below which the Frenet frame is left
ROAD_SPACING = 1.0  # between recorded points of the road [m]


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What does not change during an episode."""

    scenario: str
    planner: str
    seed: int
    step: float  # [s]
    goal: float  # [m]
    target_speed: float  # [m/s]
    vehicle: Vehicle
    path: ReferencePath
    road: RoadBounds
    obstacles: Obstacles


def build_trace(
    setting: Setting,
    records: Sequence[StepRecord],
    ending: Ending,
    elapsed: Sequence[float],
) -> Trace:
    """Lay out an episode as tables.

    Args:
        setting: What did not change.
        records: One for each step, in order.
        ending: How it ended.
        elapsed: Wall clock at each record, (n_steps,) [s].

    Returns:
        The trace.
    """
    return Trace(
        episode=_episode(setting, ending),
        steps=_steps(setting, records),
        vehicles=vehicle_table(setting.path, [(r.index, r.traffic) for r in records]),
        plans=_plans(records),
        obstacles=_obstacles(setting.obstacles),
        signals=_signals(records),
        road=_road(setting.path, setting.road),
        timing=_from_rows(
            "timing",
            [
                (r.index, r.planning_ms, at)
                for r, at in zip(records, elapsed, strict=True)
            ],
        ),
    )


def _from_rows(name: str, rows: Sequence[tuple[Any, ...]]) -> Table:
    """Turn rows into the columns of a table; None is null."""
    kinds = TIMING if name == "timing" else TABLES[name]
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(kinds)
    return {
        key: column(values, kind)
        for (key, kind), values in zip(kinds.items(), columns, strict=True)
    }


def _from_arrays(name: str, *arrays: Column | Sequence[object]) -> Table:
    """Name columns that are there already."""
    return {
        key: column(values, kind)
        for (key, kind), values in zip(TABLES[name].items(), arrays, strict=True)
    }


def _episode(setting: Setting, ending: Ending) -> Table:
    """Make the one row about the episode."""
    vehicle = setting.vehicle
    row = (
        setting.scenario,
        setting.planner,
        setting.seed,
        str(ending.status),
        ending.reason,
        setting.step,
        setting.goal,
        setting.target_speed,
        vehicle.length,
        vehicle.width,
        vehicle.wheelbase,
        vehicle.rear_overhang,
    )
    return _from_rows("episode", [row])


def _steps(setting: Setting, records: Sequence[StepRecord]) -> Table:
    """Make one row a step."""
    ego = np.array(
        [(r.ego.x, r.ego.y, r.ego.heading) for r in records], dtype=np.float64
    ).reshape(-1, 3)
    near = np.array([r.ego_frenet.s if r.ego_frenet else math.nan for r in records])
    framed = np.isfinite(near)
    offset = setting.vehicle.centre_offset
    centre = np.full((len(records), 3), np.nan)
    if framed.any():
        x, y, heading = ego[framed].T
        centre[framed] = np.column_stack(
            _place_ego(setting.path, x, y, heading, offset, near[framed])
        )
    return _from_rows(
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
    """Give (s, l) of the ego's centre and its heading against the path."""
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
        *(getattr(record.ego, f.name) for f in fields(record.ego)),
        *((math.nan,) * 8 if frenet is None else _numbers(frenet)),
        *centre,
        *_plan_cells(record),
        min(record.stop_lines, default=math.nan),
        record.clearance if math.isfinite(record.clearance) else math.nan,
        record.nearest,
        json.dumps(list(record.contacts)),
        record.off_road,
        *((math.nan,) * 3 if ghost is None else (ghost.x, ghost.y, ghost.heading)),
    )


def _numbers(state: Any) -> tuple[float, ...]:
    """Give the numbers of a record of scalars."""
    return tuple(getattr(state, f.name) for f in fields(state))


def _plan_cells(record: StepRecord) -> tuple[object, ...]:
    """Make the cells about the plan, from plan_status to explanation."""
    if record.plan is None:
        return (None,) * 8
    stats = record.plan.stats
    return (
        str(record.plan.status),
        stats.reason,
        stats.candidates,
        stats.survivors,
        json.dumps(dict(stats.removed), sort_keys=True),
        json.dumps({k: float(v) for k, v in stats.costs.items()}, sort_keys=True),
        stats.blocker,
        stats.explanation,
    )


def vehicle_table(
    path: ReferencePath, moments: Sequence[tuple[int, TrafficState]]
) -> Table:
    """Make one row for each vehicle in each step."""
    traffic = [state for _, state in moments]
    index = np.repeat([number for number, _ in moments], [len(t.ids) for t in traffic])
    ids = [name for t in traffic for name in t.ids]
    names = ("x", "y", "heading", "speed", "acceleration", "length", "width")
    columns = {
        name: np.concatenate([getattr(t, name) for t in traffic] or [np.empty(0)])
        for name in names
    }
    x, y, heading, speed, *rest = columns.values()
    places = _place_vehicles(path, x, y, heading, speed)
    return _from_arrays("vehicles", index, ids, x, y, heading, speed, *rest, *places)


def _place_vehicles(
    path: ReferencePath,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    speed: FloatArray,
) -> tuple[FloatArray, ...]:
    """Give (s, l, s_dot, l_dot, heading error), NaN where there is no Frenet frame."""
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
    names = ("t", "x", "y", "heading", "speed", "s", "l")
    return _from_arrays("plans", index, k, *(joined(name) for name in names))


def _obstacles(obstacles: Obstacles) -> Table:
    """Make one row for each obstacle."""
    names = ("x", "y", "heading", "length", "width", "radius")
    arrays = [getattr(obstacles, name) for name in names]
    return _from_arrays("obstacles", obstacles.ids, *arrays)


def _signals(records: Sequence[StepRecord]) -> Table:
    """Make one row for each signal in each step."""
    return _from_rows(
        "signals",
        [
            (r.index, signal.id, signal.stop_s, signal.state)
            for r in records
            for signal in r.traffic.signals
        ],
    )


def _road(path: ReferencePath, road: RoadBounds) -> Table:
    """Sample the reference path and its bounds."""
    s = np.linspace(0.0, path.length, max(int(path.length / ROAD_SPACING), 1) + 1)
    points = path.at(s)
    left, right = road.at(s)
    return _from_arrays(
        "road", s, points.x, points.y, points.heading, points.curvature, left, right
    )
