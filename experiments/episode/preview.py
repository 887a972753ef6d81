"""What a scenario comes to, before anything runs: route, bends, goal, traffic."""

import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.config import Scenario
from experiments.cosim.sumo.world import SumoWorld
from experiments.episode.run import make_scenario_planner, road_map
from experiments.trace.road_map import RoadMap
from experiments.world_setup.demand_files import checked_demand, missed_demand
from experiments.world_setup.layout import make_layout
from experiments.world_setup.road import Layout
from experiments.world_setup.traffic import make_demand
from experiments.world_setup.world import make_world
from planner.states import FloatArray
from sumo_nets.demand import Demand, DemandVehicle, vehicles_for
from sumo_nets.network import Network
from sumo_nets.route_path import route_path

SAMPLING = 0.5  # along the path [m]
SHARP = 0.8  # share of the ego's curvature from which on a bend is unusual
TIGHT = 1.5  # duration over the time at the target speed that leaves little to wait
DENSE = 1800.0  # more than a lane carries [veh/h]
CLOSE = 30.0  # an obstacle nearer than this is close to the start [m]
CROSSED = 3.0  # a shorter junction only joins two edges [m]
STRAIGHT = 1e-3  # no bend is milder [1/m]


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """A scenario in words, and what is unusual about it."""

    facts: tuple[tuple[str, str], ...]  # name, words
    unusual: tuple[str, ...]  # whole sentences


@dataclass(frozen=True, slots=True, eq=False)
class ScenarioPreview(Preview):
    """A scenario laid out, and what to draw of it."""

    layout: Layout
    road_map: RoadMap
    sharpest: float | None  # where the path bends most [m]; None if it is straight


def preview(scenario: Scenario) -> ScenarioPreview:
    """Lay out a scenario and describe it.

    Raises:
        ConfigError: If it cannot be run as written.
        NetworkError: If its network cannot be used.
    """
    make_scenario_planner(scenario)
    layout = make_layout(scenario)
    s, curvature = _driven(layout)
    sharpest = float(s[np.abs(curvature).argmax()])
    facts, unusual = _route(scenario, layout), []
    for own, odd in (
        _bends(layout),
        _ends(layout),
        _speeds(scenario, layout),
        _traffic(scenario, layout),
        _bodies(layout),
    ):
        facts += own
        unusual += odd
    return ScenarioPreview(
        tuple(facts),
        tuple(unusual),
        layout,
        road_map(layout),
        sharpest if np.abs(curvature).max() > STRAIGHT else None,
    )


Said = tuple[list[tuple[str, str]], list[str]]  # facts, and what is unusual


def _driven(layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Sample (s, curvature) of the path from start to goal."""
    task, path = layout.task, layout.road.path
    end = min(task.goal, path.length)  # the goal's lane may begin at the start
    s = np.arange(task.start.s, max(end, task.start.s + SAMPLING), SAMPLING)
    return s, path.at(s).curvature


def _route(scenario: Scenario, layout: Layout) -> list[tuple[str, str]]:
    """Describe the route and what is on it."""
    network = layout.network
    path = layout.road.path
    facts = [("scenario", f"{scenario.name}, planner {scenario.planner.name}")]
    if network is not None:
        facts.append(("network", str(network.net_file)))
        found = route_path(network.net_file, network.route, network.lane)
        lane = found.lanes[0].rpartition("_")[2]  # it may not be the one asked for
        facts.append(("route", f"{' '.join(network.route)}, lane {lane}"))
    facts.append(("path", f"{path.length:.0f} m, goal at {layout.task.goal:.0f} m"))
    stops = [f"{stop.signal} at {stop.s:.0f} m" for stop in layout.road.stop_lines]
    if stops:
        facts.append(("signals", ", ".join(stops)))
    return facts


def _bends(layout: Layout) -> Said:
    """Compare the sharpest bend with what the ego can steer."""
    s, curvature = _driven(layout)
    most = float(np.abs(curvature).max())
    if most <= STRAIGHT:
        return [("bends", "none")], []
    limits = layout.task.vehicle.limits
    at = float(s[np.abs(curvature).argmax()])
    share = most / limits.max_curvature
    speed = float(np.sqrt(limits.max_lateral_acceleration / most))
    words = (
        f"sharpest at {at:.0f} m: radius {1.0 / most:.1f} m, {100.0 * share:.0f} % of "
        f"the ego's curvature, at most {speed:.1f} m/s"
    )
    unusual = []
    if share > SHARP:
        unusual.append(
            f"The bend at {at:.0f} m takes {100.0 * share:.0f} % of the ego's "
            "curvature: beside the path there is little left to steer."
        )
    return [("bends", words)], unusual


def _ends(layout: Layout) -> Said:
    """Place the goal among the junctions of the route."""
    network = layout.network
    if network is None:
        return [], []
    found = route_path(network.net_file, network.route, network.lane)
    s, _ = layout.road.path.project(
        found.points[:, 0], found.points[:, 1], near=found.s
    )
    inside = [
        np.interp([span.begin, span.end], found.s, s)
        for span in found.spans
        if span.lane.startswith(":") and span.end - span.begin > CROSSED
    ]
    goal = layout.task.goal
    met = [ends for ends in inside if ends[0] < goal]
    facts = [("junctions", f"{len(met)} of {len(inside)} before the goal")]
    unusual = []
    if any(begin < goal < end for begin, end in inside):
        unusual.append("The goal lies inside a junction.")
    elif len(met) < len(inside):
        begin = inside[len(met)][0]
        unusual.append(
            f"The goal at {goal:.0f} m lies before the junction at {begin:.0f} m, "
            "which the ego does not drive through."
        )
    return facts, unusual


def _speeds(scenario: Scenario, layout: Layout) -> Said:
    """Compare target speed, limits and time."""
    task, limits = layout.task, layout.road.speed_limits
    s, _ = _driven(layout)
    allowed = limits.at(s)
    target = task.target_speed
    facts, unusual = [], []
    if np.isfinite(allowed).any():
        values = sorted({round(float(v), 2) for v in allowed if np.isfinite(v)})
        shown = ", ".join(f"{value:g}" for value in values)
        facts.append(("limits", f"{shown} m/s; target {target:g} m/s"))
        if target > float(allowed.min()):
            unusual.append(
                f"The target speed of {target:g} m/s is above a limit of "
                f"{allowed.min():g} m/s, which the ego keeps."
            )
    distance = float(s[-1] - s[0]) if s.size else 0.0
    fastest = float((SAMPLING / np.minimum(allowed, target)).sum())
    duration = scenario.simulation.duration_s
    waits = ", red lights aside" if layout.road.stop_lines else ""
    facts.append(
        (
            "time",
            f"{fastest:.0f} s for {distance:.0f} m alone{waits}; "
            f"ends at {duration:g} s",
        )
    )
    if duration < TIGHT * fastest:
        unusual.append(
            f"simulation.duration_s = {duration:g} leaves little time to wait: "
            f"{fastest:.0f} s are needed alone."
        )
    return facts, unusual


def _traffic(scenario: Scenario, layout: Layout) -> Said:
    """Estimate the traffic by drawing it."""
    network = layout.network
    if layout.replay is not None:
        words = f"{len(layout.replay.log.ids)} recorded road users, which do not react"
        return [("traffic", words)], []
    if network is None:
        return [("traffic", f"{len(scenario.vehicles)} scripted vehicles")], []
    files = checked_demand(scenario, network.net_file)
    if scenario.network is not None and scenario.network.file is not None:
        _let_sumo_read(scenario, layout)
    if files is not None:
        names = ", ".join(file.name for file in files.files)
        missed = missed_demand(scenario)
        words = f"that of {names}, from {files.begin:g} s on"
        return [("traffic", words)], [missed] if missed else []
    demand = make_demand(scenario, layout)
    drawn, when = drawn_vehicles(scenario, network, demand)
    counts = Counter(vehicle.id.rpartition(".")[0] for vehicle in drawn)
    shown = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    words = f"{shown or 'no vehicles'} {when}"
    unusual = []
    if not drawn and not layout.road.obstacles.ids:
        unusual.append("There is neither traffic nor an obstacle.")
    lanes = max(1, int((layout.road.lanes.width[:, 0] > 0.0).sum()))
    flow = demand.own_veh_per_h / lanes
    if flow > DENSE:
        unusual.append(
            f"The ego's carriageway is to get {flow:.0f} vehicles an hour and lane; a "
            f"lane carries about {DENSE:.0f}: many will not depart."
        )
    return [("traffic", words)], unusual


def _let_sumo_read(scenario: Scenario, layout: Layout) -> None:
    """Raise what SUMO finds wrong with a user's network or demand as it loads it."""
    with tempfile.TemporaryDirectory() as folder:
        world = make_world(scenario, layout, Path(folder))
        if isinstance(world, SumoWorld):
            world.check_files()


def drawn_vehicles(
    scenario: Scenario, network: Network, demand: Demand
) -> tuple[tuple[DemandVehicle, ...], str]:
    """Draw the traffic of a run, and say of which time and seed it is."""
    simulation = scenario.simulation
    end = simulation.warmup_s + simulation.duration_s
    drawn = vehicles_for(network, demand, simulation.seed, 0.0, end)
    return drawn, f"in {end:g} s with seed {simulation.seed}"


def _bodies(layout: Layout) -> Said:
    """Count the obstacles and look at the first."""
    bodies = layout.road.obstacles
    if not bodies.ids:
        return [("obstacles", "none")], []
    s, _ = layout.road.path.project(bodies.x, bodies.y)
    first = float(s.min())
    own, _ = _driven(layout)
    unusual = []
    if own.size and first - float(own[0]) < CLOSE:
        unusual.append(f"The first obstacle is only {first - own[0]:.0f} m ahead.")
    return [("obstacles", f"{len(bodies.ids)}, the first at {first:.0f} m")], unusual
