import numpy as np
import pytest

from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.road import LIMIT_BRAKING, LIMIT_LEAD, Road
from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import SpeedLimits

PATH = ReferencePath.from_segments([line(500.0)])
LIMITS = SpeedLimits(np.array([0.0, 200.0, 300.0]), np.array([13.89, 8.33, 16.67]))


def road(limits=LIMITS):
    return Road(PATH, constant_bounds(PATH, 5.0), speed_limits=limits)


def test_limit_holds_from_its_place_on_and_the_first_one_before_it():
    s = np.array([-5.0, 0.0, 199.9, 200.0, 299.0, 300.0, 900.0])
    expected = [13.89, 13.89, 13.89, 8.33, 8.33, 16.67, 16.67]
    np.testing.assert_array_equal(LIMITS.at(s), expected)


def test_road_without_limits_allows_any_speed():
    assert road(SpeedLimits.none()).allowed_speed(30.0, 12.0) == np.inf


@pytest.mark.parametrize("s", [0.0, 150.0, 170.0, 199.0, 250.0, 320.0])
def test_allowed_speed_brakes_in_time_before_a_lower_limit(s):
    speed = LIMITS.allowed(s, 1.5)
    at = np.arange(s, 500.0, 0.01)
    driven = np.sqrt(np.maximum(speed**2 - 2.0 * 1.5 * (at - s), 0.0))
    assert np.all(driven <= LIMITS.at(at) + 1e-3)
    faster = np.sqrt(np.maximum((speed + 0.05) ** 2 - 3.0 * (at - s), 0.0))
    assert np.any(faster > LIMITS.at(at))


def test_limit_of_the_whole_road_is_kept_to_the_last_bit():
    whole = SpeedLimits(np.zeros(1), np.array([13.89]))
    assert road(whole).allowed_speed(77.7, 13.2) == 13.89


def test_front_bumper_keeps_the_limit_here_and_the_lead_the_one_ahead():
    assert road().allowed_speed(200.0, 12.0) == 8.33
    assert road().allowed_speed(299.5, 8.33) == 8.33
    way = 200.0 - (170.0 + LIMIT_LEAD * 10.0)
    expected = np.sqrt(8.33**2 + 2.0 * LIMIT_BRAKING * way)
    assert road().allowed_speed(170.0, 10.0) == pytest.approx(expected)


def test_limits_out_of_order_or_without_speed_are_refused():
    with pytest.raises(InvalidInputError, match="must grow"):
        SpeedLimits(np.array([1.0, 1.0]), np.array([5.0, 6.0]))
    with pytest.raises(InvalidInputError, match="positive"):
        SpeedLimits(np.zeros(1), np.zeros(1))
