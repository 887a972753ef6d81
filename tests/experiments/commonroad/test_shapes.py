import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.commonroad.records import Box
from experiments.commonroad.shapes import (
    LEAST_SIZE,
    box_along,
    box_polygon,
    covering_boxes,
    placed,
    smallest_box,
)

coordinates = st.floats(-20.0, 20.0)
headings = st.floats(-math.pi, math.pi)
boxes = st.builds(
    Box, coordinates, coordinates, headings, st.floats(0.5, 10), st.floats(0.5, 10)
)
clouds = st.lists(
    st.tuples(coordinates, coordinates), min_size=3, max_size=8, unique=True
).filter(lambda points: shapely.MultiPoint(points).convex_hull.area > 1.0)


@given(boxes)
def test_an_outline_has_the_size_and_place_of_its_box(box):
    outline = box_polygon(box)
    assert outline.area == pytest.approx(box.length * box.width)
    assert outline.centroid.coords[0] == pytest.approx((box.x, box.y), abs=1e-9)
    ahead = shapely.Point(
        box.x + 0.49 * box.length * math.cos(box.heading),
        box.y + 0.49 * box.length * math.sin(box.heading),
    )
    assert outline.contains(ahead)


@given(boxes)
def test_the_smallest_box_about_a_box_is_itself(box):
    found = smallest_box(box_polygon(box))
    assert found.length * found.width == pytest.approx(box.length * box.width)
    assert found.length >= found.width
    # not by their difference: of outlines that nearly coincide GEOS may get all of one
    assert box_polygon(found).hausdorff_distance(box_polygon(box)) < 1e-6


@given(clouds)
def test_no_box_in_another_direction_is_smaller(points):
    area = shapely.MultiPoint(points).convex_hull
    found = smallest_box(area)
    assert box_polygon(found).buffer(1e-6).covers(area)
    for heading in np.linspace(0.0, math.pi / 2.0, 46):
        other = box_along(area, float(heading))
        assert found.length * found.width <= other.length * other.width + 1e-9


@given(clouds, headings)
def test_a_box_along_a_direction_holds_the_area_and_touches_it(points, heading):
    area = shapely.MultiPoint(points).convex_hull
    box = box_along(area, heading)
    outline = box_polygon(box)
    assert outline.buffer(1e-6).covers(area)
    for a, b in zip(outline.exterior.coords, outline.exterior.coords[1:], strict=False):
        assert shapely.LineString([a, b]).distance(area) < 1e-6


def points_of(area):
    """Corners of an area and points inside it: its overlay is not to be trusted."""
    west, south, east, north = area.bounds
    x, y = np.meshgrid(np.linspace(west, east, 30), np.linspace(south, north, 30))
    grid = shapely.points(x.ravel(), y.ravel())
    corners = shapely.points(shapely.get_coordinates(area))
    return np.concatenate([corners, grid[shapely.intersects(area, grid)]])


@settings(max_examples=30)
@given(clouds, coordinates, coordinates)
def test_rectangles_cover_a_polygon_and_little_more(points, x, y):
    valid = shapely.make_valid(shapely.Polygon([*points, (x, y)]))
    # a spike without area is nothing that one could touch
    parts = [x for x in shapely.get_parts(valid) if x.geom_type.endswith("Polygon")]
    area = shapely.union_all(parts)
    if area.area < 1.0:
        return
    found = [box_polygon(box) for box in covering_boxes(area)]
    inside = points_of(area)
    away = shapely.distance(inside[:, np.newaxis], np.array(found))
    assert away.min(axis=1).max() < 1e-6
    whole = smallest_box(area)
    assert shapely.union_all(found).area <= whole.length * whole.width + 1e-6
    assert len(found) <= 2**5


def test_points_and_lines_have_a_least_size():
    point = smallest_box(shapely.Point(3.0, 4.0))
    assert point == Box(3.0, 4.0, 0.0, LEAST_SIZE, LEAST_SIZE)
    line = smallest_box(shapely.LineString([(0.0, 0.0), (0.0, 2.0)]))
    assert (line.length, line.width) == pytest.approx((2.0, LEAST_SIZE))
    assert list(covering_boxes(shapely.Polygon())) == []


@given(boxes, coordinates, coordinates, headings)
def test_a_placed_box_is_turned_and_moved_with_its_body(box, x, y, heading):
    moved = box_polygon(placed(box, x, y, heading))
    turned = shapely.affinity.rotate(
        box_polygon(box), heading, origin=(0, 0), use_radians=True
    )
    expected = shapely.affinity.translate(turned, x, y)
    # not by their overlay, which GEOS gets wrong for outlines that nearly coincide
    assert shapely.hausdorff_distance(moved, expected) < 1e-6
