"""Who gives way to whom, against SUMO's own tables."""

import pytest

from sumo_nets.build import net_path
from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.right_of_way import passages
from tests.sumo_nets.generated import generate

KINDS = [
    "priority",
    "right_before_left",
    "allway_stop",
    "priority_stop",
    "traffic_light",
]


def route_passage(net, link):
    """Return the passage of a route over one link."""
    route = (link.source.edge.id, link.target.edge.id)
    for use, passage in zip(
        choose_lanes(net, route, link.source.index),
        passages_of(net, route, link),
        strict=False,
    ):
        if use.link is link:
            return passage
    return None


def passages_of(net, route, link):
    return passages(net, choose_lanes(net, route, link.source.index))


PAVEMENTS = (
    "--sidewalks.guess",
    "--sidewalks.guess.from-permissions=false",
    "--crossings.guess",
    "--default.speed=11",
)


@pytest.mark.sumo
@pytest.mark.parametrize("extra", [(), PAVEMENTS], ids=["roads", "pavements"])
@pytest.mark.parametrize("kind", KINDS)
def test_movements_and_right_of_way_are_those_of_sumo(tmp_path, kind, extra):
    """`lane.getFoes` lists the lanes that have to be given way to."""
    import libsumo

    options = ("--rand", "--rand.iterations=25", f"--seed={KINDS.index(kind)}", "-L2")
    file = generate(tmp_path, *options, "--turn-lanes=1", "-j", kind, *extra)
    net = read_net(file)
    libsumo.start(["sumo", "-n", str(file), "--no-step-log", "--no-warnings"])
    compared = 0
    try:
        for edge in net.roads:
            for link in (link for lane in edge.drivable_lanes for link in lane.links):
                passage = route_passage(net, link)
                if passage is None:
                    continue
                first = {foe.link.source.id for foe in passage.foes if foe.goes_first}
                named = libsumo.lane.getFoes(link.source.id, link.target.id)
                roads = {lane for lane in named if not lane.startswith(":")}
                assert first == {lane for lane in roads if net.lane(lane).drivable}
                inside = set(libsumo.lane.getInternalFoes(link.via))
                for foe in passage.foes:
                    assert inside & {lane.id for lane in foe.inside}
                compared += 1
    finally:
        libsumo.close()
    assert compared > 100


@pytest.mark.parametrize("kind", KINDS)
def test_an_index_is_that_in_the_name_of_the_lane_inside(tmp_path, kind):
    """Netconvert names a lane inside by the index of its edge's first movement."""
    file = generate(tmp_path, "--spider", "--spider.omit-center", "-L2", "-j", kind)
    net = read_net(file)
    for junction in (x for x in net.junctions.values() if x.requests):
        movements = net.movements(junction)
        assert len(movements) == len(junction.requests)
        for index, link in enumerate(movements):
            edge, _, lane = link.via.rpartition("_")
            assert int(edge.rpartition("_")[2]) + int(lane) == index


def only_passage(name, route):
    net = read_net(net_path(name))
    (passage,) = (x for x in passages(net, choose_lanes(net, route, 0)) if x)
    return passage


def sources(passage, **flags):
    return {
        foe.link.source.id
        for foe in passage.foes
        if all(getattr(foe, key) == value for key, value in flags.items())
    }


def test_left_turn_onto_a_main_road_gives_way_to_both_sides():
    passage = only_passage("t_junction", ("south_in", "west_out"))
    assert passage.link.state == "m"
    assert sources(passage, goes_first=True) == {"west_in_0", "east_in_0"}


def test_who_meets_nobody_still_has_others_turning_beside():
    net = read_net(net_path("town"))
    (passage,) = passages(net, choose_lanes(net, ("33_43", "43_42"), 0))
    assert passage.foes == ()
    assert passage.beside
    assert all(x.link.source.edge.id != "33_43" for x in passage.beside)


def test_the_right_goes_first():
    passage = only_passage("right_before_left", ("south_in", "north_out"))
    assert sources(passage, goes_first=True) == {"east_in_0"}
    assert "west_in_0" in sources(passage, gives_way=True)


def test_left_turn_at_signals_waits_inside_for_oncoming_traffic():
    passage = only_passage("unprotected_left", ("west_in", "north_out"))
    assert passage.may_wait_inside
    assert "east_in_0" in sources(passage, goes_first=True)


def test_where_nobody_looks_the_route_gives_way_to_everybody(tmp_path):
    """SUMO's table names no foe there, and its vehicles drive through each other."""
    file = generate(tmp_path, "--spider", "--spider.omit-center", "-j", "unregulated")
    net = read_net(file)
    found = 0
    for edge in net.roads:
        for link in edge.lanes[0].links:
            passage = route_passage(net, link)
            if passage is None:
                continue
            assert not passage.regulated
            assert all(foe.goes_first and not foe.gives_way for foe in passage.foes)
            assert edge.id not in {foe.link.source.edge.id for foe in passage.foes}
            found += 1
    assert found > 10
