"""Study of [Thesis] ch. 4: random obstacles on its four roads, and one that grows.

The layouts are drawn as the published ones look: a disc every 28 to 45 m, at most 3 m
beside the reference path, 0.3 to 1.5 m in radius; no traffic. `python -m
experiments.thesis.cruise.random_layouts` prints the tables.
"""

import argparse
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from experiments.config.scenario_file import load_scenario
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import EpisodeStatus, StepRecord
from experiments.planners.registry import make_planner
from experiments.world_setup.layout import make_layout
from experiments.world_setup.world import make_world
from planner.interface import PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE

ROADS = ("straight", "curved", "intersection", "u_shaped")
FIRST = 32.0  # centre of the first obstacle [m]
RANDOM = (
    f"obstacles={{random: {{first_m: {FIRST}, spacing_m: [28, 45], max_offset_m: 3, "
    "radius_m: [0.3, 1.5]}}"
)
RADII = tuple(round(0.3 + 0.1 * k, 1) for k in range(18))  # of the growing one [m]
GROWS_AT = (60.0, -1.0)  # s and l of it [m]


@dataclass(frozen=True, slots=True)
class RandomDrive:
    """Result of one layout."""

    status: EpisodeStatus
    clearance: float  # least distance of the rectangle from any obstacle [m]
    fallbacks: int  # cycles without a trajectory of the planner's own
    off_road: int  # steps over the road's edge


def drive(road: str, planner: str, seed: int, obstacles: str) -> RandomDrive:
    """Drive one layout on a road of the thesis, in the world without a simulator.

    Args:
        road: One of `ROADS`.
        planner: Name as in a scenario file.
        seed: Of the obstacles.
        obstacles: The section, as an override of the scenario.
    """
    scenario = load_scenario(
        f"thesis_{road}", planner=planner, seed=seed, overrides=[obstacles]
    )
    layout = make_layout(scenario)
    records: list[StepRecord] = []
    ending = run_loop(
        make_world(scenario, layout, Path()),
        make_planner(scenario.planner.name, scenario.planner.settings),
        PerfectTracking(),
        layout.task,
        EpisodeOptions(
            scenario.simulation.duration_s,
        ),
        records.append,
    )
    plans = [record.plan for record in records if record.plan is not None]
    return RandomDrive(
        ending.status,
        min(record.clearance for record in records),
        sum(plan.status is not PlanStatus.OK for plan in plans),
        sum(record.off_road > OFF_ROAD_TOLERANCE for record in records),
    )


def growing(radius: float) -> str:
    """Place one obstacle of `radius` [m] on the road."""
    s, l = GROWS_AT
    return f"obstacles=[{{s_m: {s}, l_m: {l}, radius_m: {radius}}}]"


def layouts_table(
    planner: str, results: Iterable[tuple[str, Sequence[RandomDrive]]]
) -> Table:
    """Tabulate the random layouts, a road a row."""
    table = Table(title=f"Random obstacles without traffic, {planner}")
    table.add_column("road")
    columns = ("layouts", "arrived", "collisions", "off-road steps", "fallback cycles")
    for words in (*columns, "layouts with any", "least clearance m"):
        table.add_column(words, justify="right")
    for road, drives in results:
        hits = sum(one.status is EpisodeStatus.COLLISION for one in drives)
        arrived = sum(one.status is EpisodeStatus.ARRIVED for one in drives)
        off_road = sum(one.off_road for one in drives)
        fallbacks = [one.fallbacks for one in drives]
        cells = (len(drives), arrived, hits, off_road, sum(fallbacks))
        table.add_row(
            road,
            *map(str, cells),
            str(sum(n > 0 for n in fallbacks)),
            f"{min(one.clearance for one in drives):.2f}",
        )
    return table


def growing_table(planner: str, drives: Sequence[RandomDrive]) -> Table:
    """Tabulate what is kept from the growing obstacle."""
    s, l = GROWS_AT
    table = Table(title=f"One obstacle at s = {s:g} m, l = {l:g} m grows, {planner}")
    table.add_column("radius m", justify="right")
    table.add_column("clearance kept m", justify="right")
    table.add_column("")
    for radius, one in zip(RADII, drives, strict=True):
        table.add_row(f"{radius:.1f}", f"{one.clearance:.2f}", str(one.status))
    return table


def largest_drop(clearances: Sequence[float]) -> float:
    """Return by how much the clearance falls below that of a smaller obstacle [m]."""
    drop, most = 0.0, clearances[0]
    for clearance in clearances:
        most = max(most, clearance)
        drop = max(drop, most - clearance)
    return drop


def main(
    arguments: Sequence[str] | None = None, console: Console | None = None
) -> None:
    """Print the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "layouts", type=int, nargs="?", default=200, help="on each road"
    )
    parser.add_argument("--planner", default="cruise")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    options = parser.parse_args(arguments)
    console = console or Console(highlight=False, width=110)
    shown = Console(stderr=True)
    planner, seeds = options.planner, range(options.layouts)
    with ProcessPoolExecutor(options.jobs) as pool:
        results = []
        for road in ROADS:
            done = pool.map(
                drive, repeat(road), repeat(planner), seeds, repeat(RANDOM), chunksize=4
            )
            watched = track(done, road, options.layouts, console=shown)
            results.append((road, list(watched)))
        obstacles = map(growing, RADII)
        done = pool.map(
            drive, repeat("straight"), repeat(planner), repeat(0), obstacles
        )
        grown = list(track(done, "growing", len(RADII), console=shown))
    console.print(layouts_table(planner, results))
    console.print(growing_table(planner, grown))
    kept = [one.clearance for one in grown]
    console.print(
        f"From the smallest to the largest: {kept[0]:.2f} to {kept[-1]:.2f} m; it "
        f"never falls by more than {largest_drop(kept):.2f} m."
    )


if __name__ == "__main__":
    main()
