from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.passage import BodiesAlongPath, room_beside
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Obstacles, RoadUsers

HALF_ROAD = 5.0
PATH = ReferencePath.from_segments([line(40.0), arc(60.0, 0.01), line(40.0)])
ROAD = constant_bounds(PATH, HALF_ROAD)
boxes = st.lists(
    st.tuples(st.floats(-4.5, 4.5), st.floats(0.2, 2.5)), min_size=1, max_size=5
)


def side_by_side(spans, s=50.0, stands=None):
    """Bodies of 2 m at one place, of (offset, width)."""
    l, width = np.array(spans).T
    n = l.size
    return BodiesAlongPath(
        tuple(f"body.{k}" for k in range(n)),
        np.full(n, s),
        l,
        np.ones(n),
        0.5 * width,
        np.ones(n, dtype=np.bool_) if stands is None else stands,
    )


def free_by_sampling(bodies, k):
    """Walk from a body to each side until something stands there, in 5 mm steps."""
    low, high = bodies.l - bodies.half_width, bodies.l + bodies.half_width
    found = []
    for side in (1.0, -1.0):
        at = bodies.l[k] + side * np.arange(0.0, 20.0, 0.005)
        taken = np.any((low[:, None] <= at) & (at <= high[:, None]), axis=0)
        begin = int(np.argmin(taken))  # beyond the body and what touches it
        ends = np.flatnonzero(taken[begin:] | (np.abs(at[begin:]) >= HALF_ROAD))
        found.append(0.005 * float(ends[0]))
    return found


def apart(spans):
    """Check that no two edges are so near that sampling or rounding decides."""
    edges = sorted(x for l, w in spans for x in (l - w / 2, l + w / 2))
    return all(b - a > 0.02 for a, b in pairwise(edges))


@given(boxes.filter(apart))
def test_the_room_is_what_one_finds_by_walking_to_both_sides(spans):
    bodies = side_by_side(spans)
    expected = free_by_sampling(bodies, 0)
    assert room_beside(bodies, 0, ROAD) == pytest.approx(expected, abs=0.011)


@given(boxes.filter(apart))
def test_the_mirror_image_has_the_room_on_the_other_side(spans):
    left, right = room_beside(side_by_side(spans), 0, ROAD)
    mirrored = side_by_side([(-l, w) for l, w in spans])
    assert room_beside(mirrored, 0, ROAD) == pytest.approx((right, left))


def test_what_moves_or_is_elsewhere_takes_no_room():
    spans = [(0.0, 2.0), (3.0, 1.0)]
    moving = side_by_side(spans, stands=np.array([True, False]))
    assert room_beside(moving, 0, ROAD) == pytest.approx((4.0, 4.0))
    assert room_beside(side_by_side(spans), 0, ROAD) == pytest.approx((1.5, 4.0))


@given(st.floats(5.0, 130.0), st.floats(-3.0, 3.0), st.floats(-3.2, 3.2))
def test_a_turned_body_is_as_long_and_as_wide_as_its_corners_reach(s, l, turned):
    x, y, heading = PATH.pose(s)
    x, y = x - l * np.sin(heading), y + l * np.cos(heading)
    row = [[x], [y], [heading + turned], [0.0], [0.0], [0.0], [4.8], [1.9]]
    users = RoadUsers.from_table(("car",), np.array(row))
    bodies = BodiesAlongPath.of(PATH, Obstacles.none(), users, 0.1)
    corners = np.array([[2.4, 0.95], [2.4, -0.95], [-2.4, 0.95], [-2.4, -0.95]])
    cos, sin = np.cos(turned), np.sin(turned)
    along = corners @ np.array([cos, -sin])
    across = corners @ np.array([sin, cos])
    assert bodies.s[0] == pytest.approx(s, abs=1e-3)
    assert bodies.l[0] == pytest.approx(l, abs=1e-3)
    assert bodies.half_length[0] == pytest.approx(along.max(), abs=1e-3)
    assert bodies.half_width[0] == pytest.approx(across.max(), abs=1e-3)
    assert bodies.stands.tolist() == [True]
