import hashlib
import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from math import nan
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sumo_nets.catalogue import network
from sumo_nets.demand import Demand, vehicles_for, write_demand
from sumo_nets.errors import NetworkError
from sumo_nets.network import Stream
from sumo_nets.vehicle_types import KINDS, MODELS, TEMPERS, EgoType, LeaderType

BUSY = Demand(own_veh_per_h=700.0, oncoming_veh_per_h=500.0, cross_veh_per_h=300.0)
EGO = EgoType(4.8, 1.9, 4.0, 8.0, 20.0)

WRITE = """
import sys
from sumo_nets.catalogue import network
from sumo_nets.demand import Demand, write_demand
write_demand(network("intersection"), Demand(700.0, 500.0, 300.0), 7, 0.0, 600.0,
             sys.argv[1])
"""


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_same_seed_writes_the_same_bytes_in_any_process(tmp_path):
    write_demand(network("intersection"), BUSY, 7, 0.0, 600.0, tmp_path / "a.rou.xml")
    root = Path(__file__).parents[2]
    for hash_seed in ("1", "2"):
        other = tmp_path / f"{hash_seed}.rou.xml"
        subprocess.run(
            [sys.executable, "-c", WRITE, str(other)],
            env={**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(root)},
            check=True,
        )
        assert digest(other) == digest(tmp_path / "a.rou.xml")
    write_demand(network("intersection"), BUSY, 8, 0.0, 600.0, tmp_path / "b.rou.xml")
    assert digest(tmp_path / "b.rou.xml") != digest(tmp_path / "a.rou.xml")


@given(st.integers(0, 2**32), st.floats(0.0, 1e4), st.floats(0.0, 300.0))
@settings(max_examples=30, deadline=None)
def test_vehicles_depart_in_order_within_the_interval(seed, begin, duration):
    end = begin + duration
    vehicles = vehicles_for(network("intersection"), BUSY, seed, begin, end)
    departs = [vehicle.depart for vehicle in vehicles]
    assert departs == sorted(departs)
    assert all(begin <= depart < end for depart in departs)
    assert len({vehicle.id for vehicle in vehicles}) == len(vehicles)


def test_arrivals_are_a_poisson_process_of_the_wished_rate():
    hours = 20.0
    vehicles = vehicles_for(network("straight"), BUSY, 1, 0.0, 3600.0 * hours)
    for stream, rate in (("own", 700.0), ("oncoming", 500.0)):
        departs = [v.depart for v in vehicles if v.id.startswith(stream)]
        expected = rate * hours
        assert abs(len(departs) - expected) < 4.0 * np.sqrt(expected)
        gaps = np.diff(departs)
        assert stats.kstest(gaps, "expon", args=(0.0, 3600.0 / rate)).pvalue > 0.001
        # Neighbouring gaps have nothing to do with each other.
        assert abs(np.corrcoef(gaps[:-1], gaps[1:])[0, 1]) < 4.0 / np.sqrt(len(gaps))


def test_mix_has_the_wished_shares():
    demand = replace(
        BUSY,
        van_share=0.2,
        truck_share=0.1,
        cautious_share=0.3,
        aggressive_share=0.0,
        models=(("IDM", 3.0), ("Krauss", 1.0), ("ACC", 0.0)),
    )
    vehicles = vehicles_for(network("intersection"), demand, 2, 0.0, 8.0 * 3600.0)
    count = len(vehicles)
    wished = {
        "kind": {"car": 0.7, "van": 0.2, "truck": 0.1},
        "temper": {"normal": 0.7, "cautious": 0.3},
        "model": {"IDM": 0.75, "Krauss": 0.25},
    }
    for trait, shares in wished.items():
        found = Counter(getattr(vehicle.type, trait) for vehicle in vehicles)
        assert set(found) == set(shares)
        for value, share in shares.items():
            margin = 4.0 * np.sqrt(share * (1.0 - share) / count)
            assert abs(found[value] / count - share) < margin
    own = [vehicle.route for vehicle in vehicles if vehicle.id.startswith("own")]
    left = own.count(("west_in", "north_out")) / len(own)
    assert abs(left - 0.5) < 4.0 * 0.5 / np.sqrt(len(own))


def test_another_flow_leaves_the_own_stream_alone():
    record = network("intersection")
    quiet = replace(BUSY, oncoming_veh_per_h=0.0, cross_veh_per_h=0.0)
    alone = vehicles_for(record, quiet, 3, 0.0, 900.0)
    among = vehicles_for(record, BUSY, 3, 0.0, 900.0)
    assert alone == tuple(v for v in among if v.id.startswith("own."))
    assert {v.id.split(".")[0] for v in among} == {
        "own",
        "oncoming",
        "cross_n",
        "cross_s",
    }


def test_the_ego_lane_is_fed_beside_the_rest():
    record = network("lane_change")
    demand = Demand(own_veh_per_h=700.0, own_lane=1, ego_lane_veh_per_h=300.0)
    vehicles = vehicles_for(record, demand, 3, 0.0, 3600.0)
    lanes = {stream: [] for stream in ("own", "ego_lane")}
    for vehicle in vehicles:
        lanes[vehicle.id.split(".")[0]].append(vehicle.lane)
    assert set(lanes["own"]) == {1}
    assert set(lanes["ego_lane"]) == {record.lane} == {0}
    assert abs(len(lanes["ego_lane"]) - 300.0) < 4.0 * np.sqrt(300.0)
    without = vehicles_for(
        record, replace(demand, ego_lane_veh_per_h=0.0), 3, 0.0, 3600.0
    )
    assert without == tuple(v for v in vehicles if v.id.startswith("own."))


def test_more_time_only_adds_vehicles():
    short = vehicles_for(network("straight"), BUSY, 3, 0.0, 300.0)
    longer = vehicles_for(network("straight"), BUSY, 3, 0.0, 600.0)
    assert longer[: len(short)] == short


def test_file_says_what_was_drawn(tmp_path):
    target = tmp_path / "a.rou.xml"
    record = network("curved")
    vehicles = write_demand(record, BUSY, 4, 10.0, 400.0, target, EGO)
    root = ElementTree.parse(target).getroot()
    types = {element.get("id"): element.attrib for element in root.iter("vType")}
    assert set(types) == {"ego"} | {vehicle.type.id for vehicle in vehicles}
    for name, attributes in types.items():
        assert attributes["speedDev"] == "0"
        assert float(attributes["width"]) <= 2.5
        assert float(attributes["decel"]) <= float(attributes["emergencyDecel"]) < 9.0
        assert ("sigma" in attributes) == (name == "ego" or name.endswith("Krauss"))
    ego = types["ego"]
    assert (ego["length"], ego["width"], ego["decel"]) == ("4.8", "1.9", "4")
    assert (ego["apparentDecel"], ego["emergencyDecel"]) == ("4", "8")
    assert root.find("route[@id='ego']").get("edges") == " ".join(record.route)
    written = [
        (
            element.get("id"),
            float(element.get("depart")),
            element.get("type"),
            float(element.get("speedFactor")),
            tuple(element.find("route").get("edges").split()),
        )
        for element in root.iter("vehicle")
    ]
    assert len(written) == len(vehicles) > 100
    for row, vehicle in zip(written, vehicles, strict=True):
        assert row[0] == vehicle.id
        assert row[1] == pytest.approx(vehicle.depart, abs=0.006)
        assert row[2] == vehicle.type.id
        assert row[3] == pytest.approx(vehicle.speed_factor, abs=6e-4)
        assert row[4] == vehicle.route
    assert [path.name for path in tmp_path.iterdir()] == ["a.rou.xml"]


def test_type_of_a_slow_leader_is_written(tmp_path):
    target = tmp_path / "a.rou.xml"
    demand = Demand(leader=LeaderType("truck", 8.0))
    write_demand(network("lane_change"), demand, 0, 0.0, 9.0, target, EGO)
    ego, leader = ElementTree.parse(target).getroot().findall("vType")
    assert (ego.get("id"), leader.get("id")) == ("ego", "leader")
    assert (leader.get("maxSpeed"), leader.get("sigma")) == ("8", "0")
    assert float(leader.get("length")) == LeaderType("truck", 8.0).length == 10.0


@pytest.mark.parametrize(
    ("kind", "speed", "message"),
    [
        ("tractor", 8.0, 'leader kind "tractor" is unknown; allowed: car, van, truck'),
        ("car", 0.0, "leader max_speed = 0 must be > 0"),
        ("car", nan, "leader max_speed = nan must be > 0"),
    ],
)
def test_leader_outside_its_range_is_named(kind, speed, message):
    with pytest.raises(NetworkError, match=message):
        LeaderType(kind, speed)


def test_drivers_differ_in_speed_as_their_tempers_say():
    vehicles = vehicles_for(network("straight"), BUSY, 5, 0.0, 5.0 * 3600.0)
    means = {
        temper: np.mean([v.speed_factor for v in vehicles if v.type.temper == temper])
        for temper in TEMPERS
    }
    assert means["cautious"] < means["normal"] < means["aggressive"]
    for vehicle in vehicles:
        highest = KINDS[vehicle.type.kind].highest_factor
        assert 0.7 <= vehicle.speed_factor <= highest
    assert {vehicle.type.model for vehicle in vehicles} == set(MODELS)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"own_veh_per_h": -1.0}, r"own_veh_per_h = -1 must be in \[0, 9000\]"),
        ({"cross_veh_per_h": nan}, "cross_veh_per_h = nan must be"),
        ({"oncoming_veh_per_h": 1e5}, "oncoming_veh_per_h = 100000 must be"),
        ({"truck_share": 1.5}, r"truck_share = 1.5 must be in \[0, 1\]"),
        ({"van_share": 0.6, "truck_share": 0.6}, r"van_share \+ truck_share = 1.2"),
        ({"cautious_share": 0.9}, r"cautious_share \+ aggressive_share = 1.1"),
        (
            {"models": (("SmartSK", 1.0),)},
            '"SmartSK" is unknown; allowed: Krauss, IDM, EIDM, A',
        ),
        ({"models": (("IDM", -1.0),)}, "share -1 of IDM must be >= 0"),
        ({"models": ()}, "must name some"),
        ({"models": (("IDM", 1.0), ("IDM", 1.0))}, "each once"),
    ],
)
def test_demand_outside_its_range_is_named(change, message):
    with pytest.raises(NetworkError, match=message):
        replace(BUSY, **change)


@pytest.mark.parametrize(
    ("seed", "begin", "end", "message"),
    [
        (-1, 0.0, 1.0, "seed = -1"),
        (0, 5.0, 1.0, "begin = 5, end = 1"),
        (0, 0.0, float("inf"), "end = inf"),
        (0, nan, 1.0, "begin = nan"),
    ],
)
def test_times_and_seeds_outside_their_range_are_named(seed, begin, end, message):
    with pytest.raises(NetworkError, match=message):
        vehicles_for(network("straight"), BUSY, seed, begin, end)


def test_ego_outside_its_range_is_named():
    with pytest.raises(NetworkError, match="ego width = 0 must be > 0"):
        EgoType(4.8, 0.0, 4.0, 8.0, 20.0)
    with pytest.raises(NetworkError, match="decel = 9 must be <= emergency_decel = 8"):
        EgoType(4.8, 1.9, 9.0, 8.0, 20.0)


def test_stream_without_a_flow_is_named():
    record = replace(network("straight"), streams=(Stream("sideways", ()),))
    with pytest.raises(NetworkError, match='no flow for stream "sideways"'):
        vehicles_for(record, BUSY, 0, 0.0, 1.0)


def test_file_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(NetworkError, match=r"absent/a\.rou\.xml: cannot be written"):
        write_demand(
            network("straight"), BUSY, 0, 0.0, 1.0, tmp_path / "absent" / "a.rou.xml"
        )
