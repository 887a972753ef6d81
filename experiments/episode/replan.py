"""Plans a recorded cycle again, from its run folder alone.

The scene of a cycle is rebuilt from the trace (road, signals, vehicles, ego) and from
the run's configuration (vehicle, predictor, planner). A planner's memory is not
recorded: it is whatever the planner likes. So all cycles from the first one on are
planned again in order, each with the memory of the one before; `Planner.plan` is a
function of scene and memory, so that the plans must be those of the run, bit by bit.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.config import Scenario
from experiments.config.scenario_file import CONFIG_FILE, load_scenario
from experiments.cosim.perception.perceive import reckoned
from experiments.cosim.planning import FAILURES_OF_THE_PLANNER
from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.replay_world import ReplayWorld
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.scene_builder import Outlook, build_scene
from experiments.episode.run import make_scenario_planner
from experiments.errors import ConfigError
from experiments.storage.atomic_folder import require_there
from experiments.trace.files import read_trace
from experiments.trace.junction_tables import (
    read_foes,
    read_junctions,
    read_lines,
    read_ways,
)
from experiments.trace.recording import PLAN_COLUMNS, plan_cells
from experiments.trace.schema import ROAD_USER_COLUMNS, Column, Table, Trace
from experiments.world_setup.closures import closure_of
from experiments.world_setup.ego_vehicle import ego_task
from experiments.world_setup.layout import make_layout
from experiments.world_setup.vehicle_model import planned_body
from experiments.world_setup.world import replay_world
from planner.interface import PlanResult
from planner.prediction import PREDICTORS, constant_speed
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.scene import (
    Lanes,
    Obstacles,
    RoadBounds,
    RoadUsers,
    Scene,
    SpeedLimits,
)
from planner.states import BoolArray, CartesianState, FloatArray, FrenetState

SOLID_RIGHT = 2  # bit of a lane that may not be left to the right

_EGO_COLUMNS = (
    "x_m",
    "y_m",
    "heading_rad",
    "curvature_1pm",
    "speed_mps",
    "acceleration_mps2",
)
_FRENET_COLUMNS = (
    "s_m",
    "s_dot_mps",
    "s_ddot_mps2",
    "l_m",
    "l_dot_mps",
    "l_ddot_mps2",
    "l_prime",
    "l_second_1pm",
)
# of the steps, about a plan, in the order of `plan_cells`
_CELLS = (
    "plan_status",
    "reason",
    "candidates",
    "survivors",
    "removed",
    "costs",
    "blocker",
    "explanation",
)


def replan(
    folder: Path, step: int, allow_planners: Collection[str] = ()
) -> tuple[str, ...]:
    """Plan a recorded cycle again and compare the plans.

    Args:
        folder: Of a run with its trace.
        step: Index of the step.
        allow_planners: Modules of users' planners that may be run.

    Returns:
        One line for each column that differs; empty if the plans are the same.

    Raises:
        ConfigError: If nothing was planned in that step, or the run's planner or
            configuration cannot be read.
        ResultsError: If the trace is missing, damaged or of another schema version.
    """
    recorded = Recorded.read(folder, allow_planners)
    recorded.check_planned(step)
    planner = make_scenario_planner(recorded.scenario)
    plan: PlanResult | None = None
    for scene in recorded.scenes(step):
        with FAILURES_OF_THE_PLANNER:
            plan = planner.plan(scene, None if plan is None else plan.memory)
    return recorded.differences(step, plan)


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A recorded run, with the scenes that its planner got."""

    scenario: Scenario
    trace: Trace
    road: Road
    task: EgoTask
    outlook: Outlook
    lines: tuple[FloatArray, ...]  # ways of vehicles
    replayed: ReplayWorld | None = None  # that knew the future

    @classmethod
    def read(cls, folder: Path, allow_planners: Collection[str] = ()) -> "Recorded":
        """Read the run of a folder.

        Raises:
            ConfigError: If its configuration cannot be read.
            ResultsError: If its trace is missing, damaged or of another version.
        """
        require_there(folder)
        trace = read_trace(folder)
        config = str(folder / CONFIG_FILE)
        scenario = load_scenario(config, allow_planners=allow_planners)
        simulation = scenario.simulation
        predictor = PREDICTORS.get(simulation.predictor, constant_speed)
        period = simulation.planning_period_s or simulation.step_s
        outlook = Outlook(period, simulation.horizon_s, predictor)
        lines = read_lines(trace.ways)
        world = None
        if scenario.world == "commonroad":
            layout = make_layout(scenario)
            task, world = layout.task, replay_world(scenario, layout)
        else:
            task = ego_task(scenario.ego)
        body = planned_body(scenario) or task.vehicle
        task = replace(task, vehicle=body)
        road = replace(_road(trace), closure=closure_of(scenario.obstacles))
        return cls(scenario, trace, road, task, outlook, lines, world)

    def check_planned(self, step: int) -> None:
        """Raise a ConfigError unless a plan was recorded in a step."""
        planned = np.flatnonzero(self._planned())
        if step not in planned:
            allowed = f"0 to {planned[-1]}" if planned.size else "nothing was planned"
            if planned.size and planned.size <= planned[-1]:
                allowed += ", in the steps of the planning period"
            raise ConfigError(f"--step: is {step}; allowed: {allowed}")

    def _planned(self) -> BoolArray:
        """Mark the steps in which something was planned, (n_steps,)."""
        return ~np.ma.getmaskarray(self.trace.steps["plan_status"])

    def scenes(self, last: int) -> Iterator[Scene]:
        """Yield the scenes of all cycles from the first one to `last`."""
        steps, vehicles, signals = (
            self.trace.steps,
            self.trace.vehicles,
            self.trace.signals,
        )
        ego, places = (
            np.column_stack([_numbers(steps, name) for name in names]).tolist()
            for names in (_EGO_COLUMNS, _FRENET_COLUMNS)
        )
        times = steps["time_s"].tolist()
        table = np.array([_numbers(vehicles, name) for name in ROAD_USER_COLUMNS])
        believed = _Believed(self.trace)
        for k in np.flatnonzero(self._planned()[: last + 1]).tolist():
            rows = _rows_of(vehicles, k)
            ids = tuple(vehicles["id"][rows].tolist())
            users = RoadUsers.from_table(ids, table[:, rows].copy())
            lights = _signals(signals, _rows_of(signals, k))
            state, place = CartesianState(*ego[k]), FrenetState(*places[k])
            start, lead = believed.start(self.road.path, k, state, place)
            seen = believed.users(k, users, self.scenario.ego.perception is not None)
            junctions = self._junctions(k, seen.ids)
            if "ways" in junctions and (seen is not users or lead > 0.0):
                junctions["ways"] = junctions["ways"].later(seen.speed * lead)
            traffic = TrafficState(times[k], reckoned(seen, lead), lights, **junctions)
            if self.replayed is not None:
                future = self.replayed.moment(k).future
                future = None if future is None else future.later(lead)
                traffic = replace(traffic, future=future)
            lines = tuple(json.loads(steps["stop_lines"][k]))
            yield build_scene(
                self.road, self.task, self.outlook, traffic, *start, lines
            )

    def _junctions(self, step: int, ids: tuple[str, ...]) -> dict[str, Any]:
        """Restore what a step had to do with junctions: fields of a traffic state."""
        trace = self.trace
        junctions = read_junctions(trace.junctions, _rows_of(trace.junctions, step))
        if not junctions:
            return {}
        foes = read_foes(trace.foes, _rows_of(trace.foes, step))
        rows = _rows_of(trace.vehicle_ways, step)
        ways = read_ways(trace.vehicle_ways, rows, ids, self.lines)
        return {"junctions": junctions, "foes": foes, "ways": ways}

    def differences(self, step: int, plan: PlanResult | None) -> tuple[str, ...]:
        """Compare a plan with the recorded one; one line for each difference."""
        if plan is None or plan.trajectory is None:
            return ("there is no trajectory",)
        found = [
            f"{name} was {was!r}, is {now!r}"
            for name, now in zip(_CELLS, plan_cells(plan), strict=True)
            if (was := _cell(self.trace.steps[name], step)) != now
        ]
        plans = self.trace.plans
        rows = _rows_of(plans, step)
        for name, field in PLAN_COLUMNS.items():
            was, now = _numbers(plans, name)[rows], getattr(plan.trajectory, field)
            if was.shape != now.shape:
                found.append(f"{name} had {was.size} points, has {now.size}")
            elif not np.array_equal(was, now):
                found.append(f"{name} differs by up to {np.abs(was - now).max():.3g}")
        return tuple(found)


class _Believed:
    """What a trace holds of plans' starts and of perceived vehicles."""

    def __init__(self, trace: Trace) -> None:
        starts, self._seen = trace.starts, trace.perceived
        columns = [_numbers(starts, name).tolist() for name in _EGO_COLUMNS]
        states = [CartesianState(*row) for row in zip(*columns, strict=True)]
        leads = _numbers(starts, "lead_s").tolist()
        index = starts["index"].tolist()
        self._starts = dict(zip(index, zip(states, leads, strict=True), strict=True))
        table = [_numbers(self._seen, name) for name in ROAD_USER_COLUMNS]
        self._table = np.array(table)

    def start(
        self, path: ReferencePath, step: int, ego: CartesianState, place: FrenetState
    ) -> tuple[tuple[CartesianState, FrenetState], float]:
        """Return where the plan of a step began, in both frames, and its lead [s]."""
        if step not in self._starts:
            return (ego, place), 0.0
        state, lead = self._starts[step]
        return (state, cartesian_to_frenet_one(path, state, place.s)), lead

    def users(self, step: int, there: RoadUsers, perceives: bool) -> RoadUsers:  # noqa: FBT001 - of the scenario
        """Return the road users that were planned with."""
        if not perceives:
            return there
        rows = _rows_of(self._seen, step)
        ids = tuple(self._seen["id"][rows].tolist())
        return RoadUsers.from_table(ids, self._table[:, rows].copy())


def _road(trace: Trace) -> Road:
    """Restore the road; the stop lines are those of the signals of each step."""
    path, bounds, lanes, bodies = trace.path, trace.bounds, trace.lanes, trace.obstacles
    return Road(
        ReferencePath(
            _numbers(path, "s_m"),
            _numbers(path, "x_m"),
            _numbers(path, "y_m"),
            _numbers(path, "heading_rad"),
            _numbers(path, "curvature_1pm"),
            _numbers(path, "curvature_rate_1pm2"),
        ),
        RoadBounds(*(_numbers(bounds, name) for name in bounds)),
        _lanes(lanes),
        obstacles=Obstacles(
            tuple(bodies["id"].tolist()),
            *(_numbers(bodies, name) for name in bodies if name != "id"),
        ),
        speed_limits=SpeedLimits(
            _numbers(trace.speed_limits, "s_m"),
            np.ma.filled(trace.speed_limits["limit_mps"], np.inf),
        ),
    )


def _lanes(table: Table) -> Lanes:
    """Restore the lanes."""
    if not table["lane"].size:
        return Lanes.none()
    n_lanes = int(table["lane"].max()) + 1
    s, centre, width = (
        _numbers(table, name).reshape(n_lanes, -1)
        for name in ("s_m", "centre_m", "width_m")
    )
    left_hand = bool(table["left_hand"].any())
    solid = np.ma.getdata(table["solid"]).astype(int).reshape(n_lanes, -1)
    return Lanes(s[0], centre, width, left_hand, solid % 2 == 1, solid >= SOLID_RIGHT)


def _signals(table: Table, rows: slice) -> tuple[Signal, ...]:
    """Restore the signals of one step."""
    columns = (table[name][rows].tolist() for name in ("id", "stop_m", "state"))
    return tuple(Signal(*row) for row in zip(*columns, strict=True))


def _rows_of(table: Mapping[str, Column], step: int) -> slice:
    """Return the rows of a step in a table that is sorted by step."""
    first, last = np.searchsorted(table["index"], (step, step + 1))
    return slice(int(first), int(last))


def _numbers(table: Table, name: str) -> FloatArray:
    """Return a column of numbers; null is NaN."""
    numbers: FloatArray = np.ma.filled(table[name], np.nan)
    return numbers


def _cell(values: Column, row: int) -> Any:
    """Return a cell as a plain value; null is None."""
    return None if np.ma.getmaskarray(values)[row] else values[row]
