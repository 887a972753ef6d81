"""Nobody who waits before a junction stands where long vehicles turn."""

import numpy as np
import pytest
import shapely

from experiments.config.scenario_file import load_scenario
from experiments.world_setup.layout import make_layout
from experiments.world_setup.path_stretches import body_polygons
from experiments.world_setup.waiting_places import MOST_SHORT, waiting_place
from planner.reference_path.path import ReferencePath
from planner.vehicle import Vehicle
from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Edge, NetLane
from sumo_nets.right_of_way import passages
from tests.sumo_nets.generated import generate

CAR = Vehicle()
ROAD = shapely.box(-1e4, -1e4, 1e4, 1e4)
HALF = 1.2  # of a lorry, a little less than is counted with [m]


def lorries_on(lanes):
    """Draw a 10 m lorry along its way as SUMO does: its ends are on the lanes."""
    points = np.concatenate([lane.points for lane in lanes])
    kept = np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0.0)
    line = shapely.LineString(points[kept])
    for front in np.arange(10.0, line.length, 0.7):
        back, tip = line.interpolate(front - 10.0), line.interpolate(front)
        yield shapely.LineString([back, tip]).buffer(HALF, cap_style="flat")


@pytest.mark.sumo
def test_no_lorry_sweeps_over_one_that_waits(tmp_path):
    options = ("--spider", "--spider.omit-center=false", "-j", "unregulated", "-L2")
    net = read_net(generate(tmp_path, *options))
    moved = 0
    for edge in net.roads[:12]:
        for link in edge.lanes[-1].links[:3]:
            uses = choose_lanes(
                net, (edge.id, link.target.edge.id), edge.lanes[-1].index
            )
            (passage,) = passages(net, uses)
            if passage is None:
                continue
            path = ReferencePath.from_polyline(edge.lanes[-1].points)
            line = path.length - 0.01
            place = waiting_place((0.0, line), passage.turning, ROAD, path, CAR)
            assert line - MOST_SHORT <= place <= line
            rear = np.array([place - CAR.front_reach])
            (ego,) = body_polygons(path, rear, CAR)
            swept = [x for lanes in passage.turning for x in lorries_on(lanes)]
            if place == line and min(shapely.distance(swept, ego)) <= 0.0:
                continue  # no place within reach is out of the way
            assert min(shapely.distance(swept, ego)) > 0.1
            moved += place < line
    assert moved > 3


@pytest.mark.parametrize("name", ["t_junction", "all_way_stop", "roundabout"])
def test_on_roads_with_room_the_ego_waits_at_its_line(name):
    """Where no turn comes near, the place is the end of the lane itself."""
    layout = make_layout(load_scenario(name))
    net, path = read_net(layout.network.net_file), layout.road.path
    ends = np.array([net.edges[x].lanes[0].points[-1] for x in layout.network.route])
    lines, _ = path.project(ends[:, 0], ends[:, 1])
    for each in layout.road.junctions:
        assert np.abs(lines - each.ahead.stop_s).min() < 0.6


def test_nobody_waits_with_its_rear_in_the_junction_before(tmp_path):
    net = read_net(generate(tmp_path, "--spider", "-j", "unregulated", "-L2"))
    link = net.edges["B1A1"].lanes[-1].links[0]
    uses = choose_lanes(net, ("B1A1", link.target.edge.id), link.source.index)
    (passage,) = passages(net, uses)
    path = ReferencePath.from_polyline(link.source.points)
    line = path.length - 0.01
    assert waiting_place((0.0, line), passage.turning, ROAD, path, CAR) < line
    for room in (0.0, 0.5):
        lane = (line - CAR.length - room, line)
        place = waiting_place(lane, passage.turning, ROAD, path, CAR)
        assert place == line or place - CAR.length >= lane[0]


def test_an_ego_does_not_wait_where_it_has_swung_out():
    """Its lanes end 0.5 m beside it from 4 m before the line on."""
    path = ReferencePath.from_polyline(np.array([[0.0, 0.0], [60.0, 0.0]]))
    lanes = shapely.union(
        shapely.box(-10.0, -2.0, 46.0, 2.0), shapely.box(46.0, -2.0, 70.0, 0.5)
    )
    turning = read_lanes([[52.0, 30.0], [52.0, 5.0], [70.0, 5.0]])
    place = waiting_place((0.0, 50.0), [turning], lanes, path, CAR)
    assert 45.7 <= place <= 46.0
    assert waiting_place((0.0, 50.0), [turning], ROAD, path, CAR) == 50.0


def read_lanes(corners):
    """Make lanes between corners, as far as their shapes go."""
    edge = Edge("e", "normal", "a", "b")
    return [
        NetLane("e_0", edge, 0, 3.2, 10.0, 10.0, drivable=True, shape_text=text(a, b))
        for a, b in zip(corners, [*corners[1:], [80.0, 5.0]], strict=True)
    ]


def text(*corners):
    """Write corners as a network does."""
    return " ".join(f"{x},{y}" for x, y in corners)
