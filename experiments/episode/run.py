"""One episode: configuration -> world -> loop -> metrics -> a row and a run folder."""

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

from experiments.config import Scenario
from experiments.config.scenario_file import CONFIG_FILE, config_text
from experiments.cosim.loop import LoopSettings, run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import Ending, EpisodeStatus, StepRecord
from experiments.cosim.sumo.system_libraries import check_simulator
from experiments.cosim.world import PlanDisplay
from experiments.episode.identity import run_identity
from experiments.episode.newest_run import ENDED, RUNS
from experiments.episode.without_ego import vehicles_without_ego
from experiments.errors import ConfigError
from experiments.metrics.row import Cell, metric_row
from experiments.planners.registry import make_planner
from experiments.storage.atomic_folder import atomic_folder
from experiments.storage.run_files import MANIFEST, METRICS, write_json
from experiments.trace.candidates import CandidateLog, write_candidates
from experiments.trace.files import write_tables, write_trace
from experiments.trace.recording import Setting, build_trace
from experiments.trace.road_map import RoadMap, map_around, write_map
from experiments.trace.schema import SCHEMA_VERSION, TABLES, Table, Trace, trace_hash
from experiments.trace.speed_graphs import write_graphs
from experiments.world_setup.layout import Layout, make_layout, make_vehicle
from experiments.world_setup.world import TRAFFIC_FILE, make_world
from planner.interface import Planner, SpeedGraph
from planner.prediction import Predictor, constant_speed, held_braking
from planner.scene import Lanes
from planner.states import Trajectory

WITHOUT_EGO_FILE = "vehicles_without_ego.parquet"
PREDICTORS: Mapping[str, Predictor] = {
    "constant_speed": constant_speed,
    "held_braking": held_braking,
}
ID_LENGTH = 8  # characters of the run's hash in the folder's name

OnStep = Callable[[StepRecord], None]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What came out of an episode."""

    ending: Ending
    row: dict[str, Cell]
    trace: Trace
    trace_hash: str
    folder: Path


@dataclass(frozen=True, slots=True)
class RunFolder:
    """What the run folder of an episode is: its place, and what is in it."""

    target: Path | None = None  # instead of the usual name
    keeps_trace: Callable[[Ending], bool] = lambda _: True
    facts: Mapping[str, Any] = field(default_factory=dict)  # for the manifest
    keeps_candidates: bool = False  # of the cycles, and s-T graphs, with the trace


@dataclass(frozen=True, slots=True)
class Place:
    """Where a run folder is filled, where it will be, and since when."""

    aside: Path
    target: Path
    choice: RunFolder
    started: float  # [s], of perf_counter


@dataclass(slots=True)
class _Recorder:
    """Keeps every step and when it came."""

    forward: OnStep | None
    candidates: CandidateLog | None = None  # where they are to be kept, and graphs
    graphs: list[tuple[int, SpeedGraph]] = field(default_factory=list)
    records: list[StepRecord] = field(default_factory=list)
    elapsed: list[float] = field(default_factory=list)
    started: float | None = None
    show_plan: Callable[[Trajectory], None] | None = None  # in a window

    def __call__(self, record: StepRecord) -> None:
        """Take one step."""
        now = perf_counter()
        self.started = now if self.started is None else self.started
        self.records.append(self._lightened(record))
        self.elapsed.append(now - self.started)
        plan = record.plan.trajectory if record.plan is not None else None
        if self.show_plan is not None and plan is not None:
            self.show_plan(plan)
        if self.forward is not None:
            self.forward(record)

    def _lightened(self, record: StepRecord) -> StepRecord:
        """Take out of a plan what holds on to all that its cycle calculated."""
        plan = record.plan
        if plan is None:
            return record
        if self.candidates is not None and plan.alternatives is not None:
            self.candidates.add(record.index, plan.alternatives())
        if self.candidates is not None and plan.speed_graph is not None:
            self.graphs.append((record.index, plan.speed_graph()))
        light = replace(plan, alternatives=None, speed_graph=None)
        return replace(record, plan=light)


def run_episode(
    scenario: Scenario,
    *,
    out: Path = RUNS,
    gui: bool = False,
    on_step: OnStep | None = None,
    choice: RunFolder | None = None,
) -> Outcome:
    """Run a scenario and leave its run folder `<scenario>-<planner>-<seed>-<hash>`.

    Args:
        scenario: Checked.
        out: Where run folders go.
        gui: Show SUMO's window.
        on_step: Gets every step, for a progress display.
        choice: Another place or content of the run folder.

    Returns:
        The outcome; failures of planner and simulator are outcomes too.

    Raises:
        ConfigError: If the scenario cannot be run as written.
        SimulationError: If the simulator cannot be loaded.
        ResultsError: If the run folder cannot be written.
    """
    started = perf_counter()
    choice = choice or RunFolder()
    layout = make_layout(scenario)
    if layout.network is not None:
        check_simulator()
    planner = make_scenario_planner(scenario)
    log = CandidateLog() if choice.keeps_candidates else None
    recorder = _Recorder(on_step, log)
    identity = run_identity(scenario, _net_file(layout))
    target = choice.target or out / _folder_name(scenario, identity["run_hash"])
    with atomic_folder(target) as folder:
        world = make_world(scenario, layout, folder, gui=gui)
        if gui and isinstance(world, PlanDisplay):
            recorder.show_plan = world.show_plan
        try:
            ending = run_loop(
                world,
                planner,
                PerfectTracking(),
                _loop_settings(scenario, layout.lanes),
                recorder,
            )
        finally:
            world.close()
        trace = build_trace(
            _setting(scenario, layout), recorder.records, ending, recorder.elapsed
        )
        place = Place(folder, target, choice, started)
        if choice.keeps_trace(ending):
            write_map(_road_map(layout), folder)
            if log is not None:
                write_candidates(log, folder)
                write_graphs(recorder.graphs, folder)
        without = vehicles_without_ego(scenario, layout, trace, world, folder)
        if without is not None and choice.keeps_trace(ending):
            file = folder / WITHOUT_EGO_FILE
            write_tables([(without, TABLES["vehicles"], file)])
        return _leave(scenario, identity, ending, trace, place, without)


def record_crash(scenario: Scenario, reason: str, out: Path = RUNS) -> Outcome:
    """Leave the run folder of an episode whose process died.

    Its trace holds no steps: they died with the process.
    """
    started = perf_counter()
    layout = make_layout(scenario)
    ending = Ending(EpisodeStatus.CRASHED, reason)
    identity = run_identity(scenario, _net_file(layout))
    target = out / _folder_name(scenario, identity["run_hash"])
    trace = build_trace(_setting(scenario, layout), [], ending, [])
    road_map = _road_map(layout)
    with atomic_folder(target) as folder:
        write_map(road_map, folder)
        place = Place(folder, target, RunFolder(), started)
        return _leave(scenario, identity, ending, trace, place)


def make_scenario_planner(scenario: Scenario) -> Planner:
    """Make the scenario's planner; a mistake names the scenario file."""
    choice = scenario.planner
    try:
        return make_planner(choice.name, choice.settings)
    except ConfigError as error:
        key, _, problem = str(error).partition(": ")
        path = tuple(key.split("."))
        written = (*path, "name") if len(path) == 1 else path
        raise scenario.error(path, problem, written) from error


def _leave(
    scenario: Scenario,
    identity: dict[str, Any],
    ending: Ending,
    trace: Trace,
    place: Place,
    without_ego: Table | None = None,
) -> Outcome:
    """Measure an episode and write everything about it."""
    row = metric_row(trace, without_ego)
    hashed = trace_hash(trace)
    kept = place.choice.keeps_trace(ending)
    if kept:
        write_trace(trace, place.aside)
    else:
        (place.aside / TRAFFIC_FILE).unlink(missing_ok=True)
    write_json(place.aside / METRICS, row)
    command = ["rearview", "run", f"{place.target}/{CONFIG_FILE}"]
    about = {
        **identity,
        "trace_schema": SCHEMA_VERSION,
        "trace_hash": hashed,
        "status": str(ending.status),
        "reason": ending.reason,
        "trace_kept": kept,
        "wall_s": perf_counter() - place.started,
        ENDED: datetime.now(UTC).isoformat(),
        "command": shlex.join([*command, "--out", str(place.target.parent)]),
        **place.choice.facts,
    }
    write_json(place.aside / MANIFEST, about)
    _write_config(place.aside / CONFIG_FILE, scenario)
    return Outcome(ending, row, trace, hashed, place.target)


def _net_file(layout: Layout) -> Path | None:
    """Give the network's file, None in the world without a simulator."""
    return layout.network.net_file if layout.network else None


def _road_map(layout: Layout) -> RoadMap:
    """Collect the lanes about the ego's route for pictures."""
    return map_around(layout.path, _net_file(layout))


def _loop_settings(scenario: Scenario, lanes: Lanes) -> LoopSettings:
    """Say what the loop has to know."""
    ego, simulation = scenario.ego, scenario.simulation
    return LoopSettings(
        vehicle=make_vehicle(ego),
        target_speed=ego.target_speed_mps,
        goal_s=ego.goal_m,
        duration=simulation.duration_s,
        horizon=simulation.horizon_s,
        blocked_after=simulation.blocked_after_s,
        predictor=PREDICTORS[simulation.predictor],
        lanes=lanes,
    )


def _setting(scenario: Scenario, layout: Layout) -> Setting:
    """Say what the trace has to know beside the steps."""
    ego, simulation = scenario.ego, scenario.simulation
    return Setting(
        scenario=scenario.name,
        planner=scenario.planner.name,
        seed=simulation.seed,
        step=simulation.step_s,
        goal=ego.goal_m,
        target_speed=ego.target_speed_mps,
        vehicle=make_vehicle(ego),
        path=layout.path,
        road=layout.road,
        obstacles=layout.obstacles,
    )


def _folder_name(scenario: Scenario, run_hash: str) -> str:
    """Name the run folder."""
    planner = "".join(
        c if c.isalnum() or c in "_." else "_" for c in scenario.planner.name
    )
    seed = scenario.simulation.seed
    return f"{scenario.name}-{planner}-{seed}-{run_hash[:ID_LENGTH]}"


def _write_config(path: Path, scenario: Scenario) -> None:
    """Write the resolved configuration."""
    path.write_text(config_text(scenario.resolved()), encoding="utf-8")
