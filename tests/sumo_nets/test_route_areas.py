"""What a route may use about a stretch is not what it uses elsewhere."""

import pytest
import shapely

from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.route_path import route_path
from tests.sumo_nets.generated import generate


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    return read_net(generate(folder, "--grid", "--grid.number=3", "--grid.length=120"))


def strip(lane):
    line = shapely.LineString(lane.points)
    return line.buffer(0.5 * lane.width, cap_style="flat")


def test_the_road_back_is_oncoming_on_the_way_out(grid):
    route = ["A1B1", "B1C1", "C1C2", "C2B2", "B2B1", "B1A1"]  # round a block
    net = grid
    path = route_path(net.file, route, 0)
    begins = {span.lane: (span.begin, span.end) for span in path.spans}
    there, back = net.lane("A1B1_0"), net.lane("B1A1_0")
    out = path.areas.between(*begins["A1B1_0"])
    home = path.areas.between(*begins["B1A1_0"])
    for area, own, other in ((out, there, back), (home, back, there)):
        assert shapely.area(area.own & strip(own)) > 0.95 * strip(own).area
        assert shapely.area(area.own & strip(other)) < 0.1 * strip(other).area
        assert shapely.area(area.widest & strip(other)) > 0.9 * strip(other).area


def test_a_stretch_over_a_joint_has_both_edges(grid):
    path = route_path(grid.file, ["A0A1", "A1A2"], 0)
    first, last = path.spans[0], path.spans[-1]
    middle = path.areas.between(first.end - 5.0, last.begin + 5.0)
    for span in (first, last):
        lane = strip(grid.lane(span.lane))
        assert shapely.area(middle.own & lane) > 0.95 * lane.area
    assert middle is path.areas.between(first.end - 4.0, last.begin + 4.0)


def test_a_stretch_that_ends_in_a_wide_junction_has_all_of_it(tmp_path):
    options = ("--grid", "--grid.number=4", "--grid.length=160", "-j", "priority")
    net = read_net(generate(tmp_path, *options, "--default.junctions.radius=24"))
    path = route_path(net.file, ["A1B1", "B1C1", "C1C2"], 0)
    whole = path.areas.between(0.0, path.length).own
    inside = [span for span in path.spans if span.lane.startswith(":")]
    for span in inside:
        place = shapely.Point(path.points[(path.s > span.begin).argmax()])
        near = whole & place.buffer(8.0)
        here = path.areas.between(span.begin - 60.0, span.begin + 1.0).own
        assert shapely.area(near - here) < 0.01 * near.area


def test_a_damaged_shape_names_the_file(tmp_path):
    file = generate(tmp_path, "--grid", "--grid.number=3", "-L2")
    text = file.read_text()
    begin = text.index('<lane id="A0A1_1"')
    at = text.index('shape="', begin) + len('shape="')
    file.write_text(text[:at] + "x," + text[at:])
    path = route_path(file, ["A0A1", "A1A2"], 0)
    with pytest.raises(NetworkError, match=r'generated\.net\.xml: lane "A0A1_1"'):
        path.areas.between(0.0, 50.0)
