"""The road of a scenario in a SUMO network: lanes, bounds, and where it may end."""

import numpy as np
import pytest

from experiments.world_setup.road import sumo_road
from experiments.world_setup.road_lanes import _LaneRow
from planner.cruise.feasibility import RoadBend, RoadBody, road_excess
from planner.reference_path.linear_curvature import CURVATURE, RATE, S
from planner.reference_path.road_turn import circle_to, turn_of_pieces
from planner.vehicle import Vehicle
from sumo_nets.catalogue import network
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network
from sumo_nets.routes import random_route
from tests.sumo_nets.generated import generate

CAR = Vehicle()


def test_a_lane_goes_on_as_its_connections_lead():
    """The path leaves the lane that ends for the one that leads on."""
    road = sumo_road(network("on_ramp"), CAR)
    ramp, beside, main = (0,), (0, 1, 2), (1, 2)
    for s, there in ((50.0, ramp), (350.0, beside), (500.0, beside), (560.0, main)):
        centres, widths = road.lanes.at(s)
        assert tuple(np.flatnonzero(widths > 0.5)) == there
        on = 0 if s < 400.0 else 1  # the path moves over in the middle of the edge
        assert centres[on] == pytest.approx(0.0, abs=0.1)


def test_an_ego_on_its_path_is_on_its_road_as_planners_see_it(tmp_path):
    """Also where the bounds under its front are narrower than under its axle."""
    net = read_net(generate(tmp_path, "--grid", "--grid.number=4", "-L1", "--seed=5"))
    body = RoadBody(CAR.front_reach, CAR.rear_overhang, CAR.width / 2.0 + 0.1)
    tried = 0
    for seed in range(4):
        route = random_route(net, np.random.default_rng(seed), 250.0)
        try:
            road = sumo_road(Network.from_file(net.file, route, 0), CAR)
        except NetworkError:
            continue
        tried += 1
        knots = road.path.table.knots
        turn = turn_of_pieces(knots[:, S], knots[:, CURVATURE], knots[:, RATE])
        for s in np.arange(10.0, road.path.length - 20.0, 0.4):
            left, right = road.bounds.at(np.array([s, s + CAR.front_reach]))
            axle = float(road.path.at(s).curvature)
            front, rear = (
                circle_to(s, ahead, turn)[0] for ahead in (body.front, -body.rear)
            )
            bend = RoadBend(front, axle, rear)
            edges = float(left.min()), float(right.max())
            excess = road_excess(0.0, 1.0, 0.0, bend, *edges, body)
            assert excess < 0.0, (seed, s)
    assert tried > 1


LORRY = Vehicle(length=16.0, width=2.5, wheelbase=12.0, rear_overhang=2.0)


@pytest.mark.slow
@pytest.mark.parametrize("goal", [None, 250.0])
def test_a_turn_that_is_too_narrow_before_the_goal_is_refused(goal):
    with pytest.raises(NetworkError, match="cannot take"):
        sumo_road(network("t_junction"), LORRY, None, goal)


def test_what_cannot_be_driven_beyond_the_goal_is_left_out():
    road = sumo_road(network("t_junction"), LORRY, None, 100.0)
    assert 150.0 < road.path.length < 200.0


def test_beside_a_path_that_swings_out_the_other_lanes_stay_where_they_are():
    free = np.zeros((3, 2), dtype=bool)
    row = _LaneRow(0.0, np.array([-3.2, 0.0, 3.2]), np.full(3, 3.2), free)
    moved = row.moved(5.0, 0.7, on_path=True)
    assert moved.centre.tolist() == pytest.approx([-2.5, 0.0, 3.9])
    assert row.moved(5.0, 0.1, on_path=False).centre[1] == pytest.approx(0.1)
