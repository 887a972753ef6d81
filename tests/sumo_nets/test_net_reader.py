import gzip

import numpy as np
import pytest
import sumolib.net

from sumo_nets.catalogue import networks
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.route_check import check_route
from tests.sumo_nets.generated import generate

TEXT = """<net version="1.20"{more}>
<type id="slow"><restriction vClass="passenger" speed="7.0"/></type>
<edge id="a" from="x" to="y"{type}><lane id="a_0" index="0" speed="13" length="9"
 shape="0,0,5 9,0,6"/></edge>
<edge id="b" from="y" to="z"><lane id="b_0" index="0" speed="13" length="9"
 {allow} shape="9,0 18,0"/></edge>
<junction id="y" type="priority" x="9" y="0" shape="9,-2 9,2"/>
{connection}
</net>"""


def written(folder, name="n.net.xml", **parts):
    blank = {"more": "", "type": "", "allow": "", "connection": ""}
    file = folder / name
    file.write_text(TEXT.format(**(blank | parts)))
    return file


LINK = '<connection from="a" to="b" fromLane="0" toLane="0" dir="s" state="M"/>'


def same_as_sumolib(file):
    net, other = read_net(file), sumolib.net.readNet(str(file), withInternal=True)
    edges = {edge.getID(): edge for edge in other.getEdges(withInternal=True)}
    assert set(net.edges) == set(edges)
    links = 0
    for name, edge in net.edges.items():
        twin = edges[name]
        assert edge.internal == (twin.getFunction() == "internal")
        if edge in net.roads:
            assert edge.start == twin.getFromNode().getID()
            assert edge.end == twin.getToNode().getID()
        for lane, same in zip(edge.lanes, twin.getLanes(), strict=True):
            assert (lane.id, lane.index) == (same.getID(), same.getIndex())
            assert lane.drivable == same.allows("passenger")
            assert (lane.width, lane.speed) == (same.getWidth(), same.getSpeed())
            assert lane.length == same.getLength()
            shape = [point[:2] for point in same.getShape()]
            np.testing.assert_array_equal(lane.points, shape)
            expected = [
                (out.getToLane().getID(), out.getViaLaneID(), out.getTLSID())
                for out in same.getOutgoing()
            ]
            found = [(x.target.id, x.via, x.signal) for x in lane.links]
            assert sorted(found) == sorted(expected)
            links += len(found)
    assert net.roads
    for node in other.getNodes():
        np.testing.assert_array_equal(
            net.junctions[node.getID()].outline,
            np.reshape([point[:2] for point in node.getShape()], (-1, 2)),
        )
    return links


@pytest.mark.parametrize("name", sorted(networks()))
def test_shipped_networks_are_read_as_by_sumolib(name):
    same_as_sumolib(networks()[name].net_file)


def test_generated_network_is_read_as_by_sumolib(tmp_path):
    file = generate(
        tmp_path, "--grid", "--grid.number=3", "-L2", "--default-junction-type",
        "traffic_light", "--crossings.guess", "--sidewalks.guess",
    )  # fmt: skip
    assert same_as_sumolib(file) > 100


def test_heights_are_left_out_and_limits_of_cars_count(tmp_path):
    net = read_net(written(tmp_path, type=' type="slow"', connection=LINK))
    np.testing.assert_array_equal(net.lane("a_0").points, [[0.0, 0.0], [9.0, 0.0]])
    assert net.lane("a_0").speed == 7.0
    assert net.lane("b_0").speed == 13.0
    assert not net.left_hand
    assert read_net(written(tmp_path, more=' lefthand="true"')).left_hand


def test_file_that_has_changed_is_read_anew(tmp_path):
    assert not read_net(written(tmp_path)).lane("a_0").links
    assert read_net(written(tmp_path, connection=LINK)).lane("a_0").links


def test_packed_network_is_the_same(tmp_path):
    plain = written(tmp_path, connection=LINK)
    packed = tmp_path / "p.net.xml.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    assert set(read_net(packed).edges) == {"a", "b"}


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"connection": LINK.replace('"b"', '"c"')}, 'from "a" to "c" has no lane'),
        ({"connection": LINK.replace('toLane="0"', 'toLane="4"')}, "has no lane"),
        ({"allow": 'width="wide"'}, '<lane id="b_0">: width="wide" is not a number'),
    ],
)
def test_damaged_elements_are_named(tmp_path, parts, message):
    file = written(tmp_path, **parts)
    with pytest.raises(NetworkError) as caught:
        read_net(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("root", "advice"), [("OpenDRIVE", "--opendrive-files"), ("osm", "--osm-files")]
)
def test_maps_of_other_kinds_are_refused_with_the_way_to_convert_them(
    tmp_path, root, advice
):
    file = tmp_path / "map.xodr"
    file.write_text(f"<{root}></{root}>")
    with pytest.raises(NetworkError, match=f"<{root}>, not <net>; netconvert {advice}"):
        read_net(file)


def test_route_over_a_closed_edge_or_a_missing_turn_is_refused(tmp_path):
    closed = read_net(written(tmp_path, allow='allow="pedestrian"', connection=LINK))
    with pytest.raises(NetworkError, match='edge "b" has no lane for cars'):
        check_route(closed, ["a", "b"])
    apart = read_net(written(tmp_path, name="apart.net.xml"))
    with pytest.raises(NetworkError, match='from edge "a" to "b"; it is a dead end'):
        check_route(apart, ["a", "b"])


def test_damaged_shape_names_its_lane(tmp_path):
    file = written(tmp_path)
    file.write_text(file.read_text().replace("9,0 18,0", "9,0 nan,0"))
    with pytest.raises(NetworkError, match='lane "b_0": the shape'):
        _ = read_net(file).lane("b_0").points


def test_traffic_lights_without_a_program_are_refused(tmp_path):
    shipped = networks()["intersection"].net_file.read_text(encoding="utf-8")
    begin, end = shipped.index("<tlLogic"), shipped.rindex("</tlLogic>")
    file = tmp_path / "n.net.xml"
    file.write_text(shipped[:begin] + shipped[end + len("</tlLogic>") :])
    with pytest.raises(NetworkError, match="has no program"):
        read_net(file)


def test_lights_of_a_rail_crossing_need_no_program(tmp_path):
    link = LINK.replace("/>", ' tl="y" linkIndex="0"/>')
    file = written(tmp_path, connection=link)
    with pytest.raises(NetworkError, match="has no program"):
        read_net(file)
    crossing = file.read_text().replace('type="priority"', 'type="rail_crossing"')
    (tmp_path / "rail.net.xml").write_text(crossing)
    assert read_net(tmp_path / "rail.net.xml").edges["a"].lanes[0].links


def test_lines_that_cars_may_not_cross_are_known(tmp_path):
    file = written(tmp_path)
    text = file.read_text()
    lanes = {
        "": (True, True),
        ' changeLeft="emergency"': (False, True),
        ' changeRight="bus emergency"': (True, False),
        ' changeLeft="passenger bus" changeRight="all"': (True, True),
    }
    for number, (lines, expected) in enumerate(lanes.items()):
        changed = tmp_path / f"{number}.net.xml"
        changed.write_text(text.replace('id="a_0"', f'id="a_0"{lines}'))
        lane = read_net(changed).edges["a"].lanes[0]
        assert (lane.leads_up, lane.leads_down) == expected
