"""Leaving out candidates that cannot win changes nothing but the statistics."""

from dataclasses import fields, replace

import numpy as np
import pytest

from planner import cruise
from planner.cruise.selection import Pricing
from planner.interface import PlanStatus
from planner.scene import Obstacles
from planner.states import Trajectory
from tests.planner.scenes import (
    Car,
    Disc,
    bend,
    ego_on,
    make_scene,
    road,
    straight,
    winding,
)

PATHS = [straight(), bend(40.0), bend(-25.0), winding()]
FINE = replace(cruise.CruiseSettings(), lateral_step=0.25)
PLANNERS = [cruise.proposed(), cruise.proposed(FINE)]
QUICK, ALL = 150, 5000  # scenes, each for both planners


def random_scene(rng):
    """Bodies, traffic, curves, narrow roads and stop lines about an ego in motion."""
    path = PATHS[rng.integers(len(PATHS))]
    s, l = rng.uniform(0.0, min(path.length - 20.0, 90.0)), rng.uniform(-2.0, 2.0)
    speed = rng.choice([0.0, rng.uniform(0.0, 4.0), rng.uniform(4.0, 18.0)])
    acceleration = rng.uniform(-2.0, 2.0) if speed > 2.0 else 0.0
    ego = ego_on(path, s, l, speed, rng.normal(0.0, 0.05), acceleration=acceleration)
    discs = [
        Disc(s + rng.uniform(-5.0, 60.0), rng.uniform(-5.0, 5.0), rng.uniform(0.2, 2.0))
        for _ in range(rng.integers(0, 8))
    ]
    cars = [
        Car(
            s + rng.uniform(-40.0, 60.0),
            rng.choice([-3.5, 0.0, 3.5]) + rng.normal(0.0, 0.3),
            rng.uniform(-12.0, 15.0),
            turned=rng.normal(0.0, 0.1),
        )
        for _ in range(rng.integers(0, 6))
    ]
    return make_scene(
        path,
        ego,
        discs,
        cars,
        bounds=road(path, rng.uniform(2.0, 7.0), -rng.uniform(2.0, 7.0)),
        stop_lines=(s + rng.uniform(-2.0, 60.0),) if rng.random() < 0.3 else (),
        target_speed=rng.uniform(2.0, 16.0),
        near=s,
    )


def plans(seed):
    """Yield (with full statistics, without) of one random scene, with memory or not."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    for planner in PLANNERS:
        memory = None
        if rng.random() < 0.7:
            memory = planner.plan(replace(scene, obstacles=Obstacles.none()), None)
            memory = memory.memory
        lazily = replace(scene, full_statistics=False)
        yield planner.plan(scene, memory), planner.plan(lazily, memory)


def check_equal(full, lazy):
    assert lazy.status is full.status
    for column in fields(Trajectory):
        one, other = (getattr(p.trajectory, column.name) for p in (full, lazy))
        assert np.array_equal(one, other), column.name
    for name in ("candidates", "costs", "blocker", "reason"):
        assert getattr(lazy.stats, name) == getattr(full.stats, name), name
    if lazy.stats.survivors is None:
        assert not lazy.stats.removed
    else:
        assert lazy.stats == full.stats


def compare(n):
    left_out = hits = 0
    for seed in range(n):
        for full, lazy in plans(seed):
            check_equal(full, lazy)
            left_out += lazy.stats.survivors is None
            hits += full.status is PlanStatus.OK and full.stats.blocker is not None
    # else nothing was compared
    assert left_out > 0.8 * n
    assert hits > 0.3 * n


def test_the_same_candidate_wins():
    compare(QUICK)


@pytest.mark.slow
def test_the_same_candidate_wins_in_ten_thousand_cycles():
    compare(ALL)


def test_drawn_candidates_are_judged_nevertheless():
    full, lazy = next(plans(2))
    assert lazy.stats.survivors is None
    assert full.alternatives is not None
    assert lazy.alternatives is not None
    for one, other in zip(full.alternatives(), lazy.alternatives(), strict=True):
        assert one.verdict == other.verdict
        assert np.array_equal(one.x, other.x)
        assert np.array_equal(one.y, other.y)


def test_costs_that_depend_on_other_candidates_are_not_bounded():
    assert Pricing.of(cruise.proposed().settings).separable
    negative = replace(cruise.Weights(), offset=-1.0)
    for planner in (
        cruise.conventional(),
        cruise.thesis_proposed(),
        cruise.thesis_conventional(),
        cruise.proposed(replace(cruise.CruiseSettings(), weights=negative)),
    ):
        assert not Pricing.of(planner.settings).separable
