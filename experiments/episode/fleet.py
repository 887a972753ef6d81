"""One run with many egos: configuration -> world -> loop -> metrics -> run folder."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from time import perf_counter

from experiments.config import Scenario
from experiments.config.self_driven import SELF_DRIVEN
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.fleet.loop import FleetLoop
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.fleet.takeover import FleetGroup
from experiments.cosim.fleet.world import FleetWorld
from experiments.cosim.records import Ending, EpisodeStatus
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.episode.identity import run_identity
from experiments.episode.newest_run import RUNS
from experiments.episode.run_folder import (
    Outcome,
    OutputOptions,
    RunOutput,
    folder_name,
    write_folder,
)
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.columns import Cell
from experiments.metrics.row import fleet_row
from experiments.metrics.traffic_flow import (
    CountingPlace,
    FleetMeasurement,
    LaneFacts,
)
from experiments.planners.registry import make_planner
from experiments.storage.atomic_folder import atomic_folder
from experiments.trace.fleet import (
    FleetTrace,
    fleet_hash,
    fleet_tables,
    plans_table,
    timing_table,
    write_fleet,
)
from experiments.trace.fleet_recording import FleetRecorder
from experiments.trace.road_map import whole_map, write_map
from experiments.world_setup.fleet import (
    FleetRoads,
    ego_selection,
    fleet_network,
    make_fleet_world,
)
from planner.interface import Planner
from planner.prediction import PREDICTORS
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.network import Network

OnFleetStep = Callable[[FleetStep], None]


def run_fleet(
    scenario: Scenario,
    *,
    out: Path = RUNS,
    on_step: OnFleetStep | None = None,
    output: OutputOptions | None = None,
) -> Outcome:
    """Run a scenario with many egos and write its run folder.

    Args:
        scenario: Checked; has `egos`.
        out: Where run folders go.
        on_step: Called with every step, for a progress display.
        output: Another place or content of the run folder.

    Returns:
        The outcome, also if planners or the simulator failed.

    Raises:
        ConfigError: If the scenario cannot be run as written.
        SimulationError: If the simulator cannot be loaded.
        ResultsError: If the run folder cannot be written.
    """
    started = perf_counter()
    options = output or OutputOptions()
    groups = fleet_groups(scenario)
    network = fleet_network(scenario)
    places = fleet_detectors(scenario, network)
    load_libsumo()
    identity = run_identity(scenario, network.net_file)
    target = options.target or out / folder_name(scenario, identity["run_hash"])
    recorder = FleetRecorder()
    with atomic_folder(target) as folder:
        ending, trace = drive_fleet(
            scenario, network, groups, recorder, folder, on_step=on_step
        )
        lanes = lane_facts(read_net(network.net_file))
        begin = 0.0 if scenario.measurement is None else scenario.measurement.from_s
        measured = FleetMeasurement(trace, lanes, places, begin)
        tables = fleet_tables(trace)
        hashed = fleet_hash(tables)
        row = fleet_row(_identity_columns(scenario, ending), measured)
        place = RunOutput(folder, target, options, started)
        if options.keeps_trace(ending):
            write_fleet(tables, timing_table(trace), plans_table(trace), folder)
            write_map(whole_map(read_net(network.net_file)), folder)
        write_folder(scenario, identity, ending, hashed, row, place)
        return Outcome(ending, row, hashed, target)


def drive_fleet(
    scenario: Scenario,
    network: Network,
    groups: tuple[FleetGroup, ...],
    recorder: FleetRecorder,
    folder: Path,
    *,
    on_step: OnFleetStep | None = None,
) -> tuple[Ending, FleetTrace]:
    """Drive a scenario with many egos.

    Args:
        scenario: Checked.
        network: Of the scenario.
        groups: How the egos are driven.
        recorder: Takes every step.
        folder: For the route file.
        on_step: Called with every step too.

    Returns:
        How it ended, and what was recorded.
    """

    def take(step: FleetStep) -> None:
        """Record a step and pass it on."""
        recorder(step)
        if on_step is not None:
            on_step(step)

    world, loop = make_fleet_loop(scenario, network, groups, folder, take)
    try:
        ending = loop.run()
    finally:
        world.close()
    return ending, recorder.trace(world.step, world.lanes)


def make_fleet_loop(
    scenario: Scenario,
    network: Network,
    groups: tuple[FleetGroup, ...],
    folder: Path,
    on_step: OnFleetStep,
    *,
    horizon: float | None = None,
) -> tuple[FleetWorld, FleetLoop]:
    """Make the world of a scenario with many egos, and their loop; nothing runs yet.

    Args:
        scenario: Checked.
        network: Of the scenario.
        groups: How the egos are driven.
        folder: For the route file.
        on_step: Called with every step.
        horizon: Of the predictions, the scenario's by default [s].

    Raises:
        ConfigError: If the traffic is not possible on this network.
    """
    simulation = scenario.simulation
    world = make_fleet_world(scenario, network, folder)
    options = EpisodeOptions(
        duration=simulation.duration_s,
        blocked_after=simulation.blocked_after_s,
        horizon=simulation.horizon_s if horizon is None else horizon,
        predictor=PREDICTORS[simulation.predictor],
    )
    roads = FleetRoads(network.net_file, scenario.egos or ())
    loop = FleetLoop(world, groups, ego_selection(scenario), roads, options, on_step)
    return world, loop


def fleet_groups(scenario: Scenario) -> tuple[FleetGroup, ...]:
    """Make the planners of the groups of a scenario.

    Raises:
        ConfigError: If there is no such planner, or it does not take its settings.
    """
    made: list[FleetGroup] = []
    for number, group in enumerate(scenario.egos or ()):
        choice = group.planner or scenario.planner
        planner: Planner | None = None
        if choice.name not in SELF_DRIVEN:
            try:
                planner = make_planner(choice.name, choice.settings)
            except ConfigError as error:
                one = len(scenario.egos or ()) == 1
                place = ("egos",) if one else ("egos", number)
                key = (*place, "planner") if group.planner else ("planner",)
                problem = str(error).removeprefix("planner: ")
                raise scenario.error(key, problem) from error
        made.append(FleetGroup(planner, group.on_failure == "end"))
    return tuple(made)


def fleet_detectors(scenario: Scenario, network: Network) -> tuple[CountingPlace, ...]:
    """Return where vehicles are counted.

    Raises:
        ConfigError: If a detector is not on the network.
    """
    net = read_net(network.net_file)
    listed = () if scenario.measurement is None else scenario.measurement.detectors
    for number, one in enumerate(listed):
        path = ("measurement", "detectors", number)
        if one.edge not in net.edges:
            known = ", ".join(edge.id for edge in net.roads[:8])
            raise scenario.error((*path, "edge"), f"is {one.edge}; allowed: {known}")
        length = net.edges[one.edge].lanes[0].length
        if one.at_m > length:
            problem = f"is {one.at_m:g}; allowed: 0 to {length:.1f}, the edge's end"
            raise scenario.error((*path, "at_m"), problem)
    if listed:
        return tuple(CountingPlace(one.edge, one.at_m) for one in listed)
    longest = max(network.route, key=lambda edge: net.edges[edge].lanes[0].length)
    return (CountingPlace(longest, 0.5 * net.edges[longest].lanes[0].length),)


def lane_facts(net: Net) -> dict[str, LaneFacts]:
    """Collect the lengths of all lanes, and where each leads if that is one lane."""
    return dict(_lane_facts(net.file, net.file.stat().st_mtime_ns))


@cache
def _lane_facts(net_file: Path, _changed: int) -> tuple[tuple[str, LaneFacts], ...]:
    """Collect the facts of a network once."""
    found: list[tuple[str, LaneFacts]] = []
    for edge in read_net(net_file).edges.values():
        for lane in edge.lanes:
            onward = {link.via or link.target.id for link in lane.links}
            only = onward.pop() if len(onward) == 1 else None
            found.append((lane.id, LaneFacts(lane.length, only, edge.id)))
    return tuple(found)


def _identity_columns(scenario: Scenario, ending: Ending) -> dict[str, Cell]:
    """Return the columns that name a run and its outcome."""
    return {
        columns.SCENARIO: scenario.name,
        columns.PLANNER: scenario.driven_by,
        columns.SEED: scenario.simulation.seed,
        columns.STATUS: str(ending.status),
        columns.ARRIVED: ending.status is EpisodeStatus.ARRIVED,
    }
