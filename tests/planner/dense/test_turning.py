"""Bounds of the curvature by the speed that is left."""

import numpy as np
import pytest

from planner.dense.turning import Momentum, Turning, curvature_bounds

AHEAD = np.linspace(0.0, 150.0, 301)


def test_a_path_bends_no_more_than_braking_leaves_drivable():
    turning = Turning(2.0, 1.5)
    bound = curvature_bounds(AHEAD, Momentum(14.0, 0.0), turning, 0.18)
    speed = np.sqrt(np.maximum(14.0**2 - 3.0 * AHEAD, 0.0))
    far = AHEAD > 14.0  # before it, the allowance for the curvature at present
    assert (speed[far] ** 2 * bound[far] <= 2.0 + 1e-9).all()
    assert bound[-1] == 0.18


def test_who_stands_is_bound_by_the_steering_alone():
    bound = curvature_bounds(AHEAD, Momentum(0.0, 0.0), Turning(2.0, 1.5), 0.18)
    assert bound == pytest.approx(0.18)


def test_the_present_curvature_has_time_to_fall():
    bound = curvature_bounds(AHEAD, Momentum(14.0, 0.03), Turning(2.0, 1.5), 0.18)
    assert bound[0] > 0.03
    assert bound[AHEAD > 14.0].min() < 0.014
