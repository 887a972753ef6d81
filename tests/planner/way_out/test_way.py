"""Ways out by arcs keep clear of all, and are found where there is room."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.shapes.rectangles import Rectangle, distance
from planner.vehicle import Vehicle, VehicleLimits
from planner.way_out.way import Way, drive_along, way_from
from tests.planner.scenes import (
    Car,
    Disc,
    bend,
    ego_on,
    make_scene,
    obstacle_rectangles,
    road,
    straight,
)

LORRY = Vehicle(12.0, 2.5, 6.5, 3.0, VehicleLimits(max_curvature=0.12))
BEFORE = 15.0  # room before the front [m]


def standing(path, obstacles=(), vehicles=(), vehicle=LORRY, half=5.0, l=0.0):
    """The ego stands at s = 40 m."""
    return make_scene(
        path,
        ego_on(path, 40.0, l, speed=0.0),
        obstacles,
        vehicles,
        bounds=road(path, half, -half),
        vehicle=vehicle,
    )


def bodies_on(way: Way, vehicle):
    for x, y, heading in zip(way.x, way.y, way.heading, strict=True):
        middle = vehicle.centre_offset
        yield Rectangle(
            x + middle * math.cos(heading),
            y + middle * math.sin(heading),
            heading,
            vehicle.length,
            vehicle.width,
        )


@settings(deadline=None, max_examples=60)
@given(st.floats(-2.0, 2.0), st.floats(0.3, 1.2), st.booleans())
def test_a_way_keeps_clear_of_what_stands_and_of_the_edges(l, radius, turns):
    path = bend(40.0) if turns else straight()
    disc = Disc(40.0 + LORRY.front_reach + BEFORE, l, radius)
    scene = standing(path, [disc])
    way = way_from(scene, 30.0)
    assert way is not None
    obstacles = obstacle_rectangles(scene.obstacles)
    for body in bodies_on(way, LORRY):
        assert min(distance(body, x) for x in obstacles) > 0.1
        cos, sin = math.cos(body.heading), math.sin(body.heading)
        for u in (-1.0, 0.0, 1.0):
            for v in (-1.0, 1.0):
                a, b = u * 0.5 * body.length, v * 0.5 * body.width
                corner = (body.x + a * cos - b * sin, body.y + a * sin + b * cos)
                _, side = path.project(np.array([corner[0]]), np.array([corner[1]]))
                assert abs(side[0]) < 5.0
    assert np.abs(way.curvature).max() <= LORRY.limits.max_curvature + 1e-12
    step = np.hypot(np.diff(way.x), np.diff(way.y))
    assert step == pytest.approx(0.1, abs=1e-3)
    s, _ = path.project(way.x[-1:], way.y[-1:])
    assert s[0] >= 70.0 - 0.5
    along = float(path.at(s).heading[0])
    assert abs(math.remainder(way.heading[-1] - along, 2.0 * math.pi)) < 0.2


def test_there_is_no_way_through_a_wall():
    wall = [Disc(70.0, l, 0.5) for l in np.arange(-5.0, 5.5, 2.0)]
    assert way_from(standing(straight(), wall), 40.0) is None


def test_a_vehicle_that_stands_is_in_the_way_and_one_that_drives_is_not():
    path = straight()
    row = [Car(75.0, l, 0.0) for l in (-3.4, 0.0, 3.4)]
    assert way_from(standing(path, vehicles=row), 45.0) is None
    row = [replace(car, speed=3.0) for car in row]
    assert way_from(standing(path, vehicles=row), 45.0) is not None


def test_a_way_is_driven_from_where_the_ego_is_to_a_stand_at_its_end():
    path = straight()
    scene = standing(path, [Disc(64.0, 0.0, 0.8)], vehicle=Vehicle())
    way = way_from(scene, 30.0)
    assert way is not None
    going = drive_along(scene, way, 0.0, (2.0, 0.8), 30.0)
    assert (going.x[0], going.y[0]) == pytest.approx((scene.ego.x, scene.ego.y))
    assert going.speed.max() == pytest.approx(2.0, abs=0.05)
    assert going.speed[-1] == pytest.approx(0.0, abs=0.05)
    assert np.hypot(going.x[-1] - way.x[-1], going.y[-1] - way.y[-1]) < 0.3
    moved = np.hypot(np.diff(going.x), np.diff(going.y))
    mean = 0.5 * (going.speed[1:] + going.speed[:-1]) * scene.step
    assert moved == pytest.approx(mean, abs=0.02)
