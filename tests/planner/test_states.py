import math
import re
from dataclasses import fields, replace

import numpy as np
import pytest

from planner.errors import InvalidInputError
from planner.states import (
    CartesianState,
    CartesianStates,
    FrenetStates,
    Path,
    SpeedProfile,
    Trajectory,
    freeze,
    read_only,
    with_floats,
)


def trajectory(heading=None):
    t = np.array([0.0, 0.1, 0.3, 0.6])
    return Trajectory(
        t,
        10.0 * t,
        -2.0 * t,
        0.5 * t if heading is None else heading,
        0.01 * t,
        10.0 + t,
        1.0 - t,
        10.0 * t,
        0.1 * t,
    )


def test_freeze_copies_and_locks():
    source = np.array([1, 2, 3])
    frozen = freeze(source)
    source[0] = 9
    assert frozen.tolist() == [1.0, 2.0, 3.0]
    assert frozen.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        frozen[0] = 0.0


@pytest.mark.parametrize(("record", "n"), [(CartesianStates, 6), (FrenetStates, 8)])
def test_batches_share_one_shape(record, n):
    assert record(*[np.zeros((2, 3))] * n).__slots__
    with pytest.raises(InvalidInputError, match="one shape"):
        record(*[np.zeros(3)] * (n - 1), np.zeros(4))


def test_trajectory_returns_its_samples_untouched():
    samples = trajectory()
    for k, t in enumerate(samples.t):
        state = samples.at(float(t))
        assert state.x == samples.x[k]
        assert state.acceleration == samples.acceleration[k]
        assert state.heading == samples.heading[k]


def test_trajectory_is_linear_between_samples():
    state = trajectory().at(0.2)
    assert (state.x, state.y) == pytest.approx((2.0, -0.4))
    assert state.heading == pytest.approx(0.1)
    assert state.speed == pytest.approx(10.2)


def test_trajectory_is_held_at_both_ends():
    samples = trajectory()
    assert samples.at(-1.0).x == samples.x[0]
    assert samples.at(9.0).x == samples.x[-1]
    assert samples.duration == pytest.approx(0.6)


def test_heading_is_interpolated_the_shorter_way():
    state = trajectory(np.array([3.0, 3.1, -3.1, -3.0])).at(0.2)
    assert abs(state.heading) == pytest.approx(math.pi)


@pytest.mark.parametrize("t", [[0.0], [0.0, 0.0], [0.0, 0.2, 0.1], [[0.0, 1.0]]])
def test_times_must_grow(t):
    columns = [np.zeros(np.shape(t))] * 8
    with pytest.raises(InvalidInputError, match="growing"):
        Trajectory(np.array(t), *columns)


def test_finiteness_covers_every_column():
    samples = trajectory()
    assert samples.is_finite()
    assert not replace(samples, l=[0.0, 0.0, math.nan, 0.0]).is_finite()


def test_a_trajectory_of_one_table_is_that_of_its_columns():
    rows = np.arange(45.0).reshape(9, 5)
    made, same = Trajectory.from_rows(rows), Trajectory(*rows)
    for name in Trajectory.__slots__:
        np.testing.assert_array_equal(getattr(made, name), getattr(same, name))
        assert not getattr(made, name).flags.writeable
    rows[1] = 0.0
    assert made.x[1] == 6.0
    rows[0, 3] = rows[0, 2]
    with pytest.raises(InvalidInputError):
        Trajectory.from_rows(rows)


@pytest.mark.parametrize(("record", "n"), [(Path, 7), (SpeedProfile, 5)])
def test_a_record_of_one_table_is_that_of_its_columns(record, n):
    rows = np.arange(n * 4.0).reshape(n, 4)
    made, columns = record.from_rows(rows), record(*rows)
    rows[:] = 7.0  # the table was copied
    for name in record.__slots__:
        column = getattr(made, name)
        np.testing.assert_array_equal(column, getattr(columns, name))
        assert not column.flags.writeable
    with pytest.raises(InvalidInputError, match="growing"):
        record.from_rows(np.zeros((n, 4)))


def test_whole_numbers_of_a_state_become_floats():
    state = CartesianState(1, 2.0, 0.0, 0.0, np.float64(3.0), 0.0)
    assert type(with_floats(state).x) is float
    floats = CartesianState(1.0, 2.0, 0.0, 0.0, 3.0, 0.0)
    assert with_floats(floats) is floats


def test_a_class_derived_from_a_state_is_one():
    class Named(CartesianState):
        """Of a user."""

    state = with_floats(Named(1, 2, 0, 0, 3, 0))
    assert type(state) is Named
    assert state.speed == 3.0


def test_kernels_see_one_order_of_elements_and_one_kind_of_array():
    """Each other one would be compiled anew."""
    assert freeze(np.ones((2, 3)).T).flags.c_contiguous
    mine = np.ones(3)
    view = read_only(mine)
    assert not view.flags.writeable
    assert mine.flags.writeable
    assert np.shares_memory(view, mine)


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        (np.array([1.0 + 2.0j, 0.0]), "x holds complex128; must be real numbers"),
        ([1j, 2.0], "x holds complex128; must be real numbers"),
        (["1.0", "2.0"], "x holds <U3; must be real numbers"),
        (np.array(["a", None], dtype=object), "x must be real numbers"),
        ([[1.0], [1.0, 2.0]], "x must be real numbers"),
    ],
)
def test_what_is_no_real_number_is_named(values, problem):
    columns = {one.name: np.zeros(2) for one in fields(Trajectory)}
    columns |= {"t": np.array([0.0, 1.0]), "x": values}
    with pytest.raises(InvalidInputError, match=re.escape(problem)):
        Trajectory(**columns)


def test_whole_numbers_and_objects_that_are_numbers_are_taken():
    columns = {one.name: np.zeros(2) for one in fields(Trajectory)}
    columns |= {"t": [0, 1], "x": np.array([1, 2.5], dtype=object), "y": [True, False]}
    made = Trajectory(**columns)
    assert made.x.tolist() == [1.0, 2.5]
    assert made.y.dtype == np.float64
