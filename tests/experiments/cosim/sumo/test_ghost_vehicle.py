import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from experiments.cosim.collision_monitor import CollisionMonitor
from experiments.cosim.sumo.ghost_vehicle import Ghost
from experiments.cosim.sumo.lanes import Lane, Strip
from planner.reference_path.frenet import state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.states import CartesianState
from planner.vehicle import Vehicle
from sumo_nets.catalogue import network

CAR = Vehicle()
WIDTH = 3.5


def drive(world, lane_change, steps=100):
    """Change lanes; give the rear car's speeds, overlap steps and ghost sightings."""
    start = world.enter()
    monitor = CollisionMonitor(world.road, CAR)
    speeds, overlaps, ghosts = [], 0, []
    for k in range(steps):
        traffic = world.observe()
        state = lane_change(start, k * world.step)
        verdict = monitor.check(state, traffic.vehicles, state.x + 100.0)
        overlaps += bool(verdict.contacts)
        speeds.append(float(traffic.vehicles.speed[traffic.vehicles.ids.index("rear")]))
        if traffic.ghost is not None:
            ghosts.append((k, traffic.ghost.y))
        world.advance(lane_change(start, (k + 1) * world.step))
    world.close()
    return np.array(speeds), overlaps, ghosts


def rear_car(gap: float) -> dict[str, str]:
    """A faster car in the left lane, `gap` behind the ego's rear bumper."""
    position = 60.0 - CAR.rear_overhang - gap
    return {
        "vehicles": f'<vehicle id="rear" type="car" route="own" depart="0" '
        f'departLane="2" departPos="{position}" departSpeed="17"/>',
        "car": 'speedFactor="1.224"',
    }


@pytest.mark.sumo
@pytest.mark.parametrize("lane_change_duration", [0.0, 2.5])
def test_a_rear_car_sees_the_ego_from_the_line_on(
    straight, lane_change, lane_change_duration
):
    with_ghost = straight(**rear_car(12.0), lane_change_duration=lane_change_duration)
    speeds, overlaps, ghosts = drive(with_ghost, lane_change)
    # Body over the line, centre over the line, body out of the old lane.
    first, last = ghosts[0][0], ghosts[-1][0]
    lateral = [
        lane_change(CartesianState(0, 0, 0, 0, 12, 0), k / 10).y for k in (first, last)
    ]
    assert lateral[0] == pytest.approx((10 / 3 - CAR.width) / 2, abs=0.25)
    assert lateral[1] == pytest.approx((10 / 3 + CAR.width) / 2, abs=0.25)
    assert {round(y, 2) for _, y in ghosts} == {3.33, 0.0}
    braking = int(np.flatnonzero(np.diff(speeds) < -0.3)[0])
    assert first <= braking <= first + 2
    assert overlaps == 0

    without = straight(
        **rear_car(12.0), lane_change_duration=lane_change_duration, ghost=False
    )
    speeds, overlaps, ghosts = drive(without, lane_change)
    assert ghosts == []
    assert int(np.flatnonzero(np.diff(speeds) < -0.3)[0]) >= braking + 5
    assert overlaps > 0


@pytest.mark.sumo
def test_the_ghost_is_no_traffic_and_no_collision(straight, lane_change):
    world = straight()
    start = world.enter()
    seen = 0
    for k in range(80):
        traffic = world.observe()
        assert traffic.vehicles.ids == ()
        seen += traffic.ghost is not None
        world.advance(lane_change(start, (k + 1) * world.step))
    assert seen > 10
    assert world.reported_collisions == 0


def turn_left_and_change(world, seconds: float = 5.0):
    """Change one lane over inside the junction; give speeds, clearance, ghost lanes."""
    libsumo = pytest.importorskip("libsumo")
    world.enter()
    monitor = CollisionMonitor(world.road, CAR)
    speeds, clearance, lanes = [], math.inf, {}
    for k in range(round(seconds / world.step)):
        s = 118.0 + 6.0 * k * world.step
        share = min(max((s - 126.0) / 24.0, 0.0), 1.0)
        l = 10.0 / 3.0 * (3.0 - 2.0 * share) * share**2
        slope = 20.0 / 24.0 * (share - share**2)
        state = state_on_path(world.road.path, s, l, 6.0)
        state = replace(state, heading=state.heading + math.atan(slope))
        if k:
            world.advance(state)
        traffic = world.observe()
        clearance = min(clearance, monitor.check(state, traffic.vehicles, s).clearance)
        speeds.append(float(traffic.vehicles.speed[0]))
        if traffic.ghost is not None:
            lane = libsumo.vehicle.getLaneID("ghost@ego")
            assert libsumo.vehicle.getLaneID("ego") != lane
            lanes.setdefault(lane, k)
    world.close()
    return np.array(speeds), clearance, lanes


@pytest.mark.sumo
def test_the_ghost_works_inside_a_junction(straight):
    path = ReferencePath.from_segments(
        [line(140.0), arc(7.5 * math.pi, 1.0 / 15.0), line(250.0)],
        (-150.0, -5.0, 0.0),
    )
    net = network("intersection")
    rear = (
        '<vehicle id="rear" type="car" depart="0" departLane="2" departPos="106" '
        'departSpeed="8.5"><route edges="west_in north_out"/></vehicle>'
    )
    given = {
        "net_file": net.net_file,
        "route": net.route,
        "path": path,
        "start_s": 118.0,
        "start_speed": 6.0,
    }
    seen, unseen = (
        turn_left_and_change(straight(rear, **given, ghost=ghost))
        for ghost in (True, False)
    )
    assert list(seen[2]) == [":centre_14_1", ":centre_14_0"]
    assert unseen[2] == {}
    first_difference = int(np.flatnonzero(seen[0] != unseen[0])[0])
    assert first_difference == seen[2][":centre_14_1"] + 1
    assert seen[1] > 1.0
    assert unseen[1] < 0.5


@pytest.mark.sumo
@pytest.mark.parametrize("speed", [0.0, 16.0, 25.0])
def test_the_ghost_keeps_up_above_every_limit(straight, speed):
    libsumo = pytest.importorskip("libsumo")
    world = straight()  # limit 13.89 m/s, the ego's type 20 m/s
    start = world.enter()
    for k in range(30):
        inside = k % 6 < 2  # comes and goes
        x = start.x + speed * (k + 1) * world.step
        world.advance(replace(start, x=x, y=0.0 if inside else 1.0, speed=speed))
        assert (world.observe().ghost is None) == inside
        assert ("ghost@ego" in libsumo.vehicle.getIDList()) == (not inside)
        if not inside:
            assert libsumo.vehicle.getLaneID("ghost@ego") == "own_2"
            assert libsumo.vehicle.getSpeed("ghost@ego") == speed
            # all others look so much farther behind as this factor says
            factor = libsumo.vehicle.getSpeedFactor("ghost@ego")
            assert factor == pytest.approx(max(1.0, speed / 13.89), rel=0.01)


def waiting_ghost(lane_id):
    """Ghost of an ego 0.3 m before a junction, which SUMO has in a lane."""
    before = Lane("in_0", "in", 0, WIDTH, np.array([(0.0, 0.0), (40.0, 0.0)]))
    inside = Lane(":j_0_0", ":j_0", 0, WIDTH, np.array([(40.0, 0.0), (50.0, 5.0)]))
    types = SimpleNamespace(getIDList=lambda: ["type@ghost@car"], getLength=lambda _: 5)
    vehicle = SimpleNamespace(getLaneID=lambda _: lane_id)
    sumo = SimpleNamespace(vehicletype=types, vehicle=vehicle)
    strips = [Strip([before]), Strip([inside])]
    return Ghost(sumo, "ego", "route", "car", strips), vehicle


def test_a_ghost_may_be_faster_than_where_its_route_begins():
    limits, factors = {"slow_0": 5.0, "in_0": 14.0}, []
    ghost, _ = waiting_ghost("in_0")
    sumo = ghost._sumo
    sumo.route = SimpleNamespace(getEdges=lambda _: ("slow", "in"))
    sumo.edge = SimpleNamespace(getLaneNumber=lambda _: 1)
    sumo.lane = SimpleNamespace(getMaxSpeed=limits.__getitem__)
    sumo.vehicletype.setSpeedFactor = lambda _, factor: factors.append(factor)
    for speed in (0.0, 4.0, 10.0):
        ghost._allow(speed, "in_0")
    assert factors == pytest.approx([1.0, 1.0, 2.002])


def test_an_ego_that_waits_at_its_line_is_not_counted_in_the_junction():
    state = CartesianState(39.7 - CAR.front_reach, 0.2, 0.0, 0.0, 10.0, 0.0)
    front = (39.7, 0.2)
    for lane_id, before_line in (("in_0", True), (":j_0_0", False)):
        ghost, _ = waiting_ghost(lane_id)
        assert ghost.update(state, CAR, front, before_line=before_line) == front
    ghost, vehicle = waiting_ghost(":j_0_0")
    back = pytest.approx((40.0 - WIDTH / 2.0 - 0.1, 0.0))
    assert ghost.update(state, CAR, front, before_line=True) == back
    vehicle.getLaneID = lambda _: "in_0"  # stays there as long as it waits
    assert ghost.update(state, CAR, front, before_line=True) == back
    assert ghost.update(state, CAR, front) == front


@pytest.mark.sumo
def test_sumo_keeps_an_ego_that_swings_out_of_its_lanes_in_a_junction(straight):
    libsumo = pytest.importorskip("libsumo")
    path = ReferencePath.from_segments(
        [line(140.0), arc(7.5 * math.pi, 1.0 / 15.0), line(250.0)],
        (-150.0, -5.0, 0.0),
    )
    net = network("intersection")
    world = straight(
        net_file=net.net_file, route=net.route, path=path, start_s=118.0, start_speed=6
    )
    world.enter()
    lanes = []
    for k in range(1, 80):
        s = 118.0 + 6.0 * k * world.step
        aside = 7.0 * math.sin(min(max((s - 130.0) / 24.0, 0.0), 1.0) * math.pi)
        world.advance(state_on_path(path, s, aside, 6.0))
        lanes.append(libsumo.vehicle.getLaneID("ego"))
    world.close()
    assert "" not in lanes
    assert lanes[-1] == ":centre_14_0"
