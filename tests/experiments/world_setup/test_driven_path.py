from dataclasses import replace

import numpy as np
import pytest
import shapely

from experiments.cosim.collision_monitor import OUTLINE
from experiments.world_setup.driven_path import (
    CUT,
    driven_path,
)
from experiments.world_setup.path_stretches import TOLERANCE, body_polygons
from experiments.world_setup.road import sumo_road
from planner.reference_path.path import ReferencePath
from planner.vehicle import Vehicle
from sumo_nets.catalogue import networks
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network
from sumo_nets.route_path import route_path
from sumo_nets.routes import random_route
from tests.sumo_nets.generated import generate

CAR = Vehicle()
# all but those whose streets meet at corners
CORNERED = ("town", "on_ramp")
SHIPPED = [net for name, net in networks().items() if name not in CORNERED]
RAMP = networks()["on_ramp"]
RAMP_LANE = 3.5  # width [m]


def grid(folder, *options):
    return read_net(generate(folder, "--grid", "--grid.number=4", *options))


def over_the_edge(road, s):
    """Measure as the monitor does how far the body on the path is off the road."""
    at = road.path.at(s)
    half = np.array([CAR.length, CAR.width]) / 2.0
    along, across = (OUTLINE * half).T
    along = along + CAR.centre_offset
    x = at.x[:, None] + at.cos_heading[:, None] * along
    y = at.y[:, None] + at.sin_heading[:, None] * along
    x, y = x - at.sin_heading[:, None] * across, y + at.cos_heading[:, None] * across
    near = np.repeat(s, along.size)
    foot, l = road.path.project(x.ravel(), y.ravel(), near=near)
    left, right = road.bounds.at(foot)
    return max(float((l - left).max()), float((right - l).max()))


def test_corners_of_a_ramp_are_cut_inside_its_lane():
    """Three corners of 3 to 10 degrees, one drawn by netconvert as a short curve."""
    found = route_path(RAMP.net_file, RAMP.route, RAMP.lane)
    sharp = ReferencePath.from_polyline(found.points)
    eased = driven_path(found, CAR).path
    s = np.arange(0.0, 320.0, 0.25)
    assert np.abs(sharp.at(s).curvature).max() > 0.03
    assert np.abs(eased.at(s).curvature).max() < 0.013
    _, l = eased.project(found.points[:, 0], found.points[:, 1], near=found.s)
    assert 0.3 < np.abs(l).max() < CUT + 0.1
    wide = replace(CAR, width=RAMP_LANE - 0.2)  # hardly any room beside it
    _, l = driven_path(found, wide).path.project(
        found.points[:, 0], found.points[:, 1], near=found.s
    )
    assert np.abs(l).max() < 0.05 + 0.1


@pytest.mark.parametrize("network", SHIPPED, ids=lambda network: network.name)
def test_shipped_roads_are_the_smoothed_lanes(network):
    found = route_path(network.net_file, network.route, network.lane)
    driven = driven_path(found, CAR)
    smooth = ReferencePath.from_polyline(found.points)
    assert driven.planned == ()
    np.testing.assert_array_equal(driven.path.x, smooth.x)
    np.testing.assert_array_equal(driven.path.curvature, smooth.curvature)


def check_routes(net, count):
    """Drive random routes; return how many needed a plan and how many were refused."""
    planned, refused = 0, []
    for seed in range(count):
        route = random_route(net, np.random.default_rng(seed), 250.0)
        lane = net.edges[route[0]].drivable_lanes[0].index
        found = route_path(net.file, route, lane)
        try:
            driven = driven_path(found, CAR)
        except NetworkError as error:
            refused.append(str(error))
            continue
        planned += bool(driven.planned)
        s = np.arange(0.0, driven.path.length, 0.2)
        assert np.abs(driven.path.at(s).curvature).max() <= CAR.limits.max_curvature
        bodies = body_polygons(driven.path, s, CAR)
        widest = found.areas.between(0.0, found.length).widest
        assert shapely.covers(widest.buffer(2.0 * TOLERANCE), bodies).all()
        road = sumo_road(Network.from_file(net.file, route, lane), CAR)
        assert over_the_edge(road, s[5:-20]) < -0.05
        stops = [stop.s for stop in road.stop_lines]
        assert stops == sorted(stops)
    assert all("a bend that this body cannot take" in line for line in refused)
    return planned, len(refused)


@pytest.mark.parametrize(
    "options",
    [
        ("-L1",),
        pytest.param(
            ("-L2", "--default-junction-type=traffic_light"), marks=pytest.mark.slow
        ),
        pytest.param(("-L2", "--lefthand"), marks=pytest.mark.slow),
        pytest.param(("-L3", "--default.lanewidth=2.8"), marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_random_routes_keep_curvature_area_and_bounds(tmp_path, options):
    planned, refused = check_routes(grid(tmp_path, *options), 4)
    assert planned > 0
    assert refused <= 1


@pytest.mark.slow
def test_bend_that_is_too_narrow_names_place_and_curvature(tmp_path):
    net = grid(tmp_path, "-L1")
    route = next(
        (before.id, after.target.edge.id)
        for before in net.roads
        for after in before.lanes[0].links
        if abs(turn(before, after.target.edge)) > 1.0
    )
    found = route_path(net.file, route, 0)
    # too long also with the oncoming lanes
    lorry = replace(CAR, length=18.0, wheelbase=11.0, rear_overhang=3.0)
    with pytest.raises(NetworkError) as caught:
        driven_path(found, lorry)
    message = str(caught.value)
    assert f'lane ":{net.edges[route[0]].end}_' in message
    assert "1/m, the ego has 0.2 and would be" in message


def turn(before, after):
    """Return the angle between two roads [rad]."""
    first = np.subtract(*before.lanes[0].points[[-1, -2]])
    second = np.subtract(*after.lanes[0].points[[1, 0]])
    cross = first[0] * second[1] - first[1] * second[0]
    return np.arctan2(cross, first @ second)


def test_left_hand_carriageway_is_the_mirror_of_the_right_hand_one(tmp_path):
    paths = []
    for options in ((), ("--lefthand",)):
        folder = tmp_path / f"f{len(options)}"
        folder.mkdir()
        net = grid(folder, "-L2", *options)
        paths.append(route_path(net.file, ["A1B1", "B1C1"], 0))
    right, left = paths
    assert left.left_hand
    assert not right.left_hand
    assert left.left[5] == pytest.approx(-right.right[5]) == pytest.approx(1.6)
    assert left.right[5] == pytest.approx(-right.left[5]) == pytest.approx(-4.8)
