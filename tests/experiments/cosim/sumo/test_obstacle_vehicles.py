import math

import numpy as np
import pytest

from experiments.cosim.sumo.lanes import Lane
from experiments.cosim.sumo.obstacle_vehicles import (
    LEAST_INSIDE,
    SAMPLING,
    TRAFFIC_WIDTH,
    blocked_stretches,
    twins,
)
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line

WIDTH = 10.0 / 3.0
ROAD = [
    Lane(f"e_{i}", "e", i, WIDTH, np.array([(0, y), (200, y)], float))
    for i, y in enumerate((-WIDTH, 0.0, WIDTH))
]
PATH = ReferencePath.from_segments([line(200.0)])


def on_road(**body):
    return obstacles_on_path(PATH, [PlacedBody("body", 100.0, **body)])


def blocked(**body) -> dict[str, tuple[float, float]]:
    found = {}
    for lane in ROAD:
        for stretch in blocked_stretches(on_road(**body), 0, lane):
            found[lane.id] = stretch
    return found


def test_a_disc_in_its_lane_blocks_that_lane():
    assert blocked(l=0.0, radius=0.8) == {
        "e_1": pytest.approx((99.2, 100.8), abs=SAMPLING)
    }


def test_a_disc_on_the_line_blocks_what_a_car_would_touch():
    assert set(blocked(l=WIDTH / 2, radius=0.5)) == set()
    stretches = blocked(l=WIDTH / 2, radius=1.0)
    assert set(stretches) == {"e_1", "e_2"}
    # The chord that a car's side cuts out of the disc.
    beyond = WIDTH / 2 - TRAFFIC_WIDTH / 2
    half = math.sqrt(1.0 - beyond**2)
    for stretch in stretches.values():
        assert stretch == pytest.approx((100 - half, 100 + half), abs=SAMPLING)


def test_a_turned_box_blocks_its_true_extent():
    heading, length, width = 0.5, 5.0, 1.0
    half = length / 2 * math.cos(heading) + width / 2 * math.sin(heading)
    (stretch,) = blocked(l=0.0, length=length, width=width, heading=heading).values()
    assert half > 2.4
    # The corners stick out of the swept area sideways, not lengthwise.
    assert stretch[1] - stretch[0] <= 2 * half + SAMPLING
    assert stretch[1] - stretch[0] > 2 * (length / 2 * math.cos(heading)) - 0.5


def test_a_wide_box_blocks_every_lane():
    assert set(blocked(l=0.0, length=1.0, width=9.0)) == {"e_0", "e_1", "e_2"}


def test_a_body_beside_the_road_blocks_nothing():
    assert blocked(l=WIDTH + 2.5, radius=1.0) == {}


def test_the_smallest_body_is_not_overlooked():
    (stretch,) = blocked(l=0.43, radius=0.01).values()
    assert stretch[0] - SAMPLING <= 100.0 <= stretch[1] + SAMPLING
    (twin,) = twins(on_road(l=0.43, radius=0.01), ROAD)
    assert twin.length >= SAMPLING


def test_a_lane_that_comes_back_is_blocked_twice():
    points = [(0, 0), (150, 0), (150, 3), (0, 3)]
    hairpin = Lane("u_0", "u", 0, 3.0, np.array(points, float))
    body = obstacles_on_path(PATH, [PlacedBody("body", 50.0, 1.5, radius=1.2)])
    assert len(blocked_stretches(body, 0, hairpin)) == 2


def test_bodies_are_placed_along_the_road():
    radius = 30.0
    path = ReferencePath.from_segments([arc(60.0, 1.0 / radius)])
    bodies = [PlacedBody("a", 0.0, 2.0, radius=1.0), PlacedBody("b", 15.0, -4.0, 3, 2)]
    placed = obstacles_on_path(path, bodies)
    turn = 15.0 / radius
    assert placed.ids == ("a", "b")
    assert placed.x == pytest.approx([0.0, 34.0 * math.sin(turn)])
    assert placed.y == pytest.approx([2.0, radius - 34.0 * math.cos(turn)])
    assert placed.heading == pytest.approx([0.0, turn])
    assert (placed.length[1], placed.width[1], placed.radius[0]) == (3.0, 2.0, 1.0)


@pytest.mark.sumo
def test_traffic_stops_before_an_obstacle_and_never_touches_it(straight):
    wall = [PlacedBody("wall", 250.0, l=0.0, length=2.0, width=9.0, heading=0.2)]
    cars = "".join(
        f'<vehicle id="car.{k}" type="car" route="own" depart="{3 * k}" '
        f'departLane="{k % 3}" departSpeed="10"/>'
        for k in range(9)
    )
    path = ReferencePath.from_segments([line(500.0)], (-100.0, 0.0, 0.0))
    world = straight(
        cars, obstacles=obstacles_on_path(path, wall), start_s=400.0, view_radius=1e3
    )
    start = world.enter()
    reached = {}
    for _ in range(900):
        traffic = world.observe()
        assert all(name.startswith("car.") for name in traffic.vehicles.ids)
        front = traffic.vehicles.x + 0.5 * traffic.vehicles.length
        for name, x in zip(traffic.vehicles.ids, front, strict=True):
            reached[name] = float(x)
        world.advance(start)
    assert len(reached) == 9
    # The rear of the turned wall, at the farthest side of the right lane.
    nearest = 150.0 - (1.0 + 4.4 * math.tan(0.2)) / math.cos(0.2) - 0.2
    assert max(reached.values()) < nearest + 4.4 * math.tan(0.2) * 2
    assert min(reached.values()) > 60.0
    assert float(traffic.vehicles.speed.max()) < 0.1


@pytest.mark.sumo
def test_twins_do_not_drift(straight):
    libsumo = pytest.importorskip("libsumo")
    bodies = [
        PlacedBody("disc", 200.0, 1.7, radius=1.0),
        PlacedBody("box", 250.0, -3.0, length=4.0, width=1.5, heading=0.6),
    ]
    path = ReferencePath.from_segments([line(500.0)], (-100.0, 0.0, 0.0))
    obstacles = obstacles_on_path(path, bodies)
    world = straight(obstacles=obstacles)
    start = world.enter()
    names = [n for n in libsumo.vehicle.getIDList() if n.startswith("static@")]
    before = [libsumo.vehicle.getPosition(name) for name in names]
    for _ in range(300):
        world.advance(start)
    after = [libsumo.vehicle.getPosition(name) for name in names]
    assert len(names) == 3  # the disc lies on the line between two lanes
    assert before == after


@pytest.mark.parametrize("length", [0.1, 5.0])
def test_lanes_that_only_draw_a_joint_get_no_twin(length):
    """An obstacle that begins at a joint blocks the lane behind it as it is."""
    before, behind = np.array([(0, 0), (98, 0)]), np.array([(98 + length, 0), (200, 0)])
    inside = np.array([(98, 0), (98 + length, 0)])
    lanes = [
        Lane("a_0", "a", 0, WIDTH, before.astype(float)),
        Lane(":j_0_0", ":j_0", 0, WIDTH, inside.astype(float)),
        Lane("b_0", "b", 0, WIDTH, behind.astype(float)),
    ]
    body = on_road(l=0.0, length=2.0 * length + 3.0, width=2.0)
    edges = {twin.lane.edge for twin in twins(body, lanes)}
    assert "b" in edges
    assert (":j_0" in edges) == (length > LEAST_INSIDE)
