from itertools import product
from pathlib import Path
from tempfile import mkdtemp

import pytest

from sumo_nets.catalogue import networks
from sumo_nets.demand_content import read_content
from sumo_nets.demand_departures import check_departures
from sumo_nets.demand_records import DemandFiles
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.routes import fastest_route

CAR = '<vType id="car" maxSpeed="30"/>'


def problem(folder, content, net="intersection"):
    """What is wrong with a demand, "" if nothing is."""
    own = Path(mkdtemp(dir=folder))  # a file that changes within a tick is not reread
    file = own / "d.rou.xml"
    file.write_text(f"<routes>{CAR}{content}</routes>")
    read = read_content(DemandFiles((file,)))
    try:
        check_departures(read, read_net(networks()[net].net_file))
    except NetworkError as error:
        return str(error).replace(f"{own}/", "")
    return ""


def vehicle(edges, **attributes):
    told = "".join(f' {key}="{value}"' for key, value in attributes.items())
    route = f'<route edges="{edges}"/>'
    return f'<vehicle id="v" type="car" depart="900"{told}>{route}</vehicle>'


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (
            vehicle("west_in east_in"),
            'd.rou.xml: vehicle "v": no car can go from edge "west_in" to "east_in"; '
            "allowed: it leads to east_out, north_out, south_out",
        ),
        (
            vehicle("west_in east_in").replace('"car"', '"drawn"'),
            'there is no connection from edge "west_in" to "east_in"',
        ),
        (
            '<route id="r" edges="west_in east_in"/>'
            '<flow id="f" type="car" begin="0" number="3" route="r"/>',
            'd.rou.xml: flow "f": no car can go from edge "west_in" to "east_in"',
        ),
        (
            '<flow id="f" begin="0" number="3"><route edges="west_in east_in"/></flow>',
            'd.rou.xml: flow "f": no car can go',
        ),
        (
            '<trip id="t" type="car" depart="0" from="north_out" to="west_in"/>',
            'd.rou.xml: trip "t": no car can get from edge "north_out" to "west_in"',
        ),
        (
            vehicle("west_in north_out", departLane=9),
            'd.rou.xml: vehicle "v": departLane="9": edge "west_in" has no such lane '
            "for cars; allowed: 0, 1",
        ),
        (
            vehicle("west_in north_out", departSpeed=31),
            'd.rou.xml: vehicle "v": departSpeed="31" is above the maxSpeed of its '
            'type "car"; allowed: at most 30',
        ),
    ],
)
def test_departures_that_sumo_would_refuse_on_the_way_are_one_line(
    tmp_path, content, expected
):
    assert expected in problem(tmp_path, content)


@pytest.mark.parametrize(
    "content",
    [
        vehicle("west_in north_out", departLane="best", departSpeed="max"),
        vehicle("west_in north_out", departLane=1, departSpeed=30),
        '<route id="unused" edges="west_in east_in"/>',
        '<flow id="f" begin="0" number="0"><route edges="west_in east_in"/></flow>',
        '<trip id="t" type="car" depart="0" fromTaz="a" toTaz="b"/>',
        '<vType id="tram" vClass="tram"/>'
        '<trip id="t" type="tram" depart="0" from="north_out" to="west_in"/>',
        vehicle("west_in").replace('"car"', '"drawn"'),
    ],
)
def test_what_sumo_accepts_is_accepted(tmp_path, content):
    assert problem(tmp_path, content) == ""


@pytest.mark.parametrize(("lane", "refused"), [(0, True), (1, False), (2, True)])
def test_cars_do_not_depart_on_a_pavement(tmp_path, lane, refused):
    content = vehicle("west_in street_in", departLane=lane)
    assert bool(problem(tmp_path, content, "crossing")) is refused


def test_flows_of_calibrators_need_no_id(tmp_path):
    flow = '<flow begin="0" end="9" vehsPerHour="9" type="car"/>'
    assert problem(tmp_path, f'<calibrator id="c">{flow}</calibrator>') == ""
    with pytest.raises(NetworkError, match="line 1: <flow> has no id"):
        problem(tmp_path, flow)


def test_trips_are_refused_exactly_where_no_route_is_found(tmp_path):
    """Groups of edges against a search from every edge to every other."""
    for name in ("intersection", "roundabout", "lane_drop"):
        net = read_net(networks()[name].net_file)
        roads = sorted(edge.id for edge in net.roads if edge.drivable_lanes)
        refused = set()
        for begin, end in product(roads, roads):
            trip = f'<trip id="t" type="car" depart="0" from="{begin}" to="{end}"/>'
            try:
                fastest_route(net, (begin, end))
                exists = True
            except NetworkError:
                exists = False
            assert (problem(tmp_path, trip, name) == "") is exists, (begin, end)
            refused.add(exists)
        assert refused == {True, False}


@pytest.mark.parametrize(
    ("depart", "refused"), [("899", False), ("0:14:59", False), ("900", True)]
)
def test_who_departs_before_the_begin_is_not_looked_at(tmp_path, depart, refused):
    file = tmp_path / "d.rou.xml"
    broken = vehicle("west_in east_in").replace('"900"', f'"{depart}"')
    file.write_text(f"<routes>{CAR}{broken}</routes>")
    read = read_content(DemandFiles((file,), begin=900.0))
    assert bool(read.departures) is refused


def test_routes_of_additional_files_are_known(tmp_path):
    route, cars = tmp_path / "routes.add.xml", tmp_path / "cars.rou.xml"
    route.write_text('<additional><route id="r" edges="west_in"/></additional>')
    cars.write_text('<routes><vehicle id="v" depart="0:01:10" route="r"/></routes>')
    read = read_content(DemandFiles((cars,), (route,)))
    assert read.vehicles["v"].route == ("west_in",)
    assert read.vehicles["v"].depart == 70.0
