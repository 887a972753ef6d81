import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.thesis.dense.layouts import EGO_RADIUS, random_layout
from planner.dense.field import Cover, straight_field
from planner.dense.lattice.gates import gate_row, strip_points
from planner.dense.lattice.layers import gap_layers, layers, merged
from planner.dense.lattice.profile_map import obstacle_influence, profile
from planner.dense.lattice.waypoints import (
    adaptive_waypoints,
    uniform_waypoints,
    waypoint_counts,
)
from planner.dense.settings import GateReach, LatticeSettings, thesis_lattice
from planner.errors import InvalidInputError

COVER = Cover.single(EGO_RADIUS)
SETTINGS = LatticeSettings()


def field_of(*obstacles):
    return straight_field(np.array(obstacles).reshape(-1, 3), 5.0, 60.0)


def test_map_is_the_printed_one():
    s, l, radius = np.array([10.0, 20.0]), np.array([-1.0, 2.0]), (1.5, 0.7)
    influence = np.array(
        [
            obstacle_influence(
                math.dist((s[i], l[i]), (2.0, 0.5)), radius[i], 2.66, 1.0, 0.04
            )
            for i in range(2)
        ]
    )
    want = 0.0
    for i in range(2):
        h = radius[i] * 2.66 / (0.04 * math.dist((s[i], l[i]), (2.0, 0.5)))
        want += math.exp(-0.8 * math.dist((12.0, 1.0), (s[i], l[i]))) * h
    assert profile(12.0, 1.0, s, l, influence, 0.8) == pytest.approx(want, rel=1e-12)


def test_map_is_finite_where_the_ego_stands_on_an_obstacle():
    assert math.isfinite(obstacle_influence(0.0, 1.0, 2.66, 1.0, 0.04))


def test_uniform_waypoints_make_1365_edges():
    points = uniform_waypoints(field_of(), COVER, 0.0, 60.0, SETTINGS)
    assert points.s == pytest.approx(60.0 / 7.0 * np.arange(1, 8))
    assert points.count.tolist() == [15] * 7
    assert points.l[0] == pytest.approx(np.linspace(-5.0, 5.0, 15))
    assert 15 + 6 * 15**2 == 1365


@given(start=st.floats(0.0, 100.0), gap=st.floats(0.5, 80.0))
def test_free_layers_divide_a_gap_evenly_and_not_below_the_step(start, gap):
    inside = gap_layers(start, start + gap, SETTINGS)
    parts = np.diff([start, *inside, start + gap])
    assert parts == pytest.approx(gap / parts.size)
    assert parts.size == 1 or parts.min() >= SETTINGS.layer_step - 1e-6
    assert parts.max() < 2.0 * SETTINGS.layer_step


def test_printed_layers_step_on_from_each_obstacle():
    printed = thesis_lattice()
    s, at_obstacle = layers(np.array([5.0, 36.0]), 0.0, 60.0, printed)
    assert s == pytest.approx([5.0, 15.0, 25.0, 35.0, 36.0, 46.0, 56.0, 60.0])
    assert at_obstacle.tolist() == [1, 0, 0, 0, 1, 0, 0, 0]


def test_near_obstacles_share_a_layer():
    assert merged(np.array([10.0, 11.5, 13.0, 30.0]), 2.0) == [10.75, 13.0, 30.0]
    s, _ = layers(np.array([-5.0, 20.0, 21.0, 80.0]), 0.0, 60.0, SETTINGS)
    assert 20.5 in s
    assert s[-1] == 60.0


def test_gate_closes_what_a_disc_touches():
    edges = np.linspace(-5.0, 5.0, 21)
    row = gate_row(edges, np.array([[-0.2, 0.7]]))
    assert np.flatnonzero(row == 0.0).tolist() == [9, 10, 11]


def test_counts_are_those_of_equation_5_11():
    counts = waypoint_counts(
        np.array([8.0, 4.0, 1.0, 0.0]), np.array([1.0, 1.0, 1.0, 0.0]), 4
    )
    assert counts.tolist() == [0.0, 2.0, 4.0, 0.0]  # round half up, gate closes


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4), same=st.booleans())
def test_no_adaptive_waypoint_lies_in_an_inflated_disc(seed, n, same):
    field = straight_field(random_layout(n, seed=seed, same_size=same), 5.0, 60.0)
    points = adaptive_waypoints(field, COVER, (0.0, 0.0), 60.0, SETTINGS)
    assert np.all(np.diff(points.s) > 0.0)
    for s, row, count in zip(points.s, points.l, points.count, strict=True):
        assert np.all(np.abs(row[:count]) <= 5.0)
        assert np.all(np.diff(row[:count]) >= 0.0)
        if np.min(np.abs(field.s - s)) > 1.0:
            continue  # a free layer
        away = np.hypot(field.s[:, None] - s, field.l[:, None] - row[:count])
        assert np.all(away >= field.radius[:, None] + EGO_RADIUS - 1e-9)


def test_size_and_ego_distance_weights_are_inert():
    field = field_of((20.0, 1.0, 1.58), (33.0, -2.0, 0.71))
    base = adaptive_waypoints(field, COVER, (0.0, 0.0), 60.0, SETTINGS)
    other = replace(SETTINGS, size_weight=7.0, distance_weight=3.0)
    changed = adaptive_waypoints(field, COVER, (0.0, 0.0), 60.0, other)
    assert np.array_equal(base.l, changed.l)


def test_centre_only_gate_leaves_waypoints_in_discs():
    field = field_of((30.0, 0.0, 1.58))
    centre = replace(SETTINGS, gate_reach=GateReach.CENTRE, narrow_strips=False)
    points = adaptive_waypoints(field, COVER, (0.0, 0.0), 60.0, centre)
    inside = [
        np.sum(np.abs(row[:n]) < 4.24)
        for s, row, n in zip(points.s, points.l, points.count, strict=True)
        if s == 30.0
    ]
    assert inside[0] > 0


def test_a_strip_narrower_than_a_region_gets_one_waypoint():
    cuts = np.array([[-4.6, 5.7]])
    assert strip_points(np.empty(0), -5.0, 5.0, cuts) == pytest.approx([-4.8])
    assert strip_points(np.array([-4.9]), -5.0, 5.0, cuts).size == 0
    assert strip_points(np.empty(0), -5.0, 5.0, np.array([[-6.0, 6.0]])).size == 0
    two = np.array([[-6.0, -1.0], [-0.5, 6.0]])
    assert strip_points(np.empty(0), -5.0, 5.0, two) == pytest.approx([-0.75])


def test_settings_refuse_what_cannot_be_sampled():
    with pytest.raises(InvalidInputError, match="layer_step = 0"):
        LatticeSettings(layer_step=0.0)
