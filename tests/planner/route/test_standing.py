"""Which family gets on faster is a matter of equal times."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.route.standing import gets_on_faster
from planner.states import Trajectory

STEP = 0.1


def motion(speed, acceleration, begin, horizon):
    """Cut a plan out of one motion: from `begin` on, `horizon` long."""
    t = np.arange(round(horizon / STEP) + 1) * STEP
    at = begin + t
    s = speed * at + 0.5 * acceleration * at**2
    nothing = np.zeros(t.size)
    return Trajectory(t, s, *(nothing,) * 5, s, nothing)


@given(st.floats(0.5, 15.0), st.floats(0.0, 2.0), st.floats(4.0, 7.0))
def test_the_same_motion_is_not_faster_however_far_it_is_planned(v, a, horizon):
    before, now = motion(v, a, 0.0, 5.0), motion(v, a, STEP, horizon)
    assert not gets_on_faster(now, before, STEP)


@given(st.floats(1.0, 15.0), st.floats(4.0, 7.0))
def test_a_tenth_faster_is(v, horizon):
    before, now = motion(v, 0.0, 0.0, 5.0), motion(1.1 * v, 0.0, 0.0, horizon)
    assert gets_on_faster(now, before, STEP)
    assert not gets_on_faster(before, motion(1.1 * v, 0.0, 0.0, 5.0), STEP)
