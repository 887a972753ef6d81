import gzip
import itertools
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import sumolib.net
from scipy.integrate import cumulative_simpson
from scipy.spatial import cKDTree

from sumo_nets.catalogue import LEAD_IN, network, networks
from sumo_nets.errors import NetworkError
from sumo_nets.network import Network, Stream, Turn

NAMES = sorted(networks())
# Roads with carriageways of 10 m, whose line is known exactly.
KNOWN_LINE = [name for name in NAMES if networks()[name].segments]
JUNCTIONS = [
    "all_way_stop",
    "crossing",
    "left_hand",
    "on_ramp",
    "right_before_left",
    "roundabout",
    "stop_sign",
    "t_junction",
    "town",
    "unprotected_left",
]
TWO_WAY = ["curved", "intersection", "straight", "u_shaped"]
ONE_WAY = [name for name in NAMES if name not in TWO_WAY]
START = {"intersection": (-150.0, -5.0)}


def exact_line(segments, start):
    """Integrate the curvature numerically, 5 mm apart; nothing from centre_line.py."""
    s, curvature, done = [], [], 0.0
    for _, length, begin, end in segments:
        at = np.linspace(0.0, length, round(length / 0.005) + 1)
        s.append(done + at)
        curvature.append(begin + (end - begin) * at / length)
        done += length
    pieces, heading, place = [], 0.0, np.array(start)
    for at, bend in zip(s, curvature, strict=True):
        bearing = heading + cumulative_simpson(bend, x=at, initial=0.0)
        x = place[0] + cumulative_simpson(np.cos(bearing), x=at, initial=0.0)
        y = place[1] + cumulative_simpson(np.sin(bearing), x=at, initial=0.0)
        pieces.append(np.column_stack((x, y)))
        heading, place = bearing[-1], pieces[-1][-1]
    return np.concatenate(pieces)


def middle_lane(record):
    net = sumolib.net.readNet(str(record.net_file), withInternal=True)
    shapes = [net.getLane(f"{record.route[0]}_1").getShape()]
    for edge, following in itertools.pairwise(record.route):
        links = net.getEdge(edge).getOutgoing()[net.getEdge(following)]
        via = next(link for link in links if link.getFromLane().getIndex() == 1)
        shapes.append(net.getLane(via.getViaLaneID()).getShape())
        shapes.append(net.getLane(f"{following}_1").getShape())
    return np.concatenate(shapes)


def fill(points, spacing=0.01):
    """Put points on the straight pieces between `points`."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    at = np.arange(0.0, along[-1], spacing)
    return np.column_stack([np.interp(at, along, axis) for axis in points.T])


@pytest.mark.parametrize("name", KNOWN_LINE)
def test_middle_lane_follows_the_segments(name):
    record = network(name)
    exact = exact_line(record.segments, START.get(name, (-100.0, 0.0)))
    lane = fill(middle_lane(record))
    assert cKDTree(exact).query(lane)[0].max() < 0.02
    assert cKDTree(lane).query(exact)[0].max() < 0.02


def test_scenario_roads_begin_after_the_lead_in():
    for record in map(network, KNOWN_LINE):
        kind, length, *_ = record.segments[0]
        assert (kind, length) == ("line", LEAD_IN) == ("line", 100.0)


def test_left_turn_over_the_intersection_is_an_arc_of_15_m():
    points = middle_lane(network("intersection"))
    inside = points[(points[:, 0] > -9.99) & (points[:, 1] < 9.99)]
    assert len(inside) > 20
    distance = np.hypot(inside[:, 0] + 10.0, inside[:, 1] - 10.0)
    np.testing.assert_allclose(distance, 15.0, atol=2e-4)


@pytest.mark.parametrize("name", [name for name in ONE_WAY if "lane_change" in name])
def test_roads_for_lane_changes_are_one_way(name):
    record = network(name)
    net = sumolib.net.readNet(str(record.net_file))
    lanes = 3 if "three" in name else 2
    for edge in net.getEdges():
        ended = name == "lane_change_end" and edge.getID() == "own2"
        assert [lane.getWidth() for lane in edge.getLanes()] == [3.5] * (lanes - ended)
        assert edge.getSpeed() == 16.67
    length = sum(net.getEdge(edge).getLength() for edge in record.route)
    assert length > 1700.0
    assert [stream.name for stream in record.streams] == ["own"]


@pytest.mark.parametrize("name", KNOWN_LINE)
def test_lanes_and_speeds_are_what_the_catalogue_says(name):
    record = network(name)
    net = sumolib.net.readNet(str(record.net_file))
    for edge in net.getEdges():
        assert [lane.getWidth() for lane in edge.getLanes()] == [3.3333] * 3
        assert edge.getSpeed() == 13.89
    approaches = [edge for edge in net.getEdges() if edge.getID().endswith("_in")]
    # 20 m of the approach lie behind the stop line.
    assert all(edge.getLength() >= 130.0 for edge in approaches)


@pytest.mark.parametrize("name", NAMES)
def test_every_stream_can_be_driven(name):
    record = network(name)
    record.check()
    streams = {stream.name for stream in record.streams}
    if name in TWO_WAY:
        assert streams >= {"own", "oncoming"}
    elif name in JUNCTIONS:
        assert streams - {"oncoming"} > {"own"}
    elif name == "merge_ramp":
        assert streams == {"own", "cross_ramp"}
    else:
        assert streams == {"own"}
    own = next(stream for stream in record.streams if stream.name == "own")
    assert record.route in {turn.route for turn in own.turns}


def test_roads_for_dense_obstacles_hold_the_field_and_bend_gently():
    for name in ("dense", "dense_curved"):
        record = network(name)
        assert sum(length for _, length, *_ in record.segments) == 600.0
    bends = {k for segment in record.segments for k in segment[2:]}
    assert (min(bends), max(bends)) == (-1.0 / 40.0, 1.0 / 40.0)
    # One edge a segment, the lead-in with the first.
    assert len(record.route) == len(record.segments) - 1


def green_phases():
    net = sumolib.net.readNet(
        str(network("intersection").net_file), withInternal=True, withPrograms=True
    )
    (signal,) = net.getTrafficLights()
    (program,) = signal.getPrograms().values()
    return net, signal, program.getPhases()


def test_signal_gives_each_movement_one_protected_green():
    _, signal, phases = green_phases()
    states = [phase.state for phase in phases]
    assert set("".join(states)) == set("Gyr")
    links = {link for _, _, link in signal.getConnections()}
    assert links == set(range(len(states[0])))
    for link in links:
        letters = "".join(state[link] for state in states)
        assert letters.count("G") == letters.count("y") == 1
    assert 60.0 <= sum(phase.duration for phase in phases) <= 80.0
    for now, after in zip(phases, phases[1:] + phases[:1], strict=True):
        if "G" in now.state:
            assert after.state == now.state.replace("G", "y")
            assert 3.0 <= after.duration <= 4.0
        elif "y" in now.state:
            assert set(after.state) == {"r"}
            assert after.duration == 2.0


def test_movements_with_green_together_keep_a_lane_apart():
    net, signal, phases = green_phases()
    links = {}
    for incoming, outgoing, link in signal.getConnections():
        joins = incoming.getEdge().getOutgoing()[outgoing.getEdge()]
        via = next(join for join in joins if join.getTLLinkIndex() == link)
        points = fill(np.array(net.getLane(via.getViaLaneID()).getShape()), 0.1)
        links[link] = (incoming.getID(), points)
    pairs = 0
    for phase in phases:
        moving = [
            links[link] for link, letter in enumerate(phase.state) if letter in "Gy"
        ]
        for (first, one), (second, other) in combinations(moving, 2):
            if first != second:
                assert cKDTree(one).query(other)[0].min() > 3.3
                pairs += 1
    assert pairs == 2 * 4 * 5  # of the six pairs of an arm, one shares its lane


def test_unknown_network_lists_the_known_ones():
    with pytest.raises(NetworkError, match='"mars"; there are all_way_stop, '):
        network("mars")


def test_own_network_from_a_file():
    record = Network.from_file(network("straight").net_file, ["own"], 2)
    assert (record.name, record.lane) == ("straight", 2)
    assert [stream.name for stream in record.streams] == ["own"]
    turning = Network.from_file(
        str(network("intersection").net_file), ["west_in", "north_out"], 1
    )
    assert turning.route == network("intersection").route
    turning.check()


@pytest.mark.parametrize(
    ("route", "lane", "message"),
    [
        ([], 0, "the route is empty"),
        (["west_inn", "north_out"], 1, 'no edge "west_inn"; did you mean "west_in"'),
        (["west_in", "xyz"], 1, 'no edge "xyz"; there are east_in, .* north_out'),
        ([":centre_14"], 0, 'no edge ":centre_14"'),
        (["west_in", "east_in"], 1, 'from edge "west_in" to "east_in"'),
        (["west_in", "west_out"], 1, 'from edge "west_in" to "west_out"'),
        (["west_in", "north_out"], 3, r"no lane 3 for cars, only \[0, 1, 2\]"),
        (["west_in", "north_out"], -1, "no lane -1"),
    ],
)
def test_route_that_cannot_be_driven_is_refused(route, lane, message):
    with pytest.raises(NetworkError, match=message) as caught:
        Network.from_file(network("intersection").net_file, route, lane)
    assert "intersection.net.xml" in str(caught.value)


def test_check_covers_the_streams():
    record = network("intersection")
    wrong = Stream("cross_n", (Turn(("north_in", "north_out"), 1.0),))
    with pytest.raises(NetworkError, match='"north_in" to "north_out"'):
        replace(record, streams=(wrong,)).check()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_truncated_network_is_refused_in_one_line(tmp_path, share):
    data = network("intersection").net_file.read_bytes()
    broken = tmp_path / "broken.net.xml"
    broken.write_bytes(data[: int(share * len(data))])
    with pytest.raises(NetworkError, match="truncated or damaged") as caught:
        Network.from_file(broken, ["west_in", "north_out"], 1)
    assert str(broken) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(NetworkError, match="no such network file"):
        Network.from_file(tmp_path / "absent.net.xml", ["own"], 1)
    routes = tmp_path / "a.rou.xml"
    routes.write_text("<routes></routes>")
    with pytest.raises(NetworkError, match="<routes>, not <net>"):
        Network.from_file(routes, ["own"], 1)
    bare = tmp_path / "bare.net.xml"
    bare.write_text("<net><edge/></net>")
    with pytest.raises(NetworkError, match=r"bare\.net\.xml: <edge> has no 'id'"):
        Network.from_file(bare, ["own"], 1)


def test_compressed_network_is_read_and_a_truncated_one_refused(tmp_path):
    packed = tmp_path / "road.net.xml.gz"
    data = gzip.compress(network("straight").net_file.read_bytes())
    packed.write_bytes(data)
    assert Network.from_file(packed, ["own"], 1).name == "road"
    packed.write_bytes(data[: len(data) // 2])
    with pytest.raises(NetworkError, match="truncated or damaged"):
        Network.from_file(packed, ["own"], 1)
    packed.write_bytes(b"no gzip at all")
    with pytest.raises(NetworkError, match="cannot be read"):
        Network.from_file(packed, ["own"], 1)


def test_records_are_plain_and_hashable():
    for record in networks().values():
        assert isinstance(record.net_file, Path)
        assert hash(record) == hash(replace(record))
