"""One episode: configuration -> world -> loop -> metrics -> a row and a run folder."""

import json
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import yaml

from experiments import manifest
from experiments.config import Scenario
from experiments.cosim.loop import LoopSettings, run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import Ending, EpisodeStatus, StepRecord
from experiments.doctor import check_simulator
from experiments.errors import ConfigError
from experiments.layout import Layout, make_layout, make_vehicle
from experiments.metrics.row import Cell, metric_row
from experiments.planners import make_planner, planner_source
from experiments.recording import Setting, build_trace
from experiments.road_map import RoadMap, map_around, write_map
from experiments.run_folder import whole_folder
from experiments.scenario_file import CONFIG_FILE, config_hash
from experiments.trace import SCHEMA_VERSION, Trace, trace_hash
from experiments.trace_files import write_trace
from experiments.worlds import make_world
from planner.interface import Planner
from planner.scene import Lanes

RUNS = Path("runs")
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
class Place:
    """Where a run folder is filled, and where it will be."""

    aside: Path
    target: Path


@dataclass(slots=True)
class _Recorder:
    """Keeps every step and when it came."""

    forward: OnStep | None
    records: list[StepRecord] = field(default_factory=list)
    elapsed: list[float] = field(default_factory=list)
    started: float | None = None

    def __call__(self, record: StepRecord) -> None:
        """Take one step."""
        now = perf_counter()
        self.started = now if self.started is None else self.started
        self.records.append(record)
        self.elapsed.append(now - self.started)
        if self.forward is not None:
            self.forward(record)


def run_episode(
    scenario: Scenario,
    *,
    out: Path = RUNS,
    gui: bool = False,
    on_step: OnStep | None = None,
) -> Outcome:
    """Run a scenario and leave its run folder `<scenario>-<planner>-<seed>-<hash>`.

    Args:
        scenario: Checked.
        out: Where run folders go.
        gui: Show SUMO's window.
        on_step: Gets every step, for a progress display.

    Returns:
        The outcome; failures of planner and simulator are outcomes too.

    Raises:
        ConfigError: If the scenario cannot be run as written.
        SimulationError: If the simulator cannot be loaded.
        ResultsError: If the run folder cannot be written.
    """
    layout = make_layout(scenario)
    if layout.network is not None:
        check_simulator()
    planner = make_scenario_planner(scenario)
    road_map = _road_map(layout)
    recorder = _Recorder(on_step)
    identity = _identity(scenario, layout)
    target = out / _folder_name(scenario, identity["run_hash"])
    with whole_folder(target) as folder:
        world = make_world(scenario, layout, folder, gui=gui)
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
        write_map(road_map, folder)
        return _leave(scenario, identity, ending, trace, Place(folder, target))


def record_crash(scenario: Scenario, reason: str, out: Path = RUNS) -> Outcome:
    """Leave the run folder of an episode whose process died.

    Its trace holds no steps: they died with the process.
    """
    layout = make_layout(scenario)
    ending = Ending(EpisodeStatus.CRASHED, reason)
    identity = _identity(scenario, layout)
    target = out / _folder_name(scenario, identity["run_hash"])
    trace = build_trace(_setting(scenario, layout), [], ending, [])
    road_map = _road_map(layout)
    with whole_folder(target) as folder:
        write_map(road_map, folder)
        return _leave(scenario, identity, ending, trace, Place(folder, target))


def make_scenario_planner(scenario: Scenario) -> Planner:
    """Make the scenario's planner; a mistake names the scenario file."""
    choice = scenario.planner
    try:
        return make_planner(choice.name, choice.settings)
    except ConfigError as error:
        key, _, problem = str(error).partition(": ")
        raise scenario.error(tuple(key.split(".")), problem) from error


def _leave(
    scenario: Scenario,
    identity: dict[str, Any],
    ending: Ending,
    trace: Trace,
    place: Place,
) -> Outcome:
    """Measure an episode and write everything about it."""
    row = metric_row(trace)
    hashed = trace_hash(trace)
    write_trace(trace, place.aside)
    _write_json(place.aside / "metrics.json", row)
    command = ["rearview", "run", f"{place.target}/{CONFIG_FILE}"]
    about = {
        **identity,
        "trace_schema": SCHEMA_VERSION,
        "trace_hash": hashed,
        "status": str(ending.status),
        "reason": ending.reason,
        "command": shlex.join([*command, "--out", str(place.target.parent)]),
    }
    _write_json(place.aside / "manifest.json", about)
    _write_config(place.aside / CONFIG_FILE, scenario)
    return Outcome(ending, row, trace, hashed, place.target)


def _road_map(layout: Layout) -> RoadMap:
    """Collect the lanes about the ego's route for pictures."""
    return map_around(layout.path, layout.network.net_file if layout.network else None)


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


def _identity(scenario: Scenario, layout: Layout) -> dict[str, Any]:
    """Say what the run is made from, and hash that."""
    configuration = config_hash(scenario.resolved())
    network = manifest.file_hash(layout.network.net_file) if layout.network else None
    code = manifest.code_hash()
    source = planner_source(scenario.planner.name)
    planner = manifest.file_hash(source) if source else None
    parts = f"{configuration} {network} {code} {planner}"
    return {
        "run_hash": manifest.text_hash(parts),
        "config_hash": configuration,
        "network_hash": network,
        "code_hash": code,
        "planner_hash": planner,
        "scenario": scenario.name,
        "planner": scenario.planner.name,
        "seed": scenario.simulation.seed,
        "versions": manifest.versions(),
        "git": manifest.git_state(),
    }


def _folder_name(scenario: Scenario, run_hash: str) -> str:
    """Name the run folder."""
    planner = "".join(
        c if c.isalnum() or c in "_." else "_" for c in scenario.planner.name
    )
    seed = scenario.simulation.seed
    return f"{scenario.name}-{planner}-{seed}-{run_hash[:ID_LENGTH]}"


def _write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON to be read by people too."""
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def _write_config(path: Path, scenario: Scenario) -> None:
    """Write the resolved configuration."""
    text = yaml.safe_dump(scenario.resolved(), sort_keys=False, allow_unicode=True)
    path.write_text(text, encoding="utf-8")
