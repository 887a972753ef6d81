"""What a scenario with many egos comes to, before anything runs."""

from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.config import Scenario, SumoTraffic
from experiments.config.egos import EgoGroup
from experiments.cosim.fleet.records import HUMAN
from experiments.episode.fleet import fleet_detectors, fleet_groups
from experiments.episode.preview import Preview, drawn_vehicles
from experiments.world_setup.fleet import (
    ego_selection,
    fleet_network,
    make_fleet_world,
)
from experiments.world_setup.traffic import make_flows
from sumo_nets.net_reader import read_net


def preview_fleet(scenario: Scenario) -> Preview:
    """Check everything that a run would, and describe it.

    Raises:
        ConfigError: If it cannot be run as written.
        NetworkError: If its network cannot be used.
    """
    fleet_groups(scenario)
    network = fleet_network(scenario)
    places = fleet_detectors(scenario, network)
    with TemporaryDirectory() as folder:
        make_fleet_world(scenario, network, Path(folder))
    roads = read_net(network.net_file).roads
    simulation = scenario.simulation
    facts = [
        ("scenario", f"{scenario.name}, driven by {scenario.driven_by}"),
        ("network", f"{network.net_file}, {len(roads)} edges"),
        ("detectors", ", ".join(f"{one.edge} at {one.at:.0f} m" for one in places)),
        (
            "time",
            f"{simulation.warmup_s:g} s without egos, then {simulation.duration_s:g} s",
        ),
    ]
    if isinstance(scenario.traffic, SumoTraffic):
        words = "of the scenario's own files; who is an ego shows when they enter"
        facts.append(("traffic", words))
        facts += [_group(k, one, None) for k, one in enumerate(scenario.egos or ())]
        return Preview(tuple(facts), ())
    vehicles, when = drawn_vehicles(scenario, network, make_flows(scenario))
    selection = ego_selection(scenario)
    chosen = Counter(selection.choose(one.id, one.type.id) for one in vehicles)
    words = f"{len(vehicles)} vehicles {when}"
    facts.append(("traffic", f"{words}, {chosen[HUMAN]} of them SUMO's"))
    groups = scenario.egos or ()
    facts += [_group(k, one, chosen[k]) for k, one in enumerate(groups)]
    unusual = [
        f"No vehicle of group {k} enters."
        for k, one in enumerate(groups)
        if not chosen[k] and (one.penetration or one.count)
    ]
    return Preview(tuple(facts), tuple(unusual))


def _group(number: int, group: EgoGroup, chosen: int | None) -> tuple[str, str]:
    """Describe a group of egos."""
    if group.count is None:
        share = f"{100.0 * (group.penetration or 0.0):g} %"
    else:
        share = "the first" if group.count == 1 else f"the first {group.count}"
    of = "" if group.of is None else f" of {', '.join(group.of)}"
    driver = "the scenario's planner" if group.planner is None else group.planner.name
    there = "" if chosen is None else f": {chosen} with this seed"
    return f"egos {number}", f"{share}{of}, driven by {driver}{there}"
