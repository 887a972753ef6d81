"""Makes networks by netgenerate or street maps, a scenario for each, and their sweep.

The shipped town is a source too: of long routes through one network.

`python -m experiments.evidence.generated_networks.prepare FOLDER` writes them, for
`rearview sweep FOLDER/sweep.yaml`. A number makes the same network everywhere.
"""

import argparse
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from random import Random
from types import MappingProxyType
from typing import Any, Final

import yaml

from experiments.config.scenario_file import load_scenario
from experiments.errors import ExperimentError
from experiments.evidence.generated_networks.street_maps import write_street_map
from experiments.storage.atomic_folder import make_folder, write_atomically
from sumo_nets.build import net_path, sumo_home
from sumo_nets.errors import NetworkError

COUNT: Final = 60
SEEDS: Final = 3  # of traffic and route on each network
PLANNERS: Final = ("route", "sumo")
LONGEST: Final = 60.0  # of making a network [s]
SPEEDS: Final = (8.33, 13.89, 16.67)  # [m/s]
LANES: Final = (1, 1, 2, 2, 3)
LEFT_HAND, NARROW, TURN_LANES = 0.15, 0.15, 0.25  # shares of the networks
NARROW_WIDTH: Final = 2.8  # of a lane [m]
RIGHT_OF_WAY: Final = (
    "priority",
    "priority_stop",
    "right_before_left",
    "allway_stop",
    "traffic_light",
)
NETGENERATE, STREET_MAPS, TOWN = "netgenerate", "street_maps", "town"
TOUR_LENGTHS: Final = (1000, 3000)  # [m]
CAR: Final = "car"
# of the networks of a source, each before its number
NAMES: Final = MappingProxyType({NETGENERATE: "net", STREET_MAPS: "map", TOWN: "tour"})
BODIES: Final[Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {
        CAR: {},
        "lorry": {
            "length_m": 12.0,
            "width_m": 2.5,
            "wheelbase_m": 6.0,
            "rear_overhang_m": 3.0,
            "limits": {"max_curvature_1pm": 0.14},
        },
    }
)


def _sections(own: int, oncoming: int, cross: int, duration: int) -> Mapping[str, Any]:
    """Return the sections of a scenario: flows [veh/h] and time [s]."""
    flows = {"own": own, "oncoming": oncoming, "cross": cross}
    return {
        "traffic": {f"{name}_veh_per_h": flow for name, flow in flows.items()},
        "simulation": {"duration_s": duration, "warmup_s": 60},
    }


SCENARIO: Final = MappingProxyType(_sections(400, 300, 200, 240))
# A tour of the town: the traffic of its scenario, and time for its lights and queues.
TOUR: Final = MappingProxyType(_sections(100, 100, 80, 1200))


def options(number: int) -> list[str]:
    """Return the options of netgenerate for a network.

    Grids, spiders and random nets take turns; the rest is drawn: lanes, speed, right
    of way, side of the road, width and turn lanes.
    """
    draw = Random(number)
    lanes, speed = draw.choice(LANES), draw.choice(SPEEDS)
    left_hand = draw.random() < LEFT_HAND
    kinds = (*RIGHT_OF_WAY, "left_before_right") if left_hand else RIGHT_OF_WAY
    found = [
        *_shape(number, draw),
        f"--default.lanenumber={lanes}",
        f"--default.speed={speed}",
        f"--default-junction-type={draw.choice(kinds)}",
        "--no-turnarounds=true",
        f"--seed={number}",
    ]
    if left_hand:
        found.append("--lefthand=true")
    if draw.random() < NARROW:
        found.append(f"--default.lanewidth={NARROW_WIDTH}")
    if draw.random() < TURN_LANES:
        found.append("--turn-lanes=1")
    return found


def _shape(number: int, draw: Random) -> list[str]:
    """Draw the shape of a network."""
    kind = number % 3
    if kind == 0:
        return [
            "--grid",
            f"--grid.number={draw.randint(3, 5)}",
            f"--grid.length={draw.randint(70, 200)}",
            f"--grid.attach-length={draw.randint(60, 150)}",
        ]
    if kind == 1:
        return [
            "--spider",
            f"--spider.arm-number={draw.randint(3, 7)}",
            f"--spider.circle-number={draw.randint(2, 4)}",
            f"--spider.space-radius={draw.randint(60, 150)}",
        ]
    return [
        "--rand",
        f"--rand.iterations={draw.randint(20, 60)}",
        f"--rand.min-distance={draw.randint(60, 100)}",
        f"--rand.max-distance={draw.randint(150, 250)}",
    ]


def make_network(number: int, file: Path) -> None:
    """Make a network.

    Raises:
        NetworkError: If netgenerate is missing or fails.
    """
    home = sumo_home()
    command = [home / "bin" / "netgenerate", *options(number), f"--output-file={file}"]
    done = subprocess.run(
        [str(word) for word in command],
        env={"SUMO_HOME": str(home)},
        capture_output=True,
        text=True,
        check=False,
        timeout=LONGEST,
    )
    if done.returncode != 0:
        raise NetworkError(f"netgenerate fails for network {number}: {done.stderr}")


def prepare(
    folder: Path,
    numbers: range,
    seeds: range,
    *,
    planners: Sequence[str] = PLANNERS,
    body: str = CAR,
    source: str = NETGENERATE,
) -> Path:
    """Write networks, scenarios and sweep; return the sweep file.

    Args:
        folder: Where to; made if it is not there.
        numbers: Of the networks.
        seeds: Of routes and traffic.
        planners: Who drives.
        body: In what; of `BODIES`.
        source: Of the networks: `NETGENERATE`, `STREET_MAPS` to be converted, or
            `TOWN` with a tour of its own length for each number.

    Raises:
        NetworkError: If a network cannot be made.
        ConfigError: If a scenario is not possible.
    """
    make_folder(folder)
    names = []
    for number in numbers:
        name = f"{NAMES[source]}_{number:02d}"
        net = _network(source, number, folder / name)
        keys = _tour(number) if source == TOWN else SCENARIO
        file = folder / f"{name}.yaml"
        write_atomically(file, yaml.safe_dump(_scenario(name, net, body, keys)))
        load_scenario(str(file))
        names.append(file.name)
    sweep = folder / "sweep.yaml"
    content = {
        "name": f"{source}_{body}",
        "purpose": "Random routes through networks that nobody drew by hand.",
        "scenarios": names,
        "planners": list(planners),
        "seeds": {"first": seeds.start, "count": len(seeds)},
        "timeout_s": 600,
        "keep_traces": "failures",
    }
    write_atomically(sweep, yaml.safe_dump(content, sort_keys=False))
    return sweep


def _network(source: str, number: int, stem: Path) -> Path:
    """Make a network, or take the town's; return its file.

    Args:
        source: Of the networks.
        number: Of the network.
        stem: Path of the file, without its ending.
    """
    if source == STREET_MAPS:
        file = stem.with_suffix(".osm")
        write_street_map(number, file)
        return file
    file = stem.with_suffix(".net.xml")
    if source == TOWN:
        write_atomically(file, net_path(TOWN).read_text())
    else:
        make_network(number, file)
    return file


def _tour(number: int) -> dict[str, Any]:
    """Draw a tour through the town."""
    goal = Random(number).randint(*TOUR_LENGTHS)
    return {**TOUR, "ego": {"goal_m": goal}}


def _scenario(
    name: str, net: Path, body: str, keys: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a scenario of random routes through a network."""
    sections = {section: dict(values) for section, values in keys.items()}
    ego = {"start_m": 20, "vehicle": dict(BODIES[body]), **sections.pop("ego", {})}
    return {
        "name": name,
        "purpose": "A random route through a network.",
        "world": "sumo",
        "network": {"file": net.name},
        "ego": ego,
        **sections,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Write networks, scenarios and sweep.

    Returns:
        Exit status: 0, or 2 on an error, which stderr names in a line.
    """
    parser = argparse.ArgumentParser(
        prog="generated_networks.prepare", description=__doc__
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=COUNT, help="of networks")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of each network")
    parser.add_argument("--planner", action="append", help="may be repeated")
    parser.add_argument("--body", choices=BODIES, default=CAR)
    parser.add_argument("--source", choices=NAMES, default=NETGENERATE)
    given = parser.parse_args(arguments)
    if min(given.count, given.seeds) < 1:
        sys.stderr.write("--count and --seeds: allowed: at least 1\n")
        return 2
    try:
        sweep = prepare(
            given.folder,
            range(given.count),
            range(given.seeds),
            planners=given.planner or PLANNERS,
            body=given.body,
            source=given.source,
        )
    except (ExperimentError, NetworkError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"{sweep}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
