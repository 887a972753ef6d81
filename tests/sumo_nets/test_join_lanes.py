import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo_nets.join_lanes import Piece, blend, densify, resample, stitch


def piece(points, left=5.0, right=-5.0, name="a"):
    points = np.array(points, dtype=float)
    count = len(points)
    return Piece(name, points, np.full(count, left), np.full(count, right), ())


def steps(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def largest_turn(points):
    heading = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    return np.abs(np.diff(heading)).max()


@given(
    st.lists(
        st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
        min_size=2,
        max_size=8,
        unique=True,
    ),
    st.floats(0.3, 5.0),
)
def test_densified_points_keep_the_corners_and_the_spacing(points, spacing):
    dense = densify(piece(points), spacing)
    assert steps(dense.points).max() <= spacing * (1.0 + 1e-6)
    assert steps(dense.points).sum() == pytest.approx(steps(np.array(points)).sum())
    for corner in points:
        assert np.abs(dense.points - corner).sum(axis=1).min() < 1e-9
    assert len(dense.left) == len(dense.right) == len(dense.points)


def test_overlapping_ends_do_not_turn_back():
    first = densify(piece([(0, 0), (20.0, 0)]), 1.0)
    second = densify(piece([(19.6, 0.05), (40, 0.05)], 4.0, -6.0), 1.0)
    line = stitch([first, second])
    assert np.all(np.diff(line.points[:, 0]) > 0.0)
    assert largest_turn(line.points) < 0.2
    np.testing.assert_array_equal(line.points[[0, -1]], [(0, 0), (40, 0.05)])
    assert line.ends == pytest.approx((20.0, 40.0), abs=0.02)


def test_jog_to_the_side_is_cut():
    first = densify(piece([(0, 0), (20.0, 0)]), 1.0)
    second = densify(piece([(20.0, 0.3), (40, 0.3)]), 1.0)
    assert largest_turn(stitch([first, second]).points) < 0.4


def test_a_pocket_closed_by_cleaning_leaves_no_double_point():
    points = [(0, 0), (1, 0), (1.4, 0), (1.0, 0), (2, 0), (3, 0)]
    line = stitch([piece(points)])
    assert steps(line.points).min() >= 0.2
    np.testing.assert_array_equal(line.points[:, 0], [0, 1, 2, 3])


def test_true_corner_of_a_road_stays():
    corner = [(0, 0), (10, 0), (10, 10)]
    line = stitch([densify(piece(corner), 1.0)])
    assert (line.points == (10.0, 0.0)).all(axis=1).any()


def test_pieces_end_where_the_next_one_begins():
    first = densify(piece([(0, 0), (7.0, 0)]), 1.0)
    tiny = piece([(7.0, 0), (7.1, 0)])
    last = densify(piece([(7.1, 0), (9.1, 0)]), 1.0)
    line = stitch([first, tiny, last])
    assert line.ends == pytest.approx((7.0, 7.1, 9.1))
    np.testing.assert_allclose(np.diff(line.s), steps(line.points))


def test_blend_moves_over_without_a_kink_and_takes_the_edges_along():
    first = densify(piece([(0, 0), (100, 0)], 8.0, -2.0, "a_0"), 1.0)
    second = piece([(0, 3), (100, 3)], 5.0, -5.0, "a_1")
    moved = blend(first, resample(second, 1.0, first), 1)
    assert moved.name == "a_1"
    np.testing.assert_allclose(moved.points[:26, 1], 0.0)
    np.testing.assert_allclose(moved.points[75:, 1], 3.0)
    # The edges of the road stay where they are while the line moves.
    np.testing.assert_allclose(moved.points[:, 1] + moved.left, 8.0)
    np.testing.assert_allclose(moved.points[:, 1] + moved.right, -2.0)
    # Steepest slope of the quintic: 15/8 of the mean.
    assert np.diff(moved.points[:, 1]).max() == pytest.approx(15 / 8 * 3 / 50, rel=1e-2)


def test_blend_is_cut_to_a_short_edge():
    first = densify(piece([(0, 0), (10, 0)]), 1.0)
    second = resample(piece([(0, 3), (10, 3)]), 1.0, first)
    moved = blend(first, second, 1)
    assert moved.points[0, 1] == 0.0
    assert moved.points[-1, 1] == pytest.approx(3.0)
