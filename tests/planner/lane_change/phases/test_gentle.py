"""Changes keep to the gap that was chosen, or cost no hard braking."""

import numpy as np
import pytest

from planner.lane_change.gaps.choice import GapPlan
from planner.lane_change.phases.change import lets_go_by
from planner.lane_change.phases.gentle import is_gentle
from planner.lane_change.phases.seek_gap import is_in_gap
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed.passing_orders import Side
from planner.states import SpeedProfile

BEFORE, AFTER = Side.BEFORE, Side.AFTER
SETTINGS = LaneChangeSettings()
WAY = np.zeros(2)


def gap(ahead, behind):
    return GapPlan(1, ahead, behind, 0.0, 0.0, 0.0, 0.0, WAY, WAY, 0.5)


def profile(*acceleration):
    a = np.array(acceleration)
    zeros = np.zeros(a.size)
    return SpeedProfile(np.arange(a.size, dtype=float), zeros, zeros, a, zeros)


@pytest.mark.parametrize(
    ("ahead", "behind", "order", "inside"),
    [
        ("a", "b", [("a", AFTER), ("b", BEFORE)], True),
        ("a", "b", [("a", AFTER), ("b", AFTER), ("c", AFTER)], False),
        ("a", "b", [("a", BEFORE), ("b", BEFORE)], False),
        (None, "b", [("b", BEFORE)], True),
        ("a", None, [("a", AFTER), ("z", AFTER)], True),
        ("a", "b", [], True),  # neither of them comes onto the path
    ],
)
def test_an_order_is_in_a_gap_between_its_vehicles(ahead, behind, order, inside):
    assert is_in_gap(tuple(order), gap(ahead, behind)) is inside


def test_a_vehicle_is_let_go_by_if_the_ego_was_to_go_ahead_of_it():
    begun = (("a", AFTER), ("b", BEFORE))
    assert lets_go_by(begun, (("a", AFTER), ("b", AFTER)))
    assert not lets_go_by(begun, (("a", AFTER), ("b", BEFORE), ("new", AFTER)))
    assert not lets_go_by(begun, (("a", BEFORE), ("b", BEFORE)))


def test_gentle_is_hardly_more_than_the_ego_brakes_to_reach_a_gap():
    braking = SETTINGS.gaps.braking
    assert is_gentle(profile(0.0, -braking, 0.0), SETTINGS)
    assert not is_gentle(profile(0.0, -braking - 1.0, 0.0), SETTINGS)
    assert is_gentle(profile(-4.0, -3.0, 0.0), SETTINGS)  # decided before
    assert not is_gentle(profile(-4.0, -4.5, 0.0), SETTINGS)
