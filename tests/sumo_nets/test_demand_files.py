from dataclasses import replace

import pytest

from sumo_nets.catalogue import networks
from sumo_nets.demand_files import check_demand, named_vehicle, times_missed
from sumo_nets.demand_records import DemandFiles
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net

NET = networks()["intersection"].net_file


def demand_of(folder, content):
    file = folder / "d.rou.xml"
    file.write_text(f"<routes>\n{content}\n</routes>\n")
    return DemandFiles((file,))


def message(folder, content):
    with pytest.raises(NetworkError) as caught:
        check_demand(demand_of(folder, content), read_net(NET))
    return str(caught.value).replace(f"{folder}/", "")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (
            '<vehicle id="v" depart="1"><route edges="west_in gone"/></vehicle>',
            'd.rou.xml: vehicle "v": edge "gone" is not in',
        ),
        (
            '<trip id="t" depart="1" from="nowhere" to="north_out"/>',
            'd.rou.xml: trip "t": edge "nowhere" is not in',
        ),
        (
            '<person id="p" depart="1"><walk edges="lost"/></person>',
            'd.rou.xml: person "p": edge "lost" is not in',
        ),
        (
            '<vehicle id="ego" depart="1"><route edges="west_in"/></vehicle>',
            'd.rou.xml: vehicle "ego": the id is taken; rename it',
        ),
        ("<vehicle", "d.rou.xml: truncated or damaged demand"),
    ],
)
def test_demand_that_does_not_fit_names_file_id_and_edge(tmp_path, content, expected):
    assert expected in message(tmp_path, content)


@pytest.mark.parametrize("encoding", ["foo", "big5"])
def test_unknown_encodings_are_damage(tmp_path, encoding):
    text = f"<?xml version='1.0' encoding='{encoding}'?><routes/>"
    file = tmp_path / "d.rou.xml"
    file.write_text(text)
    with pytest.raises(NetworkError, match="damaged demand"):
        check_demand(DemandFiles((file,)), read_net(NET))
    with pytest.raises(NetworkError, match="damaged network file"):
        read_net(file)


def test_network_given_as_demand_is_refused():
    with pytest.raises(NetworkError, match="the root element is <net>; allowed"):
        check_demand(DemandFiles((NET,)), read_net(NET))


def test_vehicles_have_their_routes_and_trips_the_fastest_one(tmp_path):
    net = read_net(NET)
    demand = demand_of(
        tmp_path,
        '<route id="r" edges="west_in north_out"/>'
        '<vehicle id="a" depart="3" route="r"/>'
        '<vehicle id="b" depart="4.5"><route edges="west_in east_out"/></vehicle>'
        '<trip id="c" depart="5" from="west_in" to="south_out"/>'
        '<flow id="f" begin="0" number="3" from="west_in" to="south_out"/>',
    )
    assert named_vehicle(demand, net, "a").route == ("west_in", "north_out")
    assert named_vehicle(demand, net, "b").route == ("west_in", "east_out")
    assert named_vehicle(demand, net, "c").route == ("west_in", "south_out")
    assert named_vehicle(demand, net, "b").depart == 4.5
    with pytest.raises(NetworkError, match=r'no vehicle "f.1"; .*3 vehicles and trips'):
        named_vehicle(demand, net, "f.1")


TRIP = '<trip id="t" depart="{}" from="west_in" to="north_out"/>'
FLOW = '<flow id="f" {} period="9" from="west_in" to="north_out"/>'


@pytest.mark.parametrize(
    ("content", "begin", "missed"),
    [
        (TRIP.format("3600"), 0.0, "from 3600 s to 3600 s, the simulation is from 0 s"),
        (TRIP.format("1:00:00"), 0.0, "from 3600 s to 3600 s"),
        (TRIP.format("3600"), 3590.0, ""),
        (
            FLOW.format('begin="0" end="4200"'),
            100_000.0,
            "they depart from 0 s to 4200",
        ),
        (FLOW.format('begin="0"'), 100_000.0, ""),  # for ever
        (FLOW.format('end="4200"'), 4100.0, ""),
        (TRIP.format("triggered"), 100_000.0, ""),  # whenever that is
        ("", 0.0, "nobody departs"),
    ],
)
def test_a_demand_of_another_time_is_told(content, begin, missed, tmp_path):
    demand = replace(demand_of(tmp_path, content), begin=begin)
    found = times_missed(demand, begin + 60.0)
    assert bool(found) == bool(missed)
    assert missed in found
