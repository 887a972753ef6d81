from itertools import pairwise

import numpy as np
import pytest
import shapely

from sumo_nets.drivable_area import (
    boundary_about,
    distances_to_edge,
    drivable_area,
    narrower_areas,
)
from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.route_path import route_path
from tests.sumo_nets.generated import generate


@pytest.fixture(scope="module")
def crossing(tmp_path_factory):
    """Generate a grid with pavements and two lanes each way."""
    folder = tmp_path_factory.mktemp("crossing")
    file = generate(
        folder, "--grid", "--grid.number=3", "-L2", "--sidewalks.guess",
        "--sidewalks.guess.from-permissions", "false",
    )  # fmt: skip
    return read_net(file)


def strip(lane):
    return shapely.LineString(lane.points).buffer(lane.width / 2.0, cap_style="flat")


def test_area_holds_own_lanes_and_junction_but_nothing_of_others(crossing):
    route = ["A1B1", "B1B2"]
    area = drivable_area(crossing, choose_lanes(crossing, route, 2))
    for edge in route:
        for lane in crossing.edges[edge].drivable_lanes:
            assert shapely.covers(area, strip(lane))
        pavements = [x for x in crossing.edges[edge].lanes if not x.drivable]
        assert pavements
        for lane in pavements:
            assert shapely.area(area & strip(lane)) < 0.1 * strip(lane).area
    for other in ("B1A1", "B2B1", "B1C1"):
        for lane in crossing.edges[other].drivable_lanes:
            assert shapely.area(area & strip(lane)) < 0.1 * strip(lane).area
    middle = shapely.Polygon(crossing.junctions["B1"].outline).centroid
    assert shapely.covers(area, middle)
    for edge in crossing.edges.values():
        if edge.function == "walkingarea" and edge.id.startswith(":B1_w"):
            walk = shapely.Polygon(edge.lanes[0].points).buffer(0.0)
            assert shapely.area(area & walk) < 0.2 * walk.area


def test_own_area_leaves_out_those_who_turn_beside(crossing):
    uses = choose_lanes(crossing, ["A1B1", "B1B2"], 2)
    area = drivable_area(crossing, uses)
    own, *wider = narrower_areas(crossing, uses, area)
    assert shapely.covers(area.buffer(0.2), own)
    for use in uses:
        for lane in use.entered.edge.drivable_lanes:
            is_own = lane in (use.entered, use.left)
            assert shapely.area(own & strip(lane)) == pytest.approx(
                strip(lane).area if is_own else 0.0, abs=0.1 * strip(lane).area
            )
    assert shapely.covers(own.buffer(0.1), strip(crossing.lane(uses[0].link.via)))
    for narrow, wide in pairwise((own, *wider, area)):
        assert shapely.covers(wide.buffer(1e-6), narrow)
    middle = shapely.Polygon(crossing.junctions["B1"].outline).centroid
    assert shapely.covers(wider[0], middle)


def test_own_area_has_a_lane_only_as_far_as_the_line_is_on_it(crossing):
    uses = choose_lanes(crossing, ["B0B1", "B1A1", "A1A2"], 2)
    entered, left = uses[1].entered, uses[1].left
    assert entered.index != left.index
    own = narrower_areas(crossing, uses, drivable_area(crossing, uses))[0]
    for lane, expected in ((entered, [True, False]), (left, [False, True])):
        line = shapely.LineString(lane.points)
        places = [line.interpolate(share, normalized=True) for share in (0.1, 0.9)]
        assert list(shapely.covers(own, places)) == expected
    path = route_path(crossing.file, ["B0B1", "B1A1", "A1A2"], 2)
    assert shapely.covers(own.buffer(0.1), shapely.points(path.points)).all()


def test_route_s_line_is_inside_its_area(crossing):
    path = route_path(crossing.file, ["A0A1", "A1B1", "B1B0"], 1)
    area = path.areas.between(0.0, path.length).own
    inside = shapely.covers(area, shapely.points(path.points))
    assert inside.all()
    # a body with its rear axle at the begin reaches beyond it
    back = path.points[0] - 5.0 * (path.points[1] - path.points[0])
    assert shapely.covers(area, shapely.Point(back))


def test_distances_to_the_edge_of_a_box():
    box = shapely.box(0.0, 0.0, 10.0, 4.0)
    points = np.array([[5.0, 1.0], [5.0, 1.0], [9.0, 2.0], [20.0, 2.0]])
    ways = np.array([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(distances_to_edge(box, points, ways, 6.0), [3, 1, 6, 0])


def test_boundary_is_cut_about_the_points_with_holes():
    area = shapely.box(0, 0, 100, 4).difference(shapely.box(50, 1, 51, 2))
    near = boundary_about(area, np.array([[48.0, 2.0], [55.0, 2.0]]), 5.0)
    assert len(near) == 8
    length = np.hypot(near[:, 2] - near[:, 0], near[:, 3] - near[:, 1]).sum()
    assert length == pytest.approx(2 * 17.0 + 2 * 4.0 + 4.0)
    nowhere = boundary_about(area, np.array([[-50.0, 0.0]]), 5.0)
    assert nowhere.shape == (0, 4)
