import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from experiments.cosim.collision_monitor import CollisionMonitor
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.road import Road
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Obstacles
from planner.states import CartesianState
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

CAR = Vehicle()
PATH = ReferencePath.from_segments([line(300.0)])


def monitor(
    obstacles: Obstacles | None = None, path=PATH, half_width=5.0
) -> CollisionMonitor:
    bounds = constant_bounds(path, half_width)
    return CollisionMonitor(
        Road(path, bounds, obstacles=obstacles or Obstacles.none()), CAR
    )


def ego(x: float, y: float, heading: float = 0.0) -> CartesianState:
    """Put the centre of the ego's rectangle at (x, y)."""
    back = CAR.centre_offset
    return CartesianState(
        x - back * math.cos(heading), y - back * math.sin(heading), heading, 0, 9, 0
    )


def body_points(x, y, heading, length, width, n=41):
    """Sample a rectangle densely, for overlaps by brute force."""
    along, across = np.meshgrid(
        np.linspace(-length / 2, length / 2, n), np.linspace(-width / 2, width / 2, n)
    )
    return (
        x + along * math.cos(heading) - across * math.sin(heading),
        y + along * math.sin(heading) + across * math.cos(heading),
    )


def depth_inside(px, py, x, y, heading, length, width) -> float:
    """Give how deep the deepest point lies inside a rectangle, negative outside."""
    dx, dy = px - x, py - y
    along = dx * math.cos(heading) + dy * math.sin(heading)
    across = dy * math.cos(heading) - dx * math.sin(heading)
    inside = np.minimum(length / 2 - np.abs(along), width / 2 - np.abs(across))
    return float(inside.max())


places = st.tuples(
    st.floats(-7.0, 7.0), st.floats(-5.0, 5.0), st.floats(-math.pi, math.pi)
)


@given(places, st.floats(-math.pi, math.pi))
@settings(max_examples=200)
def test_contact_is_overlap(place, heading):
    x, y, other = place
    found = monitor().check(ego(0, 0, heading), road_users(("car", x, y, other)), 0.0)
    points = body_points(0, 0, heading, CAR.length, CAR.width)
    depth = depth_inside(*points, x, y, other, 4.6, 1.8)
    assume(abs(depth) > 0.15)  # finer than the samples can tell
    assert found.contacts == (("car",) if depth > 0 else ())


@given(places, places, st.floats(-0.2, 0.2), st.floats(0.0, 3.0))
@settings(max_examples=100)
def test_sweep_sees_what_happens_between_two_steps(start, end, turn, driven):
    x0, y0, h0 = start
    x1, y1 = end[0], end[1]
    watching = monitor()
    first = watching.check(ego(0, 0), road_users(("car", x0, y0, h0)), 0.0)
    after = ego(driven, 0, turn)
    second = watching.check(after, road_users(("car", x1, y1, h0)), 0.0)
    deepest = -math.inf
    for share in np.linspace(0.0, 1.0, 60):
        points = body_points(driven * share, 0.0, turn * share, CAR.length, CAR.width)
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        deepest = max(deepest, depth_inside(*points, x, y, h0, 4.6, 1.8))
    assume(abs(deepest) > 0.25)
    assert bool(first.contacts or second.contacts) == (deepest > 0)


def test_nothing_passes_through_anything():
    watching = monitor()
    before = watching.check(ego(0, 0), road_users(("car", 20.0, 0.0, 0.0)), 0.0)
    after = watching.check(ego(0.5, 0), road_users(("car", -20.0, 0.0, 0.0)), 0.0)
    assert before.contacts == ()
    assert after.contacts == ("car",)
    assert after.clearance == pytest.approx(20.5 - (CAR.length + 4.6) / 2)


def test_vehicles_are_matched_by_id_and_newcomers_are_not_swept():
    watching = monitor()
    first = road_users(("b", 20.0, 0.0, 0.0), ("a", 0.0, 9.0, 0.0))
    watching.check(ego(0, 0), first, 0.0)
    # b leaves, c appears on the other side: nobody has driven through the ego.
    moved = road_users(("a", 1.0, 9.0, 0.0), ("c", -20.0, 0.0, 0.0))
    assert watching.check(ego(0.5, 0), moved, 0.0).contacts == ()
    swapped = road_users(("c", 20.0, 0.0, 0.0), ("a", 1.0, 9.0, 0.0))
    assert watching.check(ego(0.5, 0), swapped, 0.0).contacts == ("c",)


def test_clearance_and_nearest_are_those_of_the_closest_body():
    obstacles = Obstacles(
        ("disc", "box"), [12.0, 0.0], [0.0, 4.0], [0, 0.3], [0, 2.0], [0, 1.0], [1.0, 0]
    )
    cars = road_users(("far", 40.0, 0.0, 0.0), ("near", -6.0, 0.0, 0.0))
    found = monitor(obstacles).check(ego(0, 0), cars, 0.0)
    assert found.nearest == "near"
    assert found.clearance == pytest.approx(6.0 - (CAR.length + 4.6) / 2)
    alone = monitor(obstacles).check(ego(7.0, 0), road_users(), 0.0)
    assert alone.nearest == "disc"
    assert alone.clearance == pytest.approx(5.0 - 1.0 - CAR.length / 2)


def test_an_empty_world_has_no_nearest():
    found = monitor().check(ego(0, 0), road_users(), 0.0)
    assert (found.contacts, found.nearest) == ((), None)
    assert found.clearance == math.inf


def test_a_static_body_is_touched_by_its_margin():
    obstacles = Obstacles(("disc",), [10.0], [0.0], [0.0], [0.0], [0.0], [1.0])
    gap = 10.0 - 1.0 - CAR.length / 2
    assert monitor(obstacles).check(ego(gap - 0.01, 0), road_users(), 0).contacts == ()
    assert monitor(obstacles).check(ego(gap + 0.01, 0), road_users(), 0).contacts == (
        "disc",
    )


@given(st.floats(-5.0, 5.0), st.floats(-1.5, 1.5))
def test_off_road_depth_on_a_straight_road(l, heading):
    reach = abs(CAR.length / 2 * math.sin(heading)) + CAR.width / 2 * math.cos(heading)
    found = monitor().check(ego(100.0, l, heading), road_users(), 100.0)
    assert found.off_road == pytest.approx(max(abs(l) + reach - 5.0, 0.0), abs=1e-9)


def test_off_road_depth_inside_a_bend_is_that_of_the_side_s_middle():
    radius, half_width = 20.0, 3.0
    path = ReferencePath.from_segments([arc(60.0, 1.0 / radius)])
    centre, turn = radius - 2.5, 30.0 / radius
    state = ego(centre * math.sin(turn), radius - centre * math.cos(turn), turn)
    found = monitor(None, path, half_width).check(state, road_users(), 30.0)
    inner = centre - CAR.width / 2
    assert found.off_road == pytest.approx(radius - half_width - inner, abs=1e-6)


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("offset", "heading", "touches"),
    [
        (1.7, 0.0, True),  # bumper in the next lane, 15 cm of overlap
        (0.0, -math.pi / 2, True),  # straight across the stopped car
        (1.9, 0.0, False),  # 5 cm of air
    ],
)
def test_sumo_misses_what_the_monitor_sees(straight, offset, heading, touches):
    stopped = (
        '<vehicle id="stopped" type="car" route="own" depart="0" departLane="2" '
        'departPos="200" departSpeed="0"><stop lane="own_2" endPos="200.5" '
        'duration="900"/></vehicle>'
    )
    world = straight(stopped, ghost=False)
    world.enter()
    watching = CollisionMonitor(world.road, CAR)
    seen = set()
    for _ in range(20):
        traffic_now = world.observe()
        x, y = float(traffic_now.vehicles.x[0]), float(traffic_now.vehicles.y[0])
        beside = replace(ego(x, y - offset, heading), speed=0.0)
        seen.update(watching.check(beside, traffic_now.vehicles, x + 100.0).contacts)
        world.advance(beside)
    assert seen == ({"stopped"} if touches else set())
    assert world.reported_collisions == 0
