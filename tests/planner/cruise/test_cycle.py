"""The gap that a candidate has to keep to each body."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.cruise.cycle import _allowed_excess
from planner.cruise.steering import wheels_before_start
from planner.cruise.surroundings import _thresholds
from planner.shapes.disc_clearance import gaps_to
from planner.vehicle import Vehicle, VehicleLimits

DISCS, RADIUS, MARGIN = (-0.2, 1.4, 3.0), 1.2, 0.3


def threshold(pose, body, extent):
    """Required gap of an ego at (x, y, heading) to one body."""
    x, y, heading = body
    poses = np.array([[[x], [y], [math.cos(heading)], [math.sin(heading)]]])
    return float(_thresholds(pose, DISCS, RADIUS, poses, np.array([extent]), MARGIN)[0])


@pytest.mark.parametrize("gap", [0.29, 0.1, 0.003, -0.05])
def test_a_gap_below_the_margin_may_not_shrink(gap):
    """An ego that stands would else creep into contact, cycle by cycle."""
    wall = (DISCS[2] + RADIUS + gap + 0.5, 0.0, 0.0)
    required = threshold((0.0, 0.0, 0.0), wall, (0.5, 2.0, 0.0))
    assert gap - 1e-5 < required < gap


def test_what_is_far_away_needs_the_margin():
    for x in (6.0, 60.0, 6000.0):
        assert threshold((0.0, 0.0, 0.3), (x, 1.0, 0.0), (0.0, 0.0, 0.2)) == MARGIN


@pytest.mark.parametrize("place", np.linspace(0.2, 2.9, 7))
def test_straight_on_past_a_body_stays_allowed(place):
    """The gap is the least of the way, wherever the body is beside the discs."""
    heading = 0.7
    pose = 3.0, -2.0, heading
    cos, sin = math.cos(heading), math.sin(heading)
    aside = RADIUS + 0.1
    body = (3.0 + place * cos - aside * sin, -2.0 + place * sin + aside * cos, 0.0)
    required = threshold(pose, body, (0.0, 0.0, 0.0))
    driven = np.linspace(0.0, 8.0, 81)
    points = np.array(
        [3.0 + driven * cos, -2.0 + driven * sin, cos + 0 * driven, sin + 0 * driven]
    )
    poses = np.tile(np.array([[body[0]], [body[1]], [1.0], [0.0]]), (1, 1, driven.size))
    least = gaps_to(points, poses, np.zeros((1, 3)), np.array(DISCS), RADIUS)[0]
    assert required <= least
    assert required == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize("start", [-0.3, -0.05, 0.0, 0.06, 0.0999])
def test_plans_use_the_margin_to_the_roads_edge_and_never_more(start):
    """Cycle after cycle, each plan as near to the edge as it may be."""
    margin, excess = 0.1, start
    for _ in range(200):
        excess = _allowed_excess(excess, margin)
        assert excess <= margin + 1e-5  # the body is at the edge itself


def test_a_body_over_the_edge_may_swing_its_tail_out_on_its_way_back():
    assert _allowed_excess(0.3, 0.1) == pytest.approx(0.4, abs=1e-5)


@given(st.floats(-0.5, 0.5), st.floats(-0.15, 0.15))
def test_wheels_turned_at_a_stand_keep_within_what_they_can(slope, road):
    limits = VehicleLimits(max_curvature=0.15)
    lorry = Vehicle(length=12.0, wheelbase=6.0, rear_overhang=3.0, limits=limits)
    second = wheels_before_start(slope, lorry.wheelbase, lorry, road)
    assert abs(road + second) <= max(0.15, abs(road)) + 1e-12
    assert second * slope <= 0.0  # towards the road, or along it
    assert wheels_before_start(slope, 0.0, lorry, road) == 0.0
