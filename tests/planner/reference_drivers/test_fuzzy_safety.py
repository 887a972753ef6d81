import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.reference_drivers import FuzzySafety
from planner.reference_drivers.driver import attentive
from tests.planner.reference_drivers.situations import situation

FSM = FuzzySafety()
NO_BRAKE = np.zeros(1)


def test_proactive_grade_by_hand():
    # v 20, leader 10: safe 15 + 50 - 7.142857 + 2, unsafe 15 + 33.333333 - 7.142857
    safe, unsafe = 59.857143, 41.190476
    middle = 0.5 * (safe + unsafe) + 2.0
    seen = situation(gap=[safe + 2.01, middle, unsafe + 1.99])
    np.testing.assert_allclose(FSM.proactive(seen), [0.0, 0.5, 1.0], atol=1e-6)


def test_critical_grade_by_hand():
    # closing with 10: safe 7.5 + 100/8, unsafe 7.5 + 100/12
    seen = situation(gap=[20.01, 7.5 + 12.5 - 25.0 / 12.0, 15.8])
    np.testing.assert_allclose(
        FSM.critical(seen, np.zeros(3)), [0.0, 0.5, 1.0], atol=1e-6
    )


def test_critical_grade_while_braking():
    # a -4: reached 10 - 3 = 7, driven (10 - 1.5)·0.75 = 6.375; safe 12.5, unsafe 10.458
    seen = situation(gap=0.5 * (12.5 + 10.458333))
    assert FSM.critical(seen, np.array([4.0]))[0] == pytest.approx(0.5, abs=1e-6)
    # Harder braking counts as comfortable braking.
    assert FSM.critical(seen, np.array([7.0]))[0] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("gap", "grade"), [(0.49, 1.0), (0.51, 0.0)])
def test_slower_than_the_leader_before_the_response_time_is_over(gap, grade):
    # closing with 2 at -4: 2 - 3 < 0; 2²/8 = 0.5 m are driven
    seen = situation(gap=gap, speed=12.0)
    assert FSM.critical(seen, np.array([4.0]))[0] == grade


def test_nothing_is_critical_while_the_gap_grows():
    assert FSM.critical(situation(gap=0.1, speed=9.0), NO_BRAKE)[0] == 0.0


def test_lateral_filter_by_hand():
    # passing (11.4 + 8.6)/10 + 0.1 = 2.1 s; contact 1.05 m at 0.5 m/s = 2.1 s
    seen = situation(gap=11.4, lateral_gap=[1.06, 1.04], lateral_speed=0.5)
    np.testing.assert_array_equal(FSM.passes_before(seen), [True, False])


def test_wish_is_comfortable_until_the_situation_is_critical():
    wish = FSM.wished_deceleration(np.array([0.5, 1.0, 1.0]), np.array([0.0, 0.5, 1.0]))
    np.testing.assert_array_equal(wish, [2.0, 5.0, 6.0])


def test_drives_on_once_its_centre_is_ahead():
    wish = FSM.judge(situation(gap=[-4.2, -4.4]), attentive(2)).wish
    np.testing.assert_array_equal(wish > 0.0, [True, False])


@given(st.floats(1.0, 40.0))
def test_following_gap_is_the_least_without_a_wish(speed):
    gap = FSM.following_gap(np.array([speed]))[0]
    seen = situation(gap=[gap + 1e-6, gap - 1e-3], speed=speed, other_speed=speed)
    pfs = FSM.proactive(seen)
    assert pfs[0] == 0.0
    assert pfs[1] > 0.0
