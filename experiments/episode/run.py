"""One episode: configuration -> world -> loop -> metrics -> run folder."""

from contextlib import suppress
from pathlib import Path
from time import perf_counter

from experiments.config import Scenario
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.loop import run_loop
from experiments.cosim.records import Ending, EpisodeStatus
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.cosim.world import PlanDisplay
from experiments.episode.identity import run_identity
from experiments.episode.newest_run import RUNS
from experiments.episode.recorder import OnStep, Recorder
from experiments.episode.run_folder import (
    EpisodeOutcome,
    Outcome,
    OutputOptions,
    RunOutput,
    folder_name,
    write_folder,
    write_run,
)
from experiments.episode.without_ego import vehicles_without_ego
from experiments.errors import ConfigError
from experiments.metrics.row import row_without_episode
from experiments.planners.registry import make_planner
from experiments.storage.atomic_folder import atomic_folder
from experiments.trace.candidates import CandidateLog, write_candidates
from experiments.trace.files import write_tables
from experiments.trace.recording import RunFacts, build_trace
from experiments.trace.road_map import RoadMap, lanelet_map, map_around, write_map
from experiments.trace.schema import TABLES, Trace
from experiments.trace.speed_graphs import write_graphs
from experiments.world_setup import scenario_network
from experiments.world_setup.demand_files import missed_demand
from experiments.world_setup.fleet import fleet_network
from experiments.world_setup.layout import make_layout
from experiments.world_setup.road import Layout
from experiments.world_setup.vehicle_model import (
    make_perception,
    make_plant,
    plan_timing,
    planned_body,
)
from experiments.world_setup.world import make_world
from planner.interface import Planner
from planner.prediction import PREDICTORS, constant_speed
from sumo_nets.errors import NetworkError

WITHOUT_EGO_FILE = "vehicles_without_ego.parquet"
PLACEBO_FILES = ("vehicles_placebo_1.parquet", "vehicles_placebo_2.parquet")


def run_episode(
    scenario: Scenario,
    *,
    out: Path = RUNS,
    gui: bool = False,
    on_step: OnStep | None = None,
    output: OutputOptions | None = None,
) -> EpisodeOutcome:
    """Run a scenario and write its run folder `<scenario>-<planner>-<seed>-<hash>`.

    Args:
        scenario: Checked.
        out: Where run folders go.
        gui: Show SUMO's window.
        on_step: Called with every step, for a progress display.
        output: Another place or content of the run folder.

    Returns:
        The outcome, also if planner or simulator failed.

    Raises:
        ConfigError: If the scenario cannot be run as written.
        SimulationError: If the simulator cannot be loaded.
        ResultsError: If the run folder cannot be written.
    """
    started = perf_counter()
    options = output or OutputOptions()
    planner = make_scenario_planner(scenario)  # a wrong name shows before compilation
    layout = make_layout(scenario)
    if layout.network is not None:
        load_libsumo()
        _tell_missed_demand(scenario)
    plant = make_plant(scenario)
    loop_options = episode_options(scenario, layout, options)
    log = CandidateLog() if options.keeps_candidates else None
    recorder = Recorder(on_step, log)
    identity = run_identity(scenario, _net_file(layout))
    target = options.target or out / folder_name(scenario, identity["run_hash"])
    with atomic_folder(target) as folder:
        world = make_world(scenario, layout, folder, gui=gui)
        if gui and isinstance(world, PlanDisplay):
            recorder.show_plan = world.show_plan
        try:
            ending = run_loop(
                world,
                planner,
                plant,
                layout.task,
                loop_options,
                recorder,
            )
        finally:
            world.close()
        trace = _trace(scenario, layout, recorder, ending)
        place = RunOutput(folder, target, options, started)
        if options.keeps_trace(ending):
            write_map(road_map(layout), folder)
            if log is not None:
                write_candidates(log, folder)
                write_graphs(recorder.graphs, folder)
        runs_without = []
        files: list[tuple[int | None, str]]
        files = [(None, WITHOUT_EGO_FILE), *enumerate(PLACEBO_FILES)]
        for placebo, name in files:
            table = vehicles_without_ego(
                scenario,
                layout,
                trace,
                world,
                folder,
                placebo=placebo,
                shared=options.shared,
            )
            if table is not None and options.keeps_trace(ending):
                write_tables([(table, TABLES["vehicles"], folder / name)])
            runs_without.append(table)
        return write_run(scenario, identity, ending, trace, place, runs_without)


def record_crash(scenario: Scenario, reason: str, out: Path = RUNS) -> Outcome:
    """Write the run folder of an episode whose process died.

    Its trace has no steps: they were lost with the process.
    """
    started = perf_counter()
    ending = Ending(EpisodeStatus.CRASHED, reason)
    if scenario.egos is not None:
        return _record_fleet_crash(scenario, ending, out, started)
    layout = make_layout(scenario)
    identity = run_identity(scenario, _net_file(layout))
    target = out / folder_name(scenario, identity["run_hash"])
    trace = _trace(scenario, layout, Recorder(None), ending)
    whole = road_map(layout)
    with atomic_folder(target) as folder:
        write_map(whole, folder)
        place = RunOutput(folder, target, OutputOptions(), started)
        return write_run(scenario, identity, ending, trace, place)


def _record_fleet_crash(
    scenario: Scenario, ending: Ending, out: Path, started: float
) -> Outcome:
    """Write the run folder of a run with many egos whose process died."""
    identity = run_identity(scenario, fleet_network(scenario).net_file)
    target = out / folder_name(scenario, identity["run_hash"])
    names = scenario.name, scenario.driven_by, scenario.simulation.seed
    row = row_without_episode(*names, str(ending.status))
    with atomic_folder(target) as folder:
        options = OutputOptions(keeps_trace=lambda _: False)
        place = RunOutput(folder, target, options, started)
        write_folder(scenario, identity, ending, "", row, place)
    return Outcome(ending, row, "", target)


def _tell_missed_demand(scenario: Scenario) -> None:
    """Warn of a demand of which nobody departs; files with mistakes fail later."""
    with suppress(NetworkError):
        missed = missed_demand(scenario)
        if missed:
            scenario_network.log.warning("%s", missed)


def make_scenario_planner(scenario: Scenario) -> Planner:
    """Make the scenario's planner; errors name the scenario file."""
    choice = scenario.planner
    try:
        return make_planner(choice.name, choice.settings)
    except ConfigError as error:
        key, _, problem = str(error).partition(": ")
        path = tuple(key.split("."))
        written = (*path, "name") if len(path) == 1 else path
        raise scenario.error(path, problem, written) from error


def _net_file(layout: Layout) -> Path | None:
    """Return the file of the roads, None if the scenario itself has them."""
    if layout.lanelets is not None:
        return layout.lanelets.file
    return layout.network.net_file if layout.network else None


def road_map(layout: Layout) -> RoadMap:
    """Collect the lanes about the ego's route for pictures."""
    if layout.lanelets is not None:
        return lanelet_map(layout.road.path, layout.lanelets.network)
    return map_around(layout.road.path, _net_file(layout))


def episode_options(
    scenario: Scenario, layout: Layout, output: OutputOptions
) -> EpisodeOptions:
    """Return the options of the loop."""
    simulation = scenario.simulation
    return EpisodeOptions(
        duration=simulation.duration_s,
        blocked_after=simulation.blocked_after_s,
        horizon=simulation.horizon_s,
        # what was recorded is the world's to tell; the rest goes on as it is
        predictor=PREDICTORS.get(simulation.predictor, constant_speed),
        full_statistics=output.full_statistics,
        timing=plan_timing(scenario),
        perception=make_perception(scenario, layout.road),
        planned_body=planned_body(scenario),
    )


def _trace(
    scenario: Scenario, layout: Layout, recorder: Recorder, ending: Ending
) -> Trace:
    """Build the trace of what was recorded."""
    simulation = scenario.simulation
    facts = RunFacts(
        scenario.name, scenario.planner.name, simulation.seed, simulation.step_s
    )
    return build_trace(
        facts, layout.road, layout.task, recorder.records, ending, recorder.elapsed
    )
