import numpy as np
import pytest

from planner.reference_drivers import Regulation157
from planner.reference_drivers.driver import attentive
from planner.reference_drivers.regulation_157 import gap_at_wheel_intrusion
from tests.planner.reference_drivers.situations import situation


def test_bound_of_the_regulation():
    # 12 m/s / (2 · 6 m/s²) + 0.35 s
    assert Regulation157().least_time_to_collision(np.array([12.0]))[0] == 1.35


def test_reacts_at_the_bound_and_inside_only():
    driver = Regulation157(margin=0.0)
    # closing with 12 m/s: 1.35 s are 16.2 m
    seen = situation(gap=[16.1, 16.3, 16.1], lateral_gap=[0.5, 0.5, 0.51], speed=22.0)
    np.testing.assert_array_equal(driver.must_react(seen), [True, False, False])


def test_stops_wishing_once_its_centre_is_ahead():
    driver = Regulation157()
    state = attentive(1)
    assert driver.judge(situation(gap=-4.2), state).wish[0] == 6.0
    assert driver.judge(situation(gap=-4.4), state).wish[0] == 0.0


def test_half_a_metre_is_the_wheel_in_a_lane_of_three_and_a_half():
    assert gap_at_wheel_intrusion(3.5, 1.9) == pytest.approx(0.5)
    assert gap_at_wheel_intrusion(3.5, 1.9, tyre_inset=0.1) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("kmh", "gap"), [(60.0, 26.7), (10.0, 3.1), (5.0, 2.0), (0.0, 2.0)]
)
def test_following_gap_of_the_table(kmh, gap):
    assert Regulation157().following_gap(np.array([kmh / 3.6]))[0] == pytest.approx(
        gap, abs=0.06
    )
