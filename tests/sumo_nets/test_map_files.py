import subprocess

import pytest

import sumo_nets.map_files as module
from sumo_nets.catalogue import networks
from sumo_nets.errors import NetworkError
from sumo_nets.map_files import missing_parts, network_of_map
from sumo_nets.net_reader import read_net
from tests.sumo_nets.generated import netgenerate

STREETS = """<osm version="0.6">
<bounds minlat="49.00" minlon="8.40" maxlat="49.01" maxlon="8.42"/>
<node id="1" lat="49.0000" lon="8.4000"/><node id="2" lat="49.0000" lon="8.4030"/>
<node id="3" lat="49.0000" lon="8.4060"/><node id="4" lat="49.0020" lon="8.4030"/>
<node id="5" lat="48.9980" lon="8.4030"/>
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/>
<tag k="highway" v="secondary"/><tag k="lanes" v="2"/></way>
<way id="11"><nd ref="4"/><nd ref="2"/><nd ref="5"/>
<tag k="highway" v="residential"/></way>
</osm>"""


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def program():
    found = netgenerate().with_name("netconvert")
    return found if found.is_file() else pytest.skip("netconvert is not there")


def opendrive_of(net_file, folder, program):
    file = folder / "crossing.xodr"
    home = str(program.parent.parent)
    subprocess.run(
        [program, "-s", net_file, "--opendrive-output", file],
        env={"SUMO_HOME": home}, capture_output=True, check=True, timeout=60,
    )  # fmt: skip
    return file


@pytest.mark.usefixtures("program")
def test_openstreetmap_becomes_a_network_once(tmp_path, monkeypatch):
    file = tmp_path / "town.osm"
    file.write_text(STREETS)
    made = network_of_map(file)
    net = read_net(made)
    assert len([e for e in net.roads if e.drivable_lanes]) == 8
    assert missing_parts(file, net) == []
    monkeypatch.setattr(module, "_converted", lambda _: pytest.fail("twice"))
    assert network_of_map(file) == made


def test_opendrive_keeps_the_connections_of_its_junctions(tmp_path, program):
    source = networks()["intersection"].net_file
    file = opendrive_of(source, tmp_path, program)
    net = read_net(network_of_map(file))
    assert missing_parts(file, net) == []
    lost = net.edges[next(e.id for e in net.roads if e.lanes[0].links)]
    for lane in lost.lanes:
        lane.links.clear()
    lines = missing_parts(file, net)
    assert any(f'edge "{lost.id}" leads nowhere at junction' in line for line in lines)
    assert any("the way from road" in line for line in lines)


@pytest.mark.usefixtures("program")
def test_damaged_map_is_one_line(tmp_path):
    file = tmp_path / "bad.xodr"
    file.write_text("<OpenDRIVE><road")
    with pytest.raises(NetworkError) as caught:
        network_of_map(file)
    assert str(caught.value).startswith(f"{file}: netconvert cannot read it: ")
    assert "\n" not in str(caught.value)


def test_missing_map_and_missing_netconvert_say_what_to_do(tmp_path, monkeypatch):
    with pytest.raises(NetworkError, match="no such map"):
        network_of_map(tmp_path / "gone.osm")

    def nowhere():
        raise NetworkError("netconvert is missing: pip install eclipse-sumo")

    monkeypatch.setattr(module, "sumo_home", nowhere)
    file = tmp_path / "town.osm"
    file.write_text(STREETS)
    with pytest.raises(NetworkError) as caught:
        network_of_map(file)
    assert "pip install eclipse-sumo, or convert it elsewhere" in str(caught.value)
    assert "netconvert --osm-files town.osm -o town.net.xml" in str(caught.value)
