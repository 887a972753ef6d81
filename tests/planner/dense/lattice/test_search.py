import itertools
from dataclasses import replace

import numpy as np
import pytest

from experiments.thesis.dense.layouts import random_layout
from planner.dense.field import Cover, straight_field
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice.edges import blend_price, quintic_price
from planner.dense.lattice.search import search_lattice
from planner.dense.lattice.waypoints import (
    Waypoints,
    adaptive_waypoints,
    uniform_waypoints,
)
from planner.dense.settings import EdgeChecks, LatticeSettings, SafetyCost
from planner.numerics.polynomials import quintic_coefficients
from planner.vehicle import Vehicle

COVER = Cover.single(2.66)
NARROW = Cover.single(2.0)
START = PathStart(0.0, 0.3, 0.05, 0.01)
STILL = PathStart(0.0, 0.0, 0.0, 0.0)


def small_lattice(seed):
    random = np.random.default_rng(seed)
    l = np.sort(random.uniform(-5.0, 5.0, (3, 4)), axis=1)
    return Waypoints(np.array([14.0, 26.0, 40.0]), l, np.array([4, 3, 4]))


def chain_cost(points, nodes, settings):
    """Cost of one chain, edge by edge through single-edge searches."""
    total = 0.0
    last_s, last_l = START[0], START[1]
    for k, node in enumerate(nodes):
        s, l = points.s[k], points.l[k, node]
        length = s - last_s
        if k == 0:
            c = quintic_coefficients(*START[1:], l, 0.0, 0.0, length)
            offset, smooth = quintic_price(c, length)
        else:
            offset, smooth = blend_price(last_l, l, length)
        total += settings.offset_weight * offset + settings.smoothness_weight * smooth
        last_s, last_l = s, l
    return total


@pytest.mark.parametrize("seed", range(8))
def test_the_chain_is_the_cheapest_of_all(seed):
    settings = LatticeSettings(safety_weight=0.0)
    points = small_lattice(seed)
    field = straight_field(np.array([[20.0, 1.0, 0.5], [33.0, -2.0, 0.6]]), 5.0, 60.0)
    found = search_lattice(field, NARROW, START, points, settings)

    def free(nodes):
        """Search the lattice of these nodes alone."""
        l = points.l[np.arange(3), list(nodes)][:, None]
        only = Waypoints(points.s, l, np.ones(3, dtype=np.int64))
        return search_lattice(field, NARROW, START, only, settings).complete

    chains = [
        (chain_cost(points, nodes, settings), nodes)
        for nodes in itertools.product(range(4), range(3), range(4))
        if free(nodes)
    ]
    assert found.edges == 4 + 12 + 12
    assert found.complete == bool(chains)
    if chains:
        cost, nodes = min(chains)
        assert found.path.cost == pytest.approx(cost, rel=1e-12)
        assert found.path.l[1:] == pytest.approx(points.l[np.arange(3), list(nodes)])


@pytest.mark.parametrize("same_size", [True, False])
@pytest.mark.parametrize("cover", [COVER, Cover.of(Vehicle())], ids=["disc", "body"])
def test_checking_only_what_is_needed_changes_nothing(cover, same_size):
    lazy = LatticeSettings(edge_checks=EdgeChecks.NEEDED)
    full = replace(lazy, edge_checks=EdgeChecks.ALL)
    for seed in range(25):
        rows = random_layout(4, seed=seed, same_size=same_size)
        field = straight_field(rows, 5.0, 60.0)
        points = adaptive_waypoints(field, cover, START[:2], 60.0, full)
        a = search_lattice(field, cover, START, points, lazy)
        b = search_lattice(field, cover, START, points, full)
        assert a.complete == b.complete
        assert a.edges == b.edges == b.checked_edges >= a.checked_edges
        if b.path is not None:
            assert np.array_equal(a.path.l, b.path.l)
            assert a.path.cost == b.path.cost


def test_some_of_these_lattices_are_passable():
    field = straight_field(np.array([[20.0, 1.0, 0.5], [33.0, -2.0, 0.6]]), 5.0, 60.0)
    found = [
        search_lattice(field, NARROW, START, small_lattice(seed), LatticeSettings())
        for seed in range(8)
    ]
    assert 0 < sum(search.complete for search in found) < 8


def test_a_blocked_road_is_driven_as_far_as_it_goes():
    wall = np.array([[40.0, l, 2.0] for l in (-4.0, 0.0, 4.0)])
    field = straight_field(wall, 5.0, 60.0)
    points = uniform_waypoints(field, COVER, 0.0, 60.0, LatticeSettings())
    search = search_lattice(
        field, COVER, PathStart(0.0, 0.0, 0.0, 0.0), points, LatticeSettings()
    )
    assert not search.complete
    assert search.path.s[-1] == pytest.approx(60.0 / 7.0 * 4)
    assert search.collision_edges > 0


def test_an_ego_among_obstacles_has_no_free_edge():
    field = straight_field(np.array([[0.5, 0.0, 1.0]]), 5.0, 60.0)
    points = uniform_waypoints(field, COVER, 0.0, 60.0, LatticeSettings())
    every = LatticeSettings(edge_checks=EdgeChecks.ALL)
    search = search_lattice(field, COVER, STILL, points, every)
    assert search.path is None
    assert search.effectiveness == pytest.approx(1.0 - 15 / 1365)


def test_coarse_path_is_smooth_to_the_second_derivative():
    field = straight_field(np.array([[20.0, 1.0, 0.5]]), 5.0, 60.0)
    points = uniform_waypoints(field, COVER, 0.0, 60.0, LatticeSettings())
    path = search_lattice(field, COVER, START, points, LatticeSettings()).path
    l, slope, second = path.at(np.array([0.0]))
    assert [l[0], slope[0], second[0]] == pytest.approx(START[1:])
    for node in path.s[1:-1]:
        before, after = (
            path.at(np.array([node - 1e-9])),
            path.at(np.array([node + 1e-9])),
        )
        assert np.ravel(before) == pytest.approx(np.ravel(after), abs=1e-7)
    s = np.linspace(0.0, 60.0, 60_001)
    l, slope, _ = path.at(s)
    assert np.gradient(l, s)[1:-1] == pytest.approx(slope[1:-1], abs=1e-6)


def test_printed_safety_hardly_acts():
    field = straight_field(np.array([[20.0, 1.0, 0.5], [33.0, -2.0, 1.0]]), 5.0, 60.0)
    points = uniform_waypoints(field, COVER, 0.0, 60.0, LatticeSettings())
    printed = LatticeSettings(safety_cost=SafetyCost.PRINTED)
    with_it = search_lattice(field, COVER, START, points, printed)
    without = search_lattice(
        field, COVER, START, points, replace(printed, safety_weight=0.0)
    )
    assert np.array_equal(with_it.path.l, without.path.l)
    assert with_it.path.cost > without.path.cost
