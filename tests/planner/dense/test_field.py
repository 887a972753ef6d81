import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dense.field import (
    Cover,
    FrenetObstacles,
    RoadColumns,
    disc_centre,
    field_of,
    half_span,
    path_curvature,
    pieces,
    squared_chord,
    squared_distance,
    straight_field,
)
from planner.dense.lattice.edge_check import (
    edge_scratch,
    place_discs,
    road_along,
)
from planner.errors import InvalidInputError
from planner.reference_path.frenet import frenet_to_cartesian
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.scene import Obstacles
from planner.states import FrenetStates
from planner.vehicle import Vehicle
from tests.planner.scenes import Disc, bend, make_scene

ARC = ReferencePath.from_segments([arc(60.0, 1.0 / 20.0)])


def place(path, s, l):
    at = path.at(s)
    return at.x - l * at.sin_heading, at.y + l * at.cos_heading


@given(
    s=st.floats(20.0, 30.0),
    l=st.floats(-5.0, 5.0),
    other_s=st.floats(20.0, 30.0),
    other_l=st.floats(-5.0, 5.0),
)
def test_distance_on_an_arc_is_that_of_the_plane(s, l, other_s, other_l):
    x, y = place(ARC, s, l)
    other_x, other_y = place(ARC, other_s, other_l)
    plane = math.hypot(x - other_x, y - other_y)
    got = math.sqrt(squared_distance(s, l, other_s, other_l, 1.0 / 20.0))
    assert got == pytest.approx(plane, abs=1.1e-3)  # half a radian of the arc at most


@pytest.mark.parametrize("slope", [-0.4, 0.0, 0.3])
@pytest.mark.parametrize("l", [-3.0, 0.0, 3.0])
def test_discs_lie_along_the_heading(slope, l):
    s = 30.0
    x, y = place(ARC, s, l)
    rho = 1.0 - l / 20.0
    heading = float(ARC.at(s).heading) + math.atan2(slope, rho)
    want = x + 3.0 * math.cos(heading), y + 3.0 * math.sin(heading)
    got = place(ARC, *disc_centre(s, l, slope, 3.0, 1.0 / 20.0))
    assert math.dist(got, want) < 0.02  # what the series leaves at R = 20 m


@pytest.mark.parametrize("before", [0.0, 2.0, 4.0, 6.0, 8.0])
@pytest.mark.parametrize("offset", [8.0, -2.0])
def test_discs_of_a_long_body_are_where_a_bend_puts_them(before, offset):
    """The front is in a bend before the rear axle is; the tail is still out of it."""
    path = bend(40.0)  # begins at 60 m
    s, l, slope = 60.0 - math.copysign(before, offset), 1.0, 0.05
    samples = np.arange(30.0, 90.0)
    columns = RoadColumns(samples, *np.zeros((2, 60)), path.at(samples).curvature)
    road = road_along(np.array([s]), columns, np.array([offset]))
    at = path.at(np.array([s]))
    heading = float(at.heading[0]) + math.atan2(slope, 1.0 - road.curvature[0] * l)
    x, y = place(path, s, l)
    want = x + offset * math.cos(heading), y + offset * math.sin(heading)
    reach = float(road.reach[0, 0])
    turned = float(path.at(s + offset).heading) - float(path.at(s).heading)
    assert float(road.turned[0, 0]) == pytest.approx(turned, abs=0.02)  # samples, 1 m
    got = place(path, *disc_centre(s, l, slope, offset, reach))
    assert math.dist(got, want) < 0.15  # of 0.4 m with the curvature at the rear axle


def test_curvature_is_that_of_the_transform():
    path = ReferencePath.from_segments([clothoid(80.0, -0.02, 0.04)])
    rate = 0.06 / 80.0
    s, l, slope, second = 33.0, 1.7, 0.35, -0.05
    one, zero = np.ones(1), np.zeros(1)
    states = FrenetStates(
        s * one, one, zero, l * one, slope * one, zero, slope * one, second * one
    )
    want = frenet_to_cartesian(path, states).curvature[0]
    at = path.at(s)
    got = path_curvature(l, slope, second, float(at.curvature), rate)
    assert got == pytest.approx(want, abs=1e-12)


def test_obstacles_are_ordered_and_columns_checked():
    field = straight_field(np.array([[30.0, 1.0, 0.5], [10.0, -1.0, 2.0]]), 5.0, 60.0)
    assert field.s.tolist() == [10.0, 30.0]
    assert field.radius.tolist() == [2.0, 0.5]
    assert field.only(np.array([False, True])).s.tolist() == [30.0]
    with pytest.raises(InvalidInputError, match="left has shape"):
        FrenetObstacles(
            field.s, field.l, field.radius, [0.0, 1.0], [5.0], [-5.0, -5.0], [0.0, 0.0]
        )


def test_cover_covers_the_vehicle():
    vehicle = Vehicle()
    cover = Cover.of(vehicle)
    x = np.linspace(-vehicle.rear_overhang, vehicle.front_reach, 101)
    for side in (-1.0, 1.0):
        away = [np.hypot(x - o, side * vehicle.width / 2.0) for o in cover.offsets]
        assert np.min(away, axis=0).max() <= cover.radius + 1e-12


def test_scene_is_projected():
    path = bend(30.0)
    scene = make_scene(path, obstacles=[Disc(70.0, 1.0, 0.8), Disc(500.0, 0.0, 1.0)])
    field = field_of(scene, 100.0)
    assert field.s == pytest.approx([70.0], abs=1e-6)
    assert field.l == pytest.approx([1.0], abs=1e-6)
    assert field.radius == pytest.approx([0.8])
    curvature = field.road_at(np.array([20.0, 80.0]))[2]
    assert curvature == pytest.approx([0.0, 1.0 / 30.0])


def test_a_rectangle_is_covered_by_a_row_of_discs():
    columns = (
        np.array([v])
        for v in (10.0, 3.0, 0.4, 12.0, 2.5, 0.3)  # x, y, heading, size, radius
    )
    ids, x, y, radius = pieces(Obstacles(("lorry",), *columns))
    assert ids == ("lorry",) * 5
    random = np.random.default_rng(2)
    along, across = random.uniform(-6, 6, 500), random.uniform(-1.25, 1.25, 500)
    at_x = 10.0 + along * np.cos(0.4) - across * np.sin(0.4)
    at_y = 3.0 + along * np.sin(0.4) + across * np.cos(0.4)
    away = np.hypot(at_x[:, None] - x, at_y[:, None] - y)
    assert np.all((away + 0.3 <= radius + 1e-9).any(axis=1))
    assert radius.max() < 0.5 * np.hypot(12.0, 2.5)  # one disc would be larger


def test_a_disc_is_itself():
    columns = (np.array([v]) for v in (10.0, 3.0, 0.4, 0.0, 0.0, 1.5))
    ids, x, y, radius = pieces(Obstacles(("disc",), *columns))
    assert (ids, x[0], y[0], radius[0]) == (("disc",), 10.0, 3.0, 1.5)


def test_far_around_a_bend_nothing_is_at_the_egos_place():
    along = np.linspace(0.0, 400.0, 401)
    chords = [squared_chord(each, -1.0 / 40.0) for each in along]
    assert (np.diff(chords) > 0.0).all()


def test_a_long_body_is_not_made_wide():
    lorry = Vehicle(length=12.0, width=2.5, wheelbase=6.5, rear_overhang=3.0)
    cover = Cover.of(lorry)
    assert cover.radius - 1.25 <= 0.3
    assert 2.0 * cover.half_length * len(cover.offsets) == pytest.approx(12.0)
    assert len(Cover.of(Vehicle()).offsets) == 3


def test_the_front_of_a_long_body_stands_across_the_road_of_a_bend():
    discs = Cover.of(Vehicle(length=12.0, wheelbase=6.5, rear_overhang=3.0)).discs()
    there = half_span(discs, 0.2, 1.0, -0.14, -0.02)
    turned = np.arctan(0.2) + 0.14
    exact = discs.half_length * np.sin(turned) + discs.half_width * np.cos(turned)
    assert exact - 0.005 <= there <= exact + 0.03


def test_the_front_of_a_long_body_needs_its_room_at_the_entry_of_a_bend():
    """There the road has turned by more than the circle that leads as far aside."""
    path = ReferencePath.from_segments([line(60.0), clothoid(40.0, 0.0, 0.05)])
    discs = Cover.of(Vehicle(length=12.0, wheelbase=6.5, rear_overhang=3.0)).discs()
    samples, s = np.arange(30.0, 95.0, 0.5), 66.0
    columns = RoadColumns(
        samples, *np.zeros((2, samples.size)), path.at(samples).curvature
    )
    road = road_along(np.array([s]), columns, discs.offset)
    d = discs.offset.size - 1
    there = half_span(discs, 0.0, 1.0, road.turned[d, 0], road.reach[d, 0])
    turned = path.at(s + float(discs.offset[d])).heading - path.at(s).heading
    exact = discs.half_length * np.sin(turned) + discs.half_width * np.cos(turned)
    assert exact - 0.005 <= there <= exact + 0.03


@pytest.mark.parametrize("s", [52.0, 56.0, 63.0, 70.0, 79.0])
def test_lattice_edges_see_the_room_of_a_long_body_where_a_bend_begins(s):
    """Brute force: the corners of each piece of the body, projected on the path."""
    path = ReferencePath.from_segments([line(60.0), clothoid(40.0, 0.0, 0.05)])
    lorry = Vehicle(length=12.0, width=2.5, wheelbase=6.5, rear_overhang=3.0)
    discs = Cover.of(lorry).discs()
    x, y, heading = path.pose(s)
    along = np.linspace(-lorry.rear_overhang, lorry.front_reach, 61)
    worst = []
    for half in (1.25, -1.25):
        _, l = path.project(
            x + along * np.cos(heading) - half * np.sin(heading),
            y + along * np.sin(heading) + half * np.cos(heading),
        )
        worst.append(l)
    left, right = np.max(worst), np.min(worst)
    samples = np.arange(30.0, 95.0, 0.5)
    for spare, off_road in ((0.06, False), (-0.06, True)):
        bounds = np.ones(samples.size)
        curvature = path.at(samples).curvature
        columns = RoadColumns(
            samples, (left + spare) * bounds, (right - spare) * bounds, curvature
        )
        at = np.full(4, s)
        road = road_along(at, columns, discs.offset)
        edge = edge_scratch(4, discs.offset.size)
        edge.shape[:] = 0.0
        _, outside = place_discs(edge, at, road, discs, 0.2)
        assert outside is off_road
