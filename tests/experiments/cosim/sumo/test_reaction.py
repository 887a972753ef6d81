"""Drivers who react late still brake for a leader who slows down gently, in SUMO."""

from xml.etree import ElementTree

import pytest

from experiments.cosim.sumo.system_libraries import load_libsumo
from sumo_nets.catalogue import network
from sumo_nets.demand import Demand, write_demand
from sumo_nets.vehicle_types import MODELS

pytestmark = pytest.mark.sumo

STEP = 0.1  # [s]
SLOWS_DOWN = 200  # the step from which the leader brakes
FAST, SLOW, BRAKING = 15.0, 7.0, 2.5  # of the leader [m/s, m/s²]
AT_MOST = 6.0  # braking of its follower; emergencies have 8.5 [m/s²]


def followers(folder, model, reaction):
    """Types of the drivers of a model, as the traffic writes them."""
    demand = Demand(own_veh_per_h=900.0, models=((model, 1.0),), reaction=reaction)
    file = folder / "drawn.rou.xml"
    write_demand(network("lane_change"), demand, 1, 0.0, 600.0, file)
    types = ElementTree.parse(file).getroot().iter("vType")
    return [kind for kind in types if kind.get("id").startswith("car_")]


def hardest_braking(folder, kind):
    """Braking of a driver behind a leader who slows down; None if they touched."""
    edges = " ".join(network("lane_change").route)
    root = ElementTree.Element("routes")
    root.append(kind)
    ElementTree.SubElement(
        root, "vType", id="leader", sigma="0", length="4.8", emergencyDecel="8"
    )
    ElementTree.SubElement(root, "route", id="road", edges=edges)
    for name, of, place in (("L", "leader", 150.0), ("F", kind.get("id"), 80.0)):
        ElementTree.SubElement(
            root,
            "vehicle",
            id=name,
            type=of,
            route="road",
            depart="0",
            departLane="0",
            departPos=str(place),
            departSpeed=str(FAST),
        )
    file = folder / "two.rou.xml"
    file.write_bytes(ElementTree.tostring(root))
    sumo = load_libsumo()
    options = {
        "--net-file": network("lane_change").net_file,
        "--route-files": file,
        "--step-length": STEP,
        "--no-step-log": "true",
        "--no-warnings": "true",
        "--collision.action": "warn",
        "--collision.mingap-factor": 0,
    }
    sumo.start(["sumo", *(str(word) for pair in options.items() for word in pair)])
    try:
        hardest = 0.0
        sumo.simulationStep()
        sumo.vehicle.setSpeedMode("L", 0)
        for name in ("L", "F"):
            sumo.vehicle.setLaneChangeMode(name, 0)
        for k in range(SLOWS_DOWN + 150):
            braked = BRAKING * STEP * max(k - SLOWS_DOWN, 0)
            sumo.vehicle.setSpeed("L", max(SLOW, FAST - braked))
            sumo.simulationStep()
            hardest = max(hardest, -sumo.vehicle.getAcceleration("F"))
            (leader, _), (follower, _) = map(sumo.vehicle.getPosition, "LF")
            if abs(leader - follower) < 4.8:  # the road is straight, along x
                return None
        return hardest
    finally:
        sumo.close()


@pytest.mark.parametrize("reaction", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("model", MODELS)
def test_a_leader_that_slows_down_is_no_emergency(tmp_path, model, reaction):
    found = {
        kind.get("id"): hardest_braking(tmp_path, kind)
        for kind in followers(tmp_path, model, reaction)
    }
    assert len(found) == 3, "cautious, normal and aggressive"
    for name, hardest in found.items():
        assert hardest is not None, name
        assert hardest <= AT_MOST, name


@pytest.mark.parametrize(
    ("model", "reaction", "key"),
    [
        ("EIDM", 0.5, "actionStepLength"),
        ("EIDM", 1.0, "treaction"),
        ("IDM", 1.0, "actionStepLength"),
    ],
)
def test_eidm_has_a_reaction_time_of_its_own(tmp_path, model, reaction, key):
    (kind, *_) = followers(tmp_path, model, reaction)
    given = {"actionStepLength", "treaction"} & set(kind.keys())
    assert given == {key}
    assert kind.get(key) == f"{reaction:g}"
