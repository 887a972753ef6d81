import importlib.util
import random
from itertools import pairwise, product
from math import inf
from pathlib import Path

import numpy as np
import pytest

from sumo_nets.catalogue import network, networks
from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import (
    CHANGE,
    COMFORTABLE_CHANGE,
    OFF_WANTED,
    choose_lanes,
    replaced_start,
)
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network
from sumo_nets.route_path import SPACING, route_path

NAMES = sorted(networks())


def own_path(name):
    record = network(name)
    return route_path(record.net_file, record.route, record.lane)


def games():
    """Find the networks that eclipse-sumo brings for its traffic-light games."""
    spec = importlib.util.find_spec("sumo")
    if spec is None:
        return []
    game = Path(spec.submodule_search_locations[0]) / "tools" / "game"
    names = ("cross/cross", "corridor/corridor", "kuehne/kuehne", "ramp/ramp")
    files = [game / f"{name}.net.xml" for name in names]
    return [path for path in files if path.is_file()]


def sampled_routes(net, count, length, seed=3):
    """Drive at random through a network, never twice over an edge."""
    rng = random.Random(seed)
    edges = [edge for edge in net.roads if edge.drivable_lanes]
    edges.sort(key=lambda edge: edge.id)
    for _ in range(count):
        route = [rng.choice(edges)]
        while len(route) < length:
            links = [x for lane in route[-1].drivable_lanes for x in lane.links]
            onward = {x.target.edge for x in links if x.target.drivable} - set(route)
            if not onward:
                break
            route.append(rng.choice(sorted(onward, key=lambda edge: edge.id)))
        yield [edge.id for edge in route]


def turns(points):
    steps = np.diff(points, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    return np.abs((np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi)


@pytest.mark.parametrize("name", ["lane_change", "lane_change_curved"])
def test_a_one_way_road_has_its_second_lane_to_the_left(name):
    path = own_path(name)
    np.testing.assert_allclose(path.left, 5.25, atol=1e-3)
    np.testing.assert_allclose(path.right, -1.75, atol=1e-3)
    own = [span for span in path.spans if not span.lane.startswith(":")]
    assert all(span.lines == pytest.approx((1.75,)) for span in own)


KNOWN_LINE = [name for name in NAMES if network(name).segments]


@pytest.mark.parametrize("name", KNOWN_LINE)
def test_own_routes_are_ten_metres_wide_and_smooth(name):
    path = own_path(name)
    np.testing.assert_allclose(path.left, 5.0, atol=1e-3)
    np.testing.assert_allclose(path.right, -5.0, atol=1e-3)
    exact = sum(length for _, length, *_ in network(name).segments)
    assert path.length == pytest.approx(exact, abs=0.05)
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert 0.2 <= steps.min() <= steps.max() <= SPACING + 1e-9
    np.testing.assert_allclose(np.diff(path.s), steps, atol=1e-9)
    assert turns(path.points).max() < np.radians(4.0)  # a chord of 1 m at 15 m radius
    for column in (path.points, path.s, path.left, path.right):
        assert not column.flags.writeable


def test_stop_line_and_lanes_of_the_left_turn():
    path = own_path("intersection")
    assert path.lanes == ("west_in_1", ":centre_14_0", "north_out_1")
    (stop,) = path.stop_lines
    assert (stop.signal, stop.s) == ("signal", pytest.approx(130.0))
    row = int(np.searchsorted(path.s, stop.s))
    np.testing.assert_allclose(path.points[row], [-20.0, -5.0])
    for span, after in pairwise(path.spans):
        assert span.end == after.begin
    assert path.spans[0].lines == pytest.approx((-5.0 / 3.0, 5.0 / 3.0), abs=1e-3)


def test_right_turn_keeps_to_the_only_lane_that_turns():
    file = network("intersection").net_file
    path = route_path(file, ["west_in", "south_out"], 1)
    assert path.lanes == ("west_in_0", ":centre_12_0", "south_out_0")
    np.testing.assert_allclose(path.left, 25.0 / 3.0, atol=1e-3)
    np.testing.assert_allclose(path.right, -5.0 / 3.0, atol=1e-3)


LANE = '<lane id="{id}" index="{index}" speed="13" length="100" {more}shape="{shape}"/>'


def small_net(folder):
    """Write edges a, b, c, 100 m each, where cars must change lanes on b.

    a: pavement, two lanes; b: two lanes; c: bus lane, one lane. Nothing but a's right
    lane leads to b's right lane, nothing but b's left lane to c.
    """
    rows = {
        "a": [(-6.3, 'allow="pedestrian" width="3" '), (-3.2, ""), (0.0, "")],
        "b": [(-3.2, ""), (0.0, "")],
        "c": [(-3.2, 'allow="bus" '), (0.0, "")],
    }
    text = ['<net version="1.20">']
    for place, (edge, lanes) in enumerate(rows.items()):
        text.append(f'<edge id="{edge}" from="n{place}" to="n{place + 1}">')
        for index, (y, more) in enumerate(lanes):
            shape = f"{100 * place},{y} {100 * place + 100},{y}"
            name = f"{edge}_{index}"
            text.append(LANE.format(id=name, index=index, more=more, shape=shape))
        text.append("</edge>")
    text += [
        f'<junction id="n{place}" type="priority" x="{100 * place}" y="0" '
        'incLanes="" intLanes="" shape=""/>'
        for place in range(4)
    ]
    for first, second, one, other in (("a", "b", 1, 0), ("b", "c", 1, 1)):
        text.append(
            f'<connection from="{first}" to="{second}" fromLane="{one}" '
            f'toLane="{other}" dir="s" state="M"/>'
        )
    file = folder / "small.net.xml"
    file.write_text("\n".join([*text, "</net>"]))
    return file


def test_needed_lane_change_is_blended_and_the_road_stays(tmp_path):
    path = route_path(small_net(tmp_path), ["a", "b", "c"], 1)
    assert path.lanes == ("a_1", "b_1", "c_1")
    x, y = path.points.T
    assert turns(path.points).max() < np.radians(1.5)
    np.testing.assert_allclose(y[x <= 120.0], -3.2)
    np.testing.assert_allclose(y[x >= 180.0], 0.0, atol=1e-9)
    on_a, on_b, on_c = x < 99.0, (x > 101.0) & (x < 199.0), x > 201.0
    # Neither the pavement of a nor the bus lane of c is road for a car.
    for rows, lower in ((on_a, -4.8), (on_b, -4.8), (on_c, -1.6)):
        np.testing.assert_allclose((y + path.left)[rows], 1.6, atol=1e-9)
        np.testing.assert_allclose((y + path.right)[rows], lower, atol=1e-9)


def test_lane_closed_to_cars_is_no_lane_for_the_ego(tmp_path):
    with pytest.raises(
        NetworkError, match=r'"a" has no lane 0 for cars, only \[1, 2\]'
    ):
        route_path(small_net(tmp_path), ["a", "b", "c"], 0)


def test_a_start_lane_that_is_not_taken_is_said_with_the_reason(tmp_path):
    net = read_net(small_net(tmp_path))
    assert replaced_start(net, ["a", "b"], 1) is None
    assert replaced_start(net, ["a", "b"], 2) == (
        f'{net.file}: the ego begins in lane 1 of edge "a", not in lane 2: '
        'it does not lead on to "b"'
    )


def cheapest(net, route, wanted):
    """Try every combination of lanes; the cost rule is written down once more."""
    edges = [net.edges[edge] for edge in route]
    best = inf
    uses = [list(product(e.drivable_lanes, e.drivable_lanes)) for e in edges]
    for combination in product(*uses):
        if combination[-1][0] is not combination[-1][1]:
            continue
        joined = all(
            any(link.target is after[0] for link in before[1].links)
            for before, after in pairwise(combination)
        )
        if joined:
            best = min(best, price(combination, wanted))
    return best


def price(combination, wanted):
    total = 0.0
    for number, (entered, left) in enumerate(combination):
        total += OFF_WANTED * abs(entered.index - wanted)
        if number < len(combination) - 1:
            total += OFF_WANTED * abs(left.index - wanted)
        lanes = abs(entered.index - left.index)
        if lanes:
            short = max(0.0, 1.0 - entered.length / (COMFORTABLE_CHANGE * lanes))
            total += CHANGE * lanes * (1.0 + short)
    return total


@pytest.mark.skipif(not games(), reason="eclipse-sumo's game networks are not there")
@pytest.mark.parametrize("file", games(), ids=lambda path: path.stem)
def test_lane_choice_is_the_cheapest_of_all(file):
    net = read_net(file)
    for route in sampled_routes(net, 15, 4):
        first = net.edges[route[0]].drivable_lanes
        wanted = first[-1].index
        uses = choose_lanes(net, route, wanted)
        chosen = [(use.entered, use.left) for use in uses]
        assert price(chosen, wanted) == pytest.approx(cheapest(net, route, wanted))


@pytest.mark.skipif(not games(), reason="eclipse-sumo's game networks are not there")
@pytest.mark.parametrize("file", games(), ids=lambda path: path.stem)
def test_routes_through_foreign_networks_have_no_gaps_and_no_kinks(file):
    net = read_net(file)
    signals = 0
    for route in sampled_routes(net, 20, 7):
        lane = net.edges[route[0]].drivable_lanes[0].index
        path = route_path(file, route, lane)
        assert 0.0 < np.diff(path.s).min() <= np.diff(path.s).max() < 2.0
        assert turns(path.points).max() < np.radians(60.0)
        assert np.all(path.left >= 1.0)
        assert np.all(path.right <= -1.0)
        edges = [lane.rsplit("_", 1)[0] for lane in path.lanes if lane[0] != ":"]
        assert edges == route
        ends = [0.0, *(stop.s for stop in path.stop_lines), path.length]
        assert ends == sorted(ends)
        for stop in path.stop_lines:
            # A stop line lies at the end of a lane, whatever cleaning did about it.
            here = [np.interp(stop.s, path.s, axis) for axis in path.points.T]
            span = next(span for span in path.spans if span.end == stop.s)
            end = net.lane(span.lane).points[-1]
            assert np.linalg.norm(here - end) < 0.2
            signals += 1
    assert signals > 0 or file.stem.startswith("ramp")


@pytest.mark.skipif(not games(), reason="eclipse-sumo's game networks are not there")
def test_foreign_network_gets_oncoming_traffic_where_a_way_back_exists():
    file = games()[0]
    net = read_net(file)
    found = 0
    for route in sampled_routes(net, 10, 3):
        lane = net.edges[route[0]].drivable_lanes[0].index
        record = Network.from_file(file, route, lane)
        record.check()
        for stream in record.streams:
            if stream.name == "oncoming":
                first = net.edges[stream.turns[0].route[0]]
                assert first.start == net.edges[route[-1]].end
                found += 1
    assert found > 0


def test_lanes_that_do_not_lead_over_a_junction_beside_the_route_are_told():
    network = networks()["intersection"]
    found = route_path(network.net_file, network.route, network.lane)
    edges = [span for span in found.spans if not span.lane.startswith(":")]
    for span in edges:
        assert len(span.onward) == len(span.lines) + 1
    own = sum(x < 0.0 for x in edges[0].lines)
    assert edges[0].onward[own]
    assert all(edges[-1].onward)
