import builtins
import hashlib
import json
import math
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from experiments.cosim.road import EgoTask, Road, Start
from experiments.cosim.sumo import frames
from experiments.cosim.sumo.settings import SlowLeader, SumoSettings
from experiments.cosim.sumo.world import SumoWorld
from experiments.errors import SimulationError
from planner.reference_path.frenet import state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import RoadBounds
from planner.vehicle import Vehicle
from sumo_nets.catalogue import network
from sumo_nets.demand import Demand, write_demand
from sumo_nets.route_path import StopLine, route_path
from sumo_nets.vehicle_types import EgoType

CAR = Vehicle()


def drive_straight(world: SumoWorld, steps: int = 80) -> str:
    """Drive on at constant speed; give a digest of everything observed."""
    start = world.enter()
    digest = hashlib.sha256()
    for k in range(steps):
        traffic = world.observe()
        digest.update(repr((traffic.vehicles.ids, traffic.time)).encode())
        for name in ("x", "y", "heading", "speed", "acceleration"):
            digest.update(getattr(traffic.vehicles, name).tobytes())
        moved = start.x + start.speed * (k + 1) * world.step
        world.advance(replace(start, x=moved))
    world.close()
    return digest.hexdigest()


def busy(folder: Path, seed: int = 5) -> SumoWorld:
    """Make the straight road with its full traffic."""
    net = network("straight")
    limits = CAR.limits
    ego = EgoType(
        CAR.length,
        CAR.width,
        limits.max_deceleration,
        limits.emergency_deceleration,
        limits.max_speed,
    )
    demand = Demand(own_veh_per_h=1500.0, oncoming_veh_per_h=900.0)
    route_file = folder / "busy.rou.xml"
    write_demand(net, demand, seed, 0.0, 200.0, route_file, ego)
    path = ReferencePath.from_segments([line(500.0)], (-100.0, 0.0, 0.0))
    road = RoadBounds(np.array([0.0]), np.array([5.0]), np.array([-5.0]))
    task = EgoTask(CAR, path.length, 13.0, Start(100.0))
    return SumoWorld(
        SumoSettings(
            net.net_file, route_file, net.route, Road(path, road), task, warm_up=30.0
        )
    )


@pytest.mark.sumo
def test_the_ego_enters_where_and_as_fast_as_wanted(straight):
    world = straight(start_s=80.0, start_offset=10.0 / 3.0, start_speed=7.5)
    ego = world.enter()
    assert (ego.x, ego.y) == pytest.approx((-20.0, 10.0 / 3.0))
    assert (ego.heading, ego.speed) == (0.0, 7.5)
    libsumo = pytest.importorskip("libsumo")
    assert libsumo.vehicle.getLaneID("ego") == "own_2"
    front = libsumo.vehicle.getPosition("ego")
    assert front == pytest.approx((-20.0 + CAR.front_reach, 10.0 / 3.0), abs=1e-3)


@pytest.mark.sumo
def test_the_ego_may_enter_faster_than_the_limit(straight):
    assert straight(start_speed=18.0).enter().speed == pytest.approx(18.0)


@pytest.mark.sumo
def test_the_ego_waits_for_a_gap(straight):
    # A car stands on the ego's place and leaves it after 5 s.
    parked = (
        '<vehicle id="parked" type="car" route="own" depart="0" departLane="1" '
        'departPos="62" departSpeed="0"><stop lane="own_1" endPos="62.5" '
        'duration="5"/></vehicle>'
    )
    world = straight(parked, start_speed=None)
    ego = world.enter()
    assert world.observe().time == 0.0
    ahead = float(world.observe().vehicles.x[0]) - 2.3 - (ego.x + CAR.front_reach)
    assert ahead > ego.speed**2 / 9.0 - 1.0  # it can stop behind the parked car
    assert ego.speed < 13.89


@pytest.mark.sumo
def test_no_room_is_a_simulation_error(straight):
    parked = (
        '<vehicle id="parked" type="car" route="own" depart="0" departLane="1" '
        'departPos="62" departSpeed="0"><stop lane="own_1" endPos="62.5" '
        'duration="500"/></vehicle>'
    )
    world = straight(parked, entry_patience=3.0)
    with pytest.raises(SimulationError, match=r"no room to enter within 3 s .* 12 m/s"):
        world.enter()


def leader_type(speed: float) -> str:
    """Give the type of a slow leader in the fixtures' route file."""
    return (
        f'<vType id="leader" length="10" width="2.5" maxSpeed="{speed:g}" '
        f'speedDev="0" sigma="0" emergencyDecel="9"/>'
    )


@pytest.mark.sumo
@pytest.mark.parametrize(("gap", "start_speed"), [(60.0, None), (8.0, None), (40.0, 9)])
def test_a_slow_leader_enters_ahead_in_the_same_step(straight, gap, start_speed):
    leader = SlowLeader("leader", gap, 6.0)
    world = straight(leader_type(6.0), start_speed=start_speed, leader=leader)
    ego = world.enter()
    traffic = world.observe()
    assert traffic.vehicles.ids == ("leader",)
    front = ego.x + CAR.front_reach
    assert traffic.vehicles.x[0] - 5.0 - front == pytest.approx(gap, abs=0.01)
    assert traffic.vehicles.y[0] == pytest.approx(ego.y, abs=0.01)
    # the ego comes no faster than it can stay behind the leader
    room = gap + traffic.vehicles.speed[0] ** 2 / 9.0
    assert ego.speed**2 / 9.0 < room
    for k in range(1, 100):
        moved = ego.x + 6.0 * world.step * k
        world.advance(replace(ego, x=moved, speed=6.0))
        assert world.observe().vehicles.speed[0] <= 6.0 + 1e-9
    assert world.observe().vehicles.speed[0] == pytest.approx(6.0)


@pytest.mark.sumo
def test_ego_and_leader_enter_together_or_not_at_all(straight):
    # someone stands at the leader's place for 3 s; the ego would have room
    parked = (
        '<vehicle id="parked" type="car" route="own" depart="0" departLane="1" '
        'departPos="130" departSpeed="0"><stop lane="own_1" endPos="130.5" '
        'duration="3"/></vehicle>'
    )
    leader = SlowLeader("leader", 55.0, 6.0)
    world = straight(leader_type(6.0) + parked, start_speed=None, leader=leader)
    ego = world.enter()
    assert world.entry_steps > 30
    traffic = world.observe()
    others = traffic.vehicles
    there = others.x[others.ids.index("leader")] - 5.0 - (ego.x + CAR.front_reach)
    assert there == pytest.approx(55.0, abs=0.01)


@pytest.mark.sumo
def test_a_leader_beyond_the_road_is_named(straight):
    leader = SlowLeader("leader", 450.0, 6.0)
    world = straight(leader_type(6.0), leader=leader)
    with pytest.raises(SimulationError, match="the slow leader's front bumper is on"):
        world.enter()


@pytest.mark.sumo
@pytest.mark.parametrize("l", [0.0, 1.2, -2.9])
def test_the_ego_is_exactly_where_it_was_put(straight, l):
    libsumo = pytest.importorskip("libsumo")
    world = straight()
    world.enter()
    for k in range(20):
        ego = state_on_path(world.road.path, 60.0 + 1.1 * k, l, 11.0)
        ego = replace(ego, heading=0.05)
        world.advance(ego)
        x, y = libsumo.vehicle.getPosition("ego")
        angle = libsumo.vehicle.getAngle("ego")
        back = frames.rear_axle_from_front(x, y, angle, CAR)
        assert back == pytest.approx((ego.x, ego.y, 0.05), abs=1e-9)
        assert libsumo.vehicle.getSpeed("ego") == 11.0
        assert libsumo.vehicle.getRoute("ego") == ("own",)


@pytest.mark.sumo
def test_observed_centres_lie_half_a_length_behind_the_bumper(straight):
    libsumo = pytest.importorskip("libsumo")
    cars = (
        '<vehicle id="ours" type="car" route="own" depart="0" departLane="2" '
        'departPos="120" departSpeed="10"/>'
        '<vehicle id="theirs" type="car" route="oncoming" depart="0" '
        'departPos="200" departSpeed="10"/>'
    )
    world = straight(cars, view_radius=1e3)
    world.enter()
    traffic = world.observe()
    assert traffic.vehicles.ids == ("ours", "theirs")
    others = traffic.vehicles
    for name, x, y, way in zip(
        others.ids, others.x, others.y, (1.0, -1.0), strict=True
    ):
        front_x, front_y = libsumo.vehicle.getPosition(name)
        assert (x, y) == pytest.approx((front_x - way * 2.3, front_y), abs=1e-6)
    assert np.cos(traffic.vehicles.heading) == pytest.approx([1.0, -1.0])
    assert traffic.vehicles.length == pytest.approx([4.6, 4.6])
    assert traffic.vehicles.width == pytest.approx([1.8, 1.8])


@pytest.mark.sumo
def test_vehicles_out_of_view_are_not_reported(straight):
    car = (
        '<vehicle id="far" type="car" route="own" depart="0" departLane="2" '
        'departPos="300" departSpeed="10"/>'
    )
    world = straight(car, view_radius=100.0)
    world.enter()
    assert world.observe().vehicles.ids == ()


@pytest.mark.sumo
def test_cars_change_lanes_smoothly(straight):
    slow = (
        '<vType id="slow" length="4.6" width="1.8" maxSpeed="3"/>'
        '<vehicle id="lead" type="slow" route="own" depart="0" departLane="1" '
        'departPos="200" departSpeed="3"/>'
        '<vehicle id="car" type="keen" route="own" depart="0" departLane="1" '
        'departPos="150" departSpeed="13"/>'
    )
    keen = '<vType id="keen" length="4.6" width="1.8" lcSpeedGain="5"/>'
    world = straight(keen + slow, start_s=10.0, start_speed=1.0, view_radius=1e3)
    ego = world.enter()
    lateral = []
    for _ in range(80):
        traffic = world.observe()
        lateral.append(float(traffic.vehicles.y[traffic.vehicles.ids.index("car")]))
        world.advance(replace(ego, speed=0.0))
    assert abs(lateral[-1] - lateral[0]) == pytest.approx(10.0 / 3.0, abs=1e-3)
    assert np.abs(np.diff(lateral)).max() < 0.25


@pytest.mark.sumo
def test_same_seed_same_traffic_in_this_process_and_another(tmp_path):
    first, again = drive_straight(busy(tmp_path)), drive_straight(busy(tmp_path))
    assert first == again
    code = (
        "import importlib.util, json, pathlib, sys;"
        f"spec = importlib.util.spec_from_file_location('s', {__file__!r});"
        "m = importlib.util.module_from_spec(spec); spec.loader.exec_module(m);"
        f"print(json.dumps(m.drive_straight(m.busy(pathlib.Path({str(tmp_path)!r})))))"
    )
    root = Path(__file__).parents[4]
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=root,
        env={"PYTHONPATH": str(root), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout) == first
    assert drive_straight(busy(tmp_path, seed=6)) != first


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"route": ("own", "nowhere")}, "Edge 'nowhere' is not known"),
        ({"route_file": Path("missing.rou.xml")}, "missing.rou.xml"),
        ({"net_file": Path("missing.net.xml")}, "no such network file"),
        ({"vehicle": Vehicle(length=5.0)}, "measures 4.8 x 1.9 m, the ego 5 x 1.9"),
        ({"start_offset": 40.0}, "none of the edges own"),
        ({"stop_lines": (StopLine("dark", 0, 9.0),)}, "'dark' is not known"),
    ],
)
def test_what_does_not_fit_is_one_line_and_leaves_the_process_usable(
    straight, changes, message
):
    world = straight(**changes)
    with pytest.raises(SimulationError, match=message) as caught:
        world.enter()
    assert "\n" not in str(caught.value)
    world.close()
    assert straight().enter().speed == 12.0


@pytest.mark.sumo
def test_a_route_file_without_the_ego_s_type_is_named(straight, tmp_path):
    file = tmp_path / "empty.rou.xml"
    file.write_text("<routes/>")
    with pytest.raises(SimulationError, match="Vehicle type 'ego' is not known"):
        straight(route_file=file).enter()


@pytest.mark.sumo
def test_a_truncated_network_does_not_kill_the_process(straight, tmp_path):
    cut = tmp_path / "cut.net.xml"
    cut.write_bytes(network("straight").net_file.read_bytes()[:1000])
    with pytest.raises(SimulationError, match="truncated"):
        straight(net_file=cut).enter()


@pytest.mark.sumo
@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("name", ["x", "heading", "speed"])
def test_numbers_that_are_not_finite_never_reach_sumo(straight, name, bad):
    world = straight()
    ego = world.enter()
    with pytest.raises(SimulationError, match="cannot be moved"):
        world.advance(replace(ego, **{name: bad}))


@pytest.mark.sumo
def test_one_simulation_per_process(straight):
    first = straight()
    first.enter()
    with pytest.raises(SimulationError, match="already runs"):
        straight().enter()
    assert first.observe().vehicles.ids == ()


@pytest.mark.sumo
def test_a_lost_ego_is_a_simulation_error(straight):
    libsumo = pytest.importorskip("libsumo")
    world = straight()
    ego = world.enter()
    libsumo.vehicle.remove("ego")
    with pytest.raises(SimulationError, match="'ego' is not known"):
        world.advance(ego)


@pytest.mark.sumo
def test_close_is_allowed_at_any_time(straight):
    world = straight()
    world.close()
    world.enter()
    world.close()
    world.close()
    with pytest.raises(SimulationError, match="not running"):
        world.observe()


@pytest.mark.parametrize("kind", [ImportError, OSError])
def test_a_missing_system_library_is_named(monkeypatch, straight, kind):
    real = builtins.__import__

    def broken(name, *args, **kwargs):
        if name == "libsumo":
            raise kind("libGL.so.1: cannot open shared object file\nmore")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", broken)
    with pytest.raises(SimulationError) as caught:
        straight().enter()
    message = str(caught.value)
    assert "libGL is missing" in message
    assert "libgl1" in message
    assert "\n" not in message


@pytest.mark.sumo
def test_signals_follow_the_program_of_the_light(tmp_path):
    net = network("intersection")
    found = route_path(net.net_file, net.route, net.lane)
    limits = CAR.limits
    ego_type = EgoType(CAR.length, CAR.width, 4.5, 8.0, limits.max_speed)
    route_file = tmp_path / "empty.rou.xml"
    write_demand(net, Demand(), 0, 0.0, 10.0, route_file, ego_type)
    path = ReferencePath.from_polyline(found.points)
    road = RoadBounds(found.s, found.left, found.right)
    world = SumoWorld(
        SumoSettings(
            net.net_file,
            route_file,
            net.route,
            Road(path, road, stop_lines=found.stop_lines),
            EgoTask(CAR, path.length, 13.0, Start(50.0, 0.0, 0.0)),
            warm_up=0.0,
        )
    )
    try:
        ego = world.enter()
        letters = []
        for _ in range(300):
            (signal,) = world.observe().signals
            letters.append(signal.state)
            world.advance(ego)
    finally:
        world.close()
    assert signal.stop_s == found.stop_lines[0].s == pytest.approx(130.0, abs=1.0)
    changes = [a + b for a, b in pairwise(letters) if a != b]
    assert changes == ["Gy", "yr"]
    assert letters.count("y") == 40  # 4 s in the committed program


@pytest.mark.sumo
def test_kinds_and_indicators_of_the_traffic_are_read(tmp_path):
    world = busy(tmp_path)
    world.enter()
    kinds, indicators = set(), set()
    for _ in range(100):
        traffic = world.observe()
        assert list(traffic.looks) == list(traffic.vehicles.ids)
        for look in traffic.looks.values():
            kinds.add(look.kind)
            indicators.add(look.indicator)
        world.advance(replace(world._at_start(0.0)))
    world.close()
    assert kinds == {"passenger"}
    assert {"", "left"} <= indicators <= {"", "left", "right", "both"}
