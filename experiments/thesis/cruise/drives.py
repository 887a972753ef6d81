"""Drives of chapter 4: its planners on its roads, and measures for its claims.

The printed planner takes the ego for a disc of 1 m about its rear axle, and as
published it has collided when that disc has. So its world holds a body that lies in the
disc; how near the body of a car would have come is measured beside it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from experiments.config.scenario_file import load_scenario
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import EpisodeStatus, StepRecord
from experiments.metrics.comfort import JERK_COST, OFFSET_COST
from experiments.thesis.cruise.random_layouts import RANDOM
from experiments.world_setup.layout import make_layout
from experiments.world_setup.obstacles import listed_obstacles
from experiments.world_setup.road import Layout
from experiments.world_setup.world import make_world
from planner.cruise import (
    ONLY_PRINTED,
    CruisePlanner,
    SafetyTerm,
    Weights,
    proposed,
    thesis_conventional,
    thesis_proposed,
)
from planner.cruise.settings import thesis_settings
from planner.interface import Planner
from planner.prediction import constant_speed
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, Prediction, RoadUsers
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle

PROPOSED, CONVENTIONAL = "proposed", "conventional"
ONLY_JERK, JERK_AND_SAFETY = "jerk", "jerk and safety"
CLOSED_LOOP = "closed loop"
IN_DISC = (  # a body of the usual width inside the disc of 1 m
    "ego.vehicle={length_m: 0.6, width_m: 1.9, wheelbase_m: 0.3, rear_overhang_m: 0.3}"
)
CAR = Vehicle()
LEAST_WAY = 20.0  # that is left after an obstacle to come back [m]


def _with_weights(jerk: float, safety: float, offset: float) -> Callable[[], Planner]:
    """Build the printed planner with other weights of jerk, safety and offset."""

    def make() -> Planner:
        weights = Weights(jerk, safety, offset, *ONLY_PRINTED)
        return CruisePlanner(thesis_settings(SafetyTerm.SIZE_CONVOLUTION, weights))

    return make


METHODS: Mapping[str, Callable[[], Planner]] = {
    PROPOSED: thesis_proposed,
    CONVENTIONAL: thesis_conventional,
    ONLY_JERK: _with_weights(0.4, 0.0, 0.0),
    JERK_AND_SAFETY: _with_weights(0.4, 0.3, 0.0),
    CLOSED_LOOP: proposed,
}


@dataclass(frozen=True, slots=True)
class Drive:
    """Definition of one drive: the published layout, or `overrides`."""

    road: str
    method: str
    seed: int = 0
    overrides: tuple[str, ...] = ()
    disc: bool = True  # the world holds the disc as published, not a car
    blind: bool = False  # the planner takes every vehicle for one that stands


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """Result of a drive; arrays have one element per cycle."""

    status: EpisodeStatus
    clearance: float  # least, of the driven body to any obstacle [m]
    car_clearance: float  # least, of the rectangle of a car, in any cycle [m]
    farthest_return: float  # see `farthest_return` [m]
    jerk: FloatArray  # J_jerk of the chosen trajectory [m²/s⁵]
    offset: FloatArray  # J_offset of it [m²]
    s: FloatArray  # [m]
    l: FloatArray  # [m]
    obstacles: tuple[tuple[float, float, float], ...]  # s, l, radius [m]

    @property
    def arrived(self) -> bool:
        """Whether the ego reached its goal without a collision."""
        return self.status is EpisodeStatus.ARRIVED

    @property
    def mean_jerk(self) -> float:
        """Mean over the cycles."""
        return float(self.jerk.mean())

    @property
    def mean_offset(self) -> float:
        """Mean over the cycles."""
        return float(self.offset.mean())


def random_drive(road: str, method: str, seed: int) -> Drive:
    """Describe a drive among random obstacles, as published."""
    return Drive(road, method, seed, (RANDOM,))


def standing(
    path: ReferencePath,
    vehicles: RoadUsers,
    times: FloatArray,
    lanes: Lanes | None = None,
) -> Prediction:
    """Predict every vehicle as a static obstacle, as [Thesis] ch. 4 does."""
    none = np.zeros(len(vehicles.ids))
    still = replace(vehicles, speed=none, acceleration=none, lateral_speed=none)
    return constant_speed(path, still, times, lanes)


def drive(asked: Drive) -> Driven:
    """Drive in the world without a simulator."""
    scenario = load_scenario(
        f"thesis_{asked.road}",
        seed=asked.seed,
        overrides=(*asked.overrides, *((IN_DISC,) if asked.disc else ())),
    )
    layout = make_layout(scenario)
    records: list[StepRecord] = []
    ending = run_loop(
        make_world(scenario, layout, Path()),
        METHODS[asked.method](),
        PerfectTracking(),
        layout.task,
        EpisodeOptions(
            scenario.simulation.duration_s,
            predictor=standing if asked.blind else constant_speed,
        ),
        records.append,
    )
    discs = tuple(
        (o.s_m, o.l_m, float(o.radius_m or 0.0))
        for o in listed_obstacles(scenario, layout)
    )
    return _driven(ending.status, records, layout, discs, layout.task.goal)


def _driven(
    status: EpisodeStatus,
    records: list[StepRecord],
    layout: Layout,
    obstacles: tuple[tuple[float, float, float], ...],
    goal: float,
) -> Driven:
    """Measure a drive."""
    on_road = [r.ego_frenet for r in records if r.ego_frenet is not None]
    s, l = (np.array([getattr(state, name) for state in on_road]) for name in "sl")
    costs = [r.plan.stats.costs for r in records if r.plan is not None]
    return Driven(
        status,
        min(record.clearance for record in records),
        min(car_clearance(record.ego, layout.road.obstacles) for record in records),
        farthest_return(s, l, [o[0] for o in obstacles], goal),
        np.array([c[JERK_COST] for c in costs if JERK_COST in c]),
        np.array([c[OFFSET_COST] for c in costs if OFFSET_COST in c]),
        s,
        l,
        obstacles,
    )


def car_clearance(ego: CartesianState, discs: Obstacles) -> float:
    """Return the distance of a car's rectangle to the nearest disc, < 0 inside [m]."""
    dx, dy = discs.x - ego.x, discs.y - ego.y
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    ahead = np.abs(dx * cos + dy * sin - CAR.centre_offset) - 0.5 * CAR.length
    aside = np.abs(dy * cos - dx * sin) - 0.5 * CAR.width
    outside = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0))
    inside = np.minimum(np.maximum(ahead, aside), 0.0)
    return float((outside + inside - discs.radius).min(initial=np.inf))


def farthest_return(
    s: FloatArray, l: FloatArray, obstacles: list[float], goal: float
) -> float:
    """Return the largest of the smallest offsets after each obstacle [m].

    For each obstacle the least |l| from it to the next one or the goal; where less
    than 20 m are left, there is no room to come back.
    """
    ends = [*obstacles, goal][1:]
    worst = 0.0
    for start, end in zip(obstacles, ends, strict=True):
        between = np.abs(l[(s > start) & (s < end)])
        if end - start >= LEAST_WAY and between.size:
            worst = max(worst, float(between.min()))
    return worst
