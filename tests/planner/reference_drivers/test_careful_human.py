import math

import numpy as np
import pytest

from planner.reference_drivers import CarefulHuman
from planner.reference_drivers.careful_human import Trigger
from planner.reference_drivers.driver import attentive, react
from planner.reference_drivers.reaction import EMERGENCY_BRAKING, FULL_BRAKING
from tests.planner.reference_drivers.situations import situation


def judge(driver, seen):
    return driver.judge(seen, attentive(seen.gap.size))


def test_brakes_when_two_seconds_away_at_the_first_overlap():
    # closing with 10 m/s: 20 m are 2.0 s
    judgement = judge(CarefulHuman(), situation(gap=[19.9, 20.0, 20.1]))
    np.testing.assert_array_equal(judgement.wish, [FULL_BRAKING, FULL_BRAKING, 0.0])
    np.testing.assert_array_equal(judgement.dismissed, [False, False, True])


def test_judges_once():
    driver = CarefulHuman()
    state = react(driver, situation(gap=25.0), attentive(1), 0.1)  # 2.5 s: dismissed
    assert driver.judge(situation(gap=5.0), state).wish[0] == 0.0


def test_does_not_look_before_the_overlap():
    judgement = judge(CarefulHuman(), situation(gap=10.0, lateral_gap=0.01))
    assert judgement.wish[0] == 0.0
    assert not judgement.dismissed[0]


def test_drift_comes_before_the_overlap():
    # 1.6 m - (0.375 m + 0.72 m) = 0.505 m are left when the drift is a cut-in
    driver = CarefulHuman(trigger=Trigger.DRIFT)
    seen = situation(gap=10.0, lateral_gap=[0.51, 0.50])
    np.testing.assert_array_equal(judge(driver, seen).noticed, [False, True])


def test_a_leader_is_a_danger_once_the_gap_shrinks():
    driver = CarefulHuman(trigger=Trigger.CLOSING, critical_time=math.inf)
    seen = situation(gap=60.0, speed=20.0, other_speed=[20.0, 19.9])
    np.testing.assert_array_equal(judge(driver, seen).noticed, [False, True])


@pytest.mark.parametrize(
    ("lateral_gap", "gap", "acts"),
    [(-1.9, 14.9, True), (-1.8, 14.9, False), (-1.9, 15.1, False)],
)
def test_emergency_braking_needs_full_overlap_and_one_and_a_half_seconds(
    lateral_gap, gap, acts
):
    driver = CarefulHuman(emergency_braking=True)
    state = attentive(1)
    for _ in range(6):
        state = react(driver, situation(gap=gap, lateral_gap=lateral_gap), state, 0.1)
    expected = EMERGENCY_BRAKING if acts else 0.4
    assert state.deceleration[0] == pytest.approx(expected)


def test_follows_two_seconds_behind():
    assert CarefulHuman().following_gap(np.array([15.0]))[0] == 30.0
