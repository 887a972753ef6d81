import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.states import CartesianState
from planner.vehicle import Vehicle, VehicleLimits, single_track_rates


@given(
    length=st.floats(0.5, 20.0),
    width=st.floats(0.3, 3.0),
    overhang=st.floats(0.01, 4.0),
    along=st.floats(0.0, 1.0),
    across=st.floats(-0.5, 0.5),
)
def test_three_discs_cover_the_rectangle(length, width, overhang, along, across):
    assume(overhang + 0.1 * length < length)
    car = Vehicle(length, width, wheelbase=0.1 * length, rear_overhang=overhang)
    x, y = along * length - overhang, across * width
    gaps = [math.hypot(x - centre, y) for centre in car.disc_offsets]
    assert min(gaps) <= car.disc_radius + 1e-9


def test_discs_are_no_larger_than_the_corners_need():
    car = Vehicle()
    rear, _, front = car.disc_offsets
    corner = math.hypot(car.front_reach - front, car.width / 2)
    assert corner == pytest.approx(car.disc_radius)
    assert math.hypot(-car.rear_overhang - rear, car.width / 2) == pytest.approx(corner)


def test_reference_point_is_the_rear_axle():
    car = Vehicle(length=5.0, width=2.0, wheelbase=3.0, rear_overhang=0.9)
    assert car.front_reach == pytest.approx(4.1)
    assert car.centre_offset == pytest.approx(1.6)


@pytest.mark.parametrize("curvature", [0.1, -0.04, 0.0])
def test_single_track_drives_the_circle_of_its_steering_angle(curvature):
    car = Vehicle()
    speed, t, step = 7.0, 1.3, 1e-4

    def driven(time):
        """Pose after `time` on the circle through the origin along +x."""
        turn = curvature * speed * time
        if curvature == 0.0:
            return np.array([speed * time, 0.0, 0.0])
        return np.array(
            [math.sin(turn) / curvature, (1 - math.cos(turn)) / curvature, turn]
        )

    x, y, heading = driven(t)
    state = CartesianState(x, y, heading, curvature, speed, 0.0)
    rates = single_track_rates(state, car.steering_angle(curvature), car)
    expected = (driven(t + step) - driven(t - step)) / (2 * step)
    np.testing.assert_allclose(rates, expected, atol=1e-6)


def test_steering_angle_is_atan_of_wheelbase_over_radius():
    assert Vehicle(wheelbase=2.5).steering_angle(1 / 2.5) == pytest.approx(math.pi / 4)
    assert Vehicle().steering_angle(-0.1) == -Vehicle().steering_angle(0.1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Vehicle(width=0.0), "width = 0.0"),
        (lambda: Vehicle(length=math.nan), "length = nan"),
        (lambda: Vehicle(wheelbase=4.5), "rear_overhang \\+ wheelbase = 5.5"),
        (lambda: VehicleLimits(max_speed=-1.0), "max_speed = -1.0"),
        (lambda: VehicleLimits(max_deceleration=9.0), "emergency_deceleration = 8.0"),
    ],
)
def test_impossible_vehicles_are_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()
