"""Dense obstacles: one whole cycle of each method, four obstacles and 25."""

import numpy as np
import pytest

from experiments.thesis.dense.layouts import DIFFERENT_SIZES, EGO_RADIUS
from planner.dense import adaptive, proposed, uniform
from planner.dense.field import Cover, straight_field
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice_methods import plan_adaptive, plan_uniform
from planner.dense.settings import (
    EdgeChecks,
    LatticeSettings,
    SideSettings,
    SmoothingSettings,
)
from planner.dense.sides.sequences import plan_sides
from planner.vehicle import Vehicle
from tests.planner.scenes import Disc, ego_on, make_scene, straight

pytestmark = pytest.mark.bench

STILL = PathStart(0.0, 0.0, 0.0, 0.0)
FEW = DIFFERENT_SIZES.array()
RANDOM = np.random.default_rng(4)
MANY = np.column_stack(
    [
        np.linspace(8.0, 56.0, 25),
        np.where(np.arange(25) % 2, 4.5, -4.5) + RANDOM.uniform(-0.4, 0.4, 25),
        RANDOM.uniform(0.3, 0.9, 25),
    ]
)


@pytest.mark.parametrize("obstacles", [FEW, MANY], ids=["four", "many"])
@pytest.mark.parametrize(
    "cover", [Cover.single(EGO_RADIUS), Cover.of(Vehicle())], ids=["disc", "body"]
)
@pytest.mark.parametrize("checks", EdgeChecks)
@pytest.mark.parametrize("plan", [plan_uniform, plan_adaptive])
def test_whole_cycle(benchmark, plan, checks, cover, obstacles):
    field = straight_field(obstacles, 5.0, 60.0)
    lattice, smoothing = LatticeSettings(edge_checks=checks), SmoothingSettings()
    planned = benchmark(plan, field, cover, STILL, 60.0, lattice, smoothing)
    assert planned.search.edges > 500


@pytest.mark.parametrize("obstacles", [FEW, MANY], ids=["four", "many"])
@pytest.mark.parametrize(
    "cover", [Cover.single(EGO_RADIUS), Cover.of(Vehicle())], ids=["disc", "body"]
)
@pytest.mark.parametrize("alternatives", [0, 1])
def test_side_sequences(benchmark, alternatives, cover, obstacles):
    field = straight_field(obstacles, 5.0, 60.0)
    settings = SideSettings(alternatives=alternatives)
    found = benchmark(plan_sides, field, cover, STILL, 60.0, settings)
    assert found.exact


@pytest.mark.parametrize("planner", [proposed(), adaptive(), uniform()])
def test_whole_cycle_with_speed(benchmark, planner):
    path = straight()
    discs = [Disc(s + 10.0, l, r) for s, l, r in FEW]
    scene = make_scene(path, ego_on(path, s=10.0, speed=8.0), discs, target_speed=8.0)
    memory = planner.plan(scene, None).memory
    result = benchmark(planner.plan, scene, memory)
    assert result.trajectory is not None
