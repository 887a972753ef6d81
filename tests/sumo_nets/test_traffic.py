import numpy as np
import pytest

from sumo_nets.catalogue import network, networks
from sumo_nets.demand import Demand, write_demand
from sumo_nets.route_path import route_path
from sumo_nets.vehicle_types import EgoType

libsumo = pytest.importorskip("libsumo")

pytestmark = pytest.mark.sumo

NAMES = sorted(networks())
DEMAND = Demand(own_veh_per_h=700.0, oncoming_veh_per_h=500.0, cross_veh_per_h=400.0)


@pytest.fixture
def run(tmp_path):
    """Start SUMO on a network; the second item is its log of warnings."""
    log = tmp_path / "errors.log"

    def start(record, seed=1, end=120.0):
        routes = tmp_path / "traffic.rou.xml"
        ego = EgoType(4.8, 1.9, 4.0, 8.0, 20.0)
        vehicles = write_demand(record, DEMAND, seed, 0.0, end, routes, ego)
        options = {
            "-n": record.net_file,
            "-r": routes,
            "--step-length": 0.1,
            "--seed": 1,
            "--error-log": log,
            "--time-to-teleport": -1,
            "--collision.action": "warn",
            "--collision.mingap-factor": 0,
            "--collision.check-junctions": "true",
        }
        pairs = [str(word) for item in options.items() for word in item]
        libsumo.start(["sumo", "--no-step-log", *pairs])
        return vehicles

    yield start, log
    libsumo.close()


@pytest.mark.parametrize("name", NAMES)
def test_traffic_drives_without_teleports_collisions_and_warnings(name, run):
    start, log = run
    expected = {vehicle.id: vehicle for vehicle in start(network(name))}
    departed, factors = {}, {}
    for _ in range(1300):
        libsumo.simulationStep()
        assert libsumo.simulation.getStartingTeleportNumber() == 0
        assert not libsumo.simulation.getCollisions()
        now = libsumo.simulation.getTime()
        for vehicle in libsumo.simulation.getDepartedIDList():
            departed[vehicle] = now
            factors[vehicle] = libsumo.vehicle.getSpeedFactor(vehicle)
    if name == "town":  # from its queues not everybody has departed by then
        assert len(departed) > 0.8 * len(expected)
    assert set(departed) <= set(expected)
    assert name == "town" or len(departed) == len(expected)
    for vehicle, time in departed.items():
        assert time >= expected[vehicle].depart - 0.11
        assert factors[vehicle] == pytest.approx(
            expected[vehicle].speed_factor, abs=1e-3
        )
    waits = [departed[name] - expected[name].depart for name in departed]
    assert np.median(waits) < 1.0
    # Hard braking before a light that turns yellow is no fault of network or routes.
    lines = [line for line in log.read_text().splitlines() if line]
    assert [line for line in lines if "emergency braking" not in line] == []


# On a ramp the path changes lanes; the speed here is too high for the bends of a town.
ON_ONE_LANE = [name for name in NAMES if name not in ("on_ramp", "town")]


@pytest.mark.parametrize("name", ON_ONE_LANE)
def test_sumo_finds_the_ego_path_on_its_lanes(name, run):
    record = network(name)
    start, _ = run
    start(record)
    path = route_path(record.net_file, record.route, record.lane)
    offset = {span.lane: span.begin for span in path.spans}
    heading = np.arctan2(*np.gradient(path.points, axis=0).T[::-1])
    libsumo.vehicle.add("ego", "ego", typeID="ego", departSpeed="10")
    libsumo.vehicle.setSpeedMode("ego", 32)
    libsumo.vehicle.setLaneChangeMode("ego", 0)
    seen = []
    for row in range(5, len(path.s) - 1, 5):
        x, y = path.points[row]
        angle = (90.0 - np.degrees(heading[row])) % 360.0
        libsumo.vehicle.setSpeed("ego", 10.0)
        libsumo.vehicle.moveToXY("ego", "", -1, x, y, angle, 3)
        libsumo.simulationStep()
        lane = libsumo.vehicle.getLaneID("ego")
        seen += [lane] if lane not in seen else []
        assert libsumo.vehicle.getRoute("ego") == record.route
        along = libsumo.vehicle.getLanePosition("ego")
        # SUMO counts all lanes of an edge alike: the outer one of a bend is longer.
        room = 0.2 + 0.01 * along * (record.lane == 0)
        assert along == pytest.approx(path.s[row] - offset[lane], abs=room)
        for signal, link, distance, _ in libsumo.vehicle.getNextTLS("ego"):
            (stop,) = path.stop_lines
            assert (signal, link) == (stop.signal, stop.link)
            assert distance == pytest.approx(stop.s - path.s[row], abs=0.2)
    # The seams between edges of one road are shorter than a step.
    passed = [lane for lane in path.lanes if lane in seen]
    assert seen == passed
    assert all(lane in seen for lane in path.lanes if not lane.startswith(":own"))


def test_queues_of_the_intersection_clear_and_nobody_waits_two_cycles(run):
    start, _ = run
    vehicles = start(network("intersection"), seed=2, end=600.0)
    arrived, longest = 0, 0.0
    for step in range(12000):
        libsumo.simulationStep()
        arrived += libsumo.simulation.getArrivedNumber()
        if step % 50 == 0:
            waits = map(libsumo.vehicle.getWaitingTime, libsumo.vehicle.getIDList())
            longest = max([longest, *waits])
    assert arrived == len(vehicles) > 250
    assert longest < 80.0  # one cycle
