import numpy as np
import pytest

from experiments.cosim.sumo.lane_change_guard import (
    NO_LANE_CHANGES,
    OWN_LANE_CHANGES,
    LaneChangeGuard,
    abreast,
)
from planner.states import CartesianState
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

EGO = CartesianState(0.0, 0.0, 0.0, 0.0, 8.0, 0.0)
CENTRE = Vehicle().centre_offset


def car(x, y, heading=0.0):
    return road_users(("car", x, y, heading, 8.0))


@pytest.mark.parametrize(
    ("x", "y", "heading", "inside"),
    [
        (CENTRE, 3.33, 0.0, True),
        (CENTRE + 4.69, -3.33, 0.1, True),  # bumpers still overlap
        (CENTRE + 5.3, 3.33, 0.0, False),  # half a metre clear of the front
        (CENTRE - 5.3, 3.33, 0.0, False),
        (CENTRE, 7.0, 0.0, False),  # two lanes away
        (CENTRE, 5.0, np.pi, False),  # oncoming
    ],
)
def test_only_those_beside_the_ego_are_held(x, y, heading, inside):
    assert abreast(EGO, Vehicle(), car(x, y, heading)) == ({"car"} if inside else set())


def test_turning_everything_changes_nothing():
    turned = CartesianState(0.0, 0.0, np.pi / 2, 0.0, 8.0, 0.0)
    assert abreast(turned, Vehicle(), car(-3.33, CENTRE, np.pi / 2)) == {"car"}


class Recorder:
    def __init__(self):
        self.calls = []
        self.vehicle = self

    def setLaneChangeMode(self, name, mode):
        self.calls.append((name, mode))


def test_a_hold_is_set_once_and_taken_back_once():
    sumo = Recorder()
    guard = LaneChangeGuard(sumo)
    guard.update({"a", "b"}, {"a", "b"})
    guard.update({"a", "b"}, {"a", "b"})
    guard.update({"b"}, {"a", "b"})
    guard.update(set(), {"a"})  # b has left the road
    assert sumo.calls == [
        ("a", NO_LANE_CHANGES),
        ("b", NO_LANE_CHANGES),
        ("a", OWN_LANE_CHANGES),
    ]
