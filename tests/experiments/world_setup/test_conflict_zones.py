"""Conflict zones against bodies that are moved along both paths."""

import numpy as np
import pytest
import shapely

from experiments.config.scenario_file import load_scenario
from experiments.world_setup.conflict_zones import HALF_WIDTH
from experiments.world_setup.layout import make_layout
from experiments.world_setup.path_stretches import body_polygons
from experiments.world_setup.road import sumo_road
from planner.right_of_way.records import Rule
from planner.vehicle import Vehicle, VehicleLimits
from sumo_nets.build import net_path
from sumo_nets.catalogue import Network, network
from sumo_nets.net_reader import read_net
from sumo_nets.route_path import route_path
from tests.experiments.world_setup.test_waiting_places import lorries_on
from tests.sumo_nets.generated import generate

CAR = Vehicle()
JUNCTIONS = {
    "t_junction": Rule.MINOR,
    "stop_sign": Rule.STOP,
    "all_way_stop": Rule.ALL_WAY_STOP,
    "right_before_left": Rule.RIGHT_BEFORE_LEFT,
}


@pytest.mark.parametrize(("name", "rule"), JUNCTIONS.items())
def test_bodies_only_touch_within_the_zone(name, rule):
    """Whatever the foe's place, a touching ego is in the zone, and the zone is used."""
    net = network(name)
    road = sumo_road(net, CAR)
    (junction,) = road.junctions
    assert junction.ahead.rule is rule
    lanes = read_net(net.net_file)
    s = np.arange(junction.ahead.stop_s - 15.0, junction.ahead.exit_s + 8.0, 0.25)
    bodies = body_polygons(road.path, s, CAR)
    fronts, rears = s + CAR.front_reach, s - CAR.rear_overhang
    for zone in junction.zones:
        points = np.vstack([lanes.lane(lane).points for lane, _ in zone.inside])
        swept = shapely.LineString(points).buffer(HALF_WIDTH - 0.4, cap_style="flat")
        touching = shapely.intersects(bodies, swept)
        within = (fronts >= zone.begin_s) & (rears <= zone.end_s)
        assert not (touching & ~within).any()
        if touching.any() and not zone.merges:
            assert zone.begin_s > fronts[touching].min() - 3.5
            assert zone.end_s < rears[touching].max() + 6.0
        assert zone.entry < zone.exit
        assert junction.ahead.stop_s <= zone.begin_s < zone.end_s


def test_roads_without_others_have_no_junctions():
    for name in ("straight", "curved", "lane_change_curved"):
        assert sumo_road(network(name), CAR).junctions == ()


LORRY = Vehicle(12.0, 2.5, 6.0, 3.0, VehicleLimits(max_curvature=0.14))


def test_who_swings_out_in_a_junction_waits_before_it(tmp_path):
    file = generate(tmp_path, "--grid", "--grid.number=3", "--grid.length=100")
    route = ("A1B1", "B1B0", "B0C0")  # to the right, and to the left
    road = sumo_road(Network("", file, route, 0, (), ""), LORRY)
    spans = route_path(file, route, 0).junctions
    swung = [x for x in road.junctions if x.swings]
    assert swung
    for junction in swung:
        stop = junction.ahead.stop_s
        assert stop < junction.swings[0].begin_s
        # the path and the route are nearly as long as each other
        until = LORRY.length - 2.0  # it would still be in the junction
        assert not any(x.begin + 2.0 < stop < x.end + until for x in spans)


def test_signals_are_known_of_both():
    (junction,) = sumo_road(network("unprotected_left"), CAR).junctions
    assert junction.signal == "signal"
    assert junction.ahead.wait_s is not None
    assert {zone.signal for zone in junction.zones} == {"signal"}


def test_long_vehicles_that_cut_the_corner_have_a_zone_of_their_own():
    """On a right turn in `town` SUMO's table knows none; elsewhere no lorry is met."""
    layout = make_layout(load_scenario("town"))
    path = layout.road.path
    zones = [x for j in layout.road.junctions for x in j.zones if x.shortest > 0.0]
    assert {(x.source_edge, x.target_edge) for x in zones} == {
        ("33_32", "32_42"),
        ("12_02", "02_01"),
    }
    net = read_net(net_path("town"))
    for zone in zones:
        inside = [net.lane(name) for name, _ in zone.inside]
        lanes = [net.lane(zone.source), *inside, net.edges[zone.target_edge].lanes[0]]
        lorries = list(lorries_on(lanes))
        rear = np.arange(zone.begin_s - 14.0, zone.end_s + 8.0, 0.25)
        bodies = body_polygons(path, rear, CAR)
        touched = np.array([min(shapely.distance(lorries, x)) <= 0.0 for x in bodies])
        front, back = rear + CAR.front_reach, rear - CAR.rear_overhang
        within = (front >= zone.begin_s - 0.5) & (back <= zone.end_s + 0.5)
        assert touched.any()
        assert within[touched].all()
