import numpy as np
import pytest

from experiments.cosim.sumo.ego_entry import CLEARANCE, REACTION, stands_free
from planner.scene import RoadUsers
from planner.states import CartesianState
from planner.vehicle import Vehicle

CAR = Vehicle()
BRAKING = CAR.limits.max_deceleration


def other(gap, speed, *, l=0.0, heading=0.0, lateral=0.0):
    """Place a car of 5 x 2 m bumper to bumper from the ego, behind it if gap < 0."""
    reach = (CAR.length + 5.0) / 2.0
    x = CAR.centre_offset + gap + np.copysign(reach, gap)
    columns = [[x], [l], [heading], [speed], [0.0], [lateral], [5.0], [2.0]]
    return RoadUsers(("car",), *np.array(columns))


def free(speed, there):
    start = CartesianState(0.0, 0.0, 0.0, 0.0, speed, 0.0)
    return stands_free(CAR, start, there)


@pytest.mark.parametrize(
    ("ego", "leader"), [(8.5, 8.5), (8.5, 5.0), (12.0, 0.0), (4.0, 9.0)]
)
def test_gap_ahead_is_enough_to_brake(ego, leader):
    longer = (ego**2 - leader**2) / (2.0 * BRAKING)
    needed = max(REACTION * ego + longer, CLEARANCE)
    assert not free(ego, other(needed - 0.05, leader))
    assert free(ego, other(needed + 0.05, leader))


@pytest.mark.parametrize(("ego", "follower"), [(8.5, 8.5), (0.0, 13.0), (9.0, 12.0)])
def test_gap_behind_is_enough_to_brake(ego, follower):
    needed = REACTION * follower + (follower**2 - ego**2) / (2.0 * BRAKING)
    assert not free(ego, other(-needed + 0.05, follower))
    assert free(ego, other(-needed - 0.05, follower))


def test_vehicles_beside_or_against_the_ego_do_not_count():
    assert free(10.0, other(1.0, 3.0, l=3.3))
    assert free(10.0, other(20.0, 10.0, l=-3.3, heading=np.pi))


def test_lane_changer_ahead_counts_where_it_will_be():
    assert free(10.0, other(1.5, 8.0, l=2.6))
    assert not free(10.0, other(1.5, 8.0, l=2.6, lateral=-1.2))
