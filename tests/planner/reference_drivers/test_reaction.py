import numpy as np
import pytest

from planner.errors import InvalidInputError
from planner.reference_drivers import (
    CarefulHuman,
    Regulation157,
    ResponsibilitySensitiveSafety,
)
from planner.reference_drivers.driver import attentive, react
from planner.reference_drivers.reaction import FULL_BRAKING, Reaction
from tests.planner.reference_drivers.situations import situation


def stopping_distance(driver, speed, step_s):
    state = attentive(1)
    driven = 0.0
    while speed > 0.0:
        state = react(driver, situation(gap=1.0, speed=speed), state, step_s)
        speed -= state.deceleration[0] * step_s
        driven += (speed + 0.5 * state.deceleration[0] * step_s) * step_s
    return driven


@pytest.mark.parametrize(("kmh", "published"), [(60.0, 35.7), (130.0, 123.7)])
def test_stopping_distance_without_coasting_is_the_published_one(kmh, published):
    # 0.75 s at full speed, 0.6 s of growing deceleration, then 0.774 g
    driver = CarefulHuman(reaction=Reaction())
    assert stopping_distance(driver, kmh / 3.6, 1e-3) == pytest.approx(
        published, abs=0.05
    )


def test_coasting_shortens_the_stop():
    braked = stopping_distance(CarefulHuman(reaction=Reaction()), 20.0, 0.1)
    assert stopping_distance(CarefulHuman(), 20.0, 0.1) < braked


def test_deceleration_follows_delay_coasting_and_jerk():
    driver = CarefulHuman()
    state = attentive(1)
    decelerations = []
    for _ in range(15):
        state = react(driver, situation(gap=10.0), state, 0.1)
        decelerations.append(state.deceleration[0])
    # The eighth step ends 0.75 s; then 1.265 m/s² more in each step.
    np.testing.assert_allclose(decelerations[:8], 0.4)
    np.testing.assert_allclose(decelerations[8:13], 0.4 + 1.265 * np.arange(1, 6))
    np.testing.assert_allclose(decelerations[13:], FULL_BRAKING)


def test_between_two_dangers_speed_and_brake_are_held():
    driver = ResponsibilitySensitiveSafety()
    state = attentive(1)
    decelerations = []
    for gap in [1.0] * 10 + [500.0] * 3 + [1.0] * 2:
        state = react(driver, situation(gap=gap), state, 0.1)
        decelerations.append(state.deceleration[0])
    np.testing.assert_allclose(decelerations[8:10], [1.265, 2.53])
    np.testing.assert_allclose(decelerations[10:13], 0.0)
    np.testing.assert_allclose(decelerations[13:], [3.795, 5.06])  # no delay again


def test_the_regulation_brakes_at_once_after_four_steps():
    driver = Regulation157()
    state = attentive(1)
    decelerations = []
    for _ in range(6):
        state = react(driver, situation(gap=5.0), state, 0.1)
        decelerations.append(state.deceleration[0])
    assert decelerations == [0.0, 0.0, 0.0, 0.0, 6.0, 6.0]


def test_negative_numbers_are_refused():
    with pytest.raises(InvalidInputError, match="delay_s=-1"):
        Reaction(delay_s=-1.0)
