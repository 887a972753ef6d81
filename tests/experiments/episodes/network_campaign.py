"""Drive random routes through generated networks: a campaign, and its parts for tests.

`python -m tests.experiments.episodes.network_campaign --seeds 0-59` drives three routes
of every network with SUMO's own driver and with planners, one process an episode, and
prints how many of the routes that SUMO's driver drives the planners drive as well.
"""

import argparse
import json
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.episode.run import run_episode
from experiments.errors import ExperimentError
from experiments.evidence.generated_networks.prepare import BODIES
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.route_path import route_path
from sumo_nets.routes import random_route
from tests.sumo_nets.generated import generate

SHAPES = {
    "grid": ("--grid", "--grid.number=5", "--grid.length=110"),
    "spider": (
        "--spider", "--spider.arm-number=6", "--spider.circle-number=4",
        "--spider.space-radius=90",
    ),
    "random": ("--rand", "--rand.iterations=60"),
}  # fmt: skip
ROUTES = 3  # of each network
DRIVER = "sumo"


@dataclass(frozen=True)
class Route:
    """One episode of the campaign, planner aside."""

    seed: int
    number: int
    body: str


def network_of(seed, folder):
    """Generate one network a seed: shape, lanes, signals and side of traffic vary."""
    shape = list(SHAPES)[seed % 3]
    signals = (seed // 3) % 2
    options = [
        *SHAPES[shape],
        f"--seed={seed}",
        f"-L{1 + (seed // 2) % 3}",
        f"--default-junction-type={'traffic_light' if signals else 'priority'}",
    ]
    if seed % 4 == 3 and shape != "random":
        options.append("--turn-lanes=1")
    if seed % 5 == 4:
        options.append("--lefthand")
    if seed % 6 == 5:
        options.append("--default.lanewidth=2.8")
    return read_net(generate(folder, *options))


def scenario_of(net, route, folder, planner="cruise"):
    """Make the scenario of one route, the same for all planners and bodies."""
    seed, number = route.seed, route.number
    edges = random_route(net, np.random.default_rng([seed, number]), 350.0, 20.0)
    lane = net.edges[edges[0]].drivable_lanes[-1].index
    length = route_path(net.file, edges, lane).length
    content = {
        "name": f"net{seed}_{number}",
        "network": {"file": str(net.file), "route": list(edges), "lane": lane},
        "ego": {
            "start_m": 10.0,
            "goal_m": round(min(length - 20.0, 330.0), 1),
            "vehicle": dict(BODIES[route.body]),
        },
        "traffic": {
            "own_veh_per_h": 400,
            "oncoming_veh_per_h": 300,
            "cross_veh_per_h": 100,
        },
        "planner": planner,
        "simulation": {"seed": seed, "warmup_s": 40, "duration_s": 240},
    }
    file = folder / f"net{seed}_{number}.yaml"
    file.write_text(yaml.safe_dump(content))
    return load_scenario(str(file))


def drive(route, planner, out):
    """Drive one route; returns plain values, also where the route is refused."""
    result = {"seed": route.seed, "route": route.number, "body": route.body}
    result["planner"] = planner
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            net = network_of(route.seed, folder)
            scenario = scenario_of(net, route, folder, planner)
            outcome = run_episode(scenario, out=out / f"{route.body}")
        except (ExperimentError, NetworkError) as error:
            return {**result, "status": "refused", "reason": str(error)}
    row = outcome.row
    return {
        **result,
        "status": outcome.ending.status.value,
        "reason": outcome.ending.reason,
        "off_road_steps": row["off_road_steps"],
        "travel_time_s": row["travel_time_s"],
        "fallback_cycles": row["fallback_cycles"],
        "folder": str(outcome.folder),
    }


def campaign(routes, planners, out, workers=1):
    """Drive all routes with SUMO's driver and the planners; yields results.

    Every episode has a process of its own: libsumo keeps one simulation.
    """
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, context) as pool:
        jobs = [
            pool.submit(drive, route, planner, out)
            for route in routes
            for planner in (DRIVER, *planners)
        ]
        for job in jobs:
            yield job.result()


def summary(results, planners):
    """Count what became of the routes that SUMO's driver drives."""
    arrived = EpisodeStatus.ARRIVED.value
    by_route = {}
    for x in results:
        by_route.setdefault((x["body"], x["seed"], x["route"]), {})[x["planner"]] = x
    driven = {k: v for k, v in by_route.items() if v[DRIVER]["status"] == arrived}
    lines = [f"{DRIVER} drives {len(driven)} of {len(by_route)} routes"]
    for planner in planners:
        of = [x[planner] for x in driven.values()]
        counts = Counter(x["status"] for x in of)
        off = sum(x.get("off_road_steps", 0) > 0 for x in of)
        lines.append(f"{planner}: {dict(counts)}, off the road in {off}")
    either = sum(
        any(x[p]["status"] == arrived for p in planners) for x in driven.values()
    )
    lines.append(f"either: {either} of {len(driven)}")
    return lines


def main():
    """Run the campaign from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0-59", help="first-last")
    parser.add_argument("--body", choices=list(BODIES), default="car")
    parser.add_argument("--planners", nargs="*", default=["cruise", "lane_change"])
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/networks"))
    options = parser.parse_args()
    first, last = map(int, options.seeds.split("-"))
    seeds = range(first, last + 1)
    routes = [Route(s, n, options.body) for s in seeds for n in range(ROUTES)]
    results = []
    for result in campaign(routes, options.planners, options.out, options.workers):
        results.append(result)
        sys.stdout.write(json.dumps(result) + "\n")
        sys.stdout.flush()
    for line in summary(results, options.planners):
        sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main()
