import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.reference_drivers import ResponsibilitySensitiveSafety
from planner.reference_drivers.driver import attentive
from tests.planner.reference_drivers.situations import situation

RSS = ResponsibilitySensitiveSafety()


def test_longitudinal_distance_by_hand():
    # 20·0.75 + 3·0.75²/2 + 22.25²/12 - 10²/12 = 15 + 0.84375 + 41.25521 - 8.33333
    distance = RSS.longitudinal_distance(np.array([20.0]), np.array([10.0]))
    assert distance[0] == pytest.approx(48.76563, abs=1e-5)


def test_lateral_distance_by_hand():
    # 0.3 + (1 + 1.75)·0.75/2 + 1.75²/2 = 0.3 + 1.03125 + 1.53125
    assert RSS.lateral_distance(np.array([1.0]))[0] == pytest.approx(2.8625)


def test_both_distances_must_be_violated():
    seen = situation(gap=[48.7, 48.8, 48.7], lateral_gap=[2.86, 2.86, 2.87])
    np.testing.assert_array_equal(RSS.is_dangerous(seen), [True, False, False])


def test_only_the_rear_vehicle_answers():
    seen = situation(gap=[-4.2, -4.4])
    wish = RSS.judge(seen, attentive(2)).wish
    np.testing.assert_array_equal(wish > 0.0, [True, False])


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0), st.floats(0.01, 5.0))
def test_distance_grows_with_the_rear_and_falls_with_the_front(rear, front, more):
    at = RSS.longitudinal_distance(
        np.array([rear, rear + more, rear]), np.array([front, front, front + more])
    )
    assert at[1] > at[0] > at[2]
