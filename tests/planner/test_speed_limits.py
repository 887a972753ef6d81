import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.speed_limits import brake_in_time, drive_along

STEP = 1.0
DISTANCE = STEP * np.arange(41)
speeds = arrays(np.float64, DISTANCE.size, elements=st.floats(0.0, 20.0))
rates = st.floats(0.5, 8.0)


@given(speeds, rates)
def test_braking_in_time_is_the_fastest_drive_below_the_limits(limits, braking):
    """Largest by definition: the least over all later points of what braking allows."""
    found = brake_in_time(DISTANCE, limits, braking)
    to_go = DISTANCE[None, :] - DISTANCE[:, None]
    reachable = np.sqrt(limits[None, :] ** 2 + 2.0 * braking * np.maximum(to_go, 0.0))
    expected = np.where(to_go >= 0.0, reachable, np.inf).min(axis=1)
    assert found == pytest.approx(expected, abs=1e-9)


@given(speeds, rates)
def test_braking_in_time_twice_changes_nothing(limits, braking):
    once = brake_in_time(DISTANCE, limits, braking)
    assert brake_in_time(DISTANCE, once, braking) == pytest.approx(once, abs=1e-9)


@given(speeds, st.floats(0.0, 20.0), rates, rates)
def test_a_drive_keeps_its_rates_and_never_goes_back(limits, speed, gain, braking):
    allowed = brake_in_time(DISTANCE, limits, braking)
    times = 0.1 * np.arange(80)
    s, v = drive_along(DISTANCE, allowed, speed, gain, braking, times)
    assert np.all(np.diff(s) >= -1e-12)
    assert np.all((s >= 0.0) & (s <= DISTANCE[-1]))
    assert np.all(v >= 0.0)
    on_road = s < DISTANCE[-1]
    rise = np.diff(v)
    assert np.all(rise <= gain * 0.1 + 1e-9)
    stops = v[1:] == 0.0
    assert np.all((rise >= -braking * 0.1 - 1e-3)[on_road[1:] & ~stops])
