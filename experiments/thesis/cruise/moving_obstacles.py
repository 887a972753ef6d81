"""Obstacles that move, the future work of [Thesis] 7.1.1 for chapter 4."""

from itertools import product

import numpy as np

from experiments.cosim.records import EpisodeStatus
from experiments.sweep.processes.parallel import Work
from experiments.thesis.claims import ResultTable
from experiments.thesis.cruise.drives import CLOSED_LOOP, PROPOSED, Drive, drive
from experiments.thesis.cruise.random_layouts import ROADS
from experiments.thesis.effort import Effort

PLANNERS = {
    "as printed, vehicles taken for standing": (PROPOSED, True),
    "as printed, with predictions": (PROPOSED, False),
    "closed loop of this project": (CLOSED_LOOP, False),
}


def moving_table(effort: Effort, work: Work) -> ResultTable:
    """Drive a car among vehicles that move."""
    seeds = range(effort.moving_layouts)
    keys = list(product(ROADS, PLANNERS))
    asked = [
        Drive(
            road,
            PLANNERS[name][0],
            seed,
            (moving(seed), "obstacles=none"),
            disc=False,
            blind=PLANNERS[name][1],
        )
        for road, name in keys
        for seed in seeds
    ]
    done = [one.status for one in work.map("moving vehicles", drive, asked)]
    n = len(seeds)
    rows = []
    for k, (road, name) in enumerate(keys):
        endings = done[k * n : (k + 1) * n]
        arrived = endings.count(EpisodeStatus.ARRIVED)
        hits = endings.count(EpisodeStatus.COLLISION)
        rows.append((road, name, n, arrived, hits, n - arrived - hits))
    return ResultTable(
        "beyond_moving",
        "Obstacles that move in cruising (chapter 4)",
        ("road", "planner", "layouts", "arrived", "collisions", "other endings"),
        tuple(rows),
        "Two slow vehicles ahead and an oncoming one at random places and speeds, on a "
        "road of 10 m without lanes. They keep to their script whatever happens, and "
        "the ego has the body of a car.",
    )


def moving(seed: int) -> str:
    """Draw two slow vehicles ahead and one that comes towards the ego."""
    rng = np.random.default_rng([seed, 4])
    first, gap = rng.uniform(25.0, 45.0), rng.uniform(25.0, 40.0)
    places = (first, first + gap, rng.uniform(120.0, 200.0))
    offsets = (rng.uniform(-2.5, 1.5), rng.uniform(-2.5, 1.5), rng.uniform(2.5, 3.5))
    speeds = (rng.uniform(2.0, 7.0), rng.uniform(2.0, 7.0), -rng.uniform(3.0, 8.0))
    vehicles = ", ".join(
        f"{{s_m: {s:.1f}, l_m: {l:.2f}, speed_mps: {v:.2f}}}"
        for s, l, v in zip(places, offsets, speeds, strict=True)
    )
    return f"vehicles=[{vehicles}]"
