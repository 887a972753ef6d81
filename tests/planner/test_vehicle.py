import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.states import CartesianState
from planner.vehicle import Vehicle, VehicleLimits, centre_from_rear_axle


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


@pytest.mark.parametrize("heading", [0.0, 2.0, -1.0])
def test_the_centre_is_ahead_of_the_rear_axle(heading):
    car = Vehicle(length=5.0, width=2.0, wheelbase=3.0, rear_overhang=0.9)
    ego = CartesianState(3.0, -1.0, heading, 0.0, 0.0, 0.0)
    x, y = centre_from_rear_axle(ego, car)
    assert x == pytest.approx(3.0 + 1.6 * math.cos(heading))
    assert y == pytest.approx(-1.0 + 1.6 * math.sin(heading))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Vehicle(width=0.0), "width is 0; allowed: positive"),
        (lambda: Vehicle(length=math.nan), "length is nan"),
        (
            lambda: Vehicle(wheelbase=4.5),
            r"wheelbase is 4.5; allowed: at most length - rear_overhang = 3.8",
        ),
        (lambda: VehicleLimits(max_speed=-1.0), "max_speed is -1"),
        (
            lambda: VehicleLimits(max_deceleration=9.0),
            "emergency_deceleration is 8; allowed: at least",
        ),
    ],
)
def test_impossible_vehicles_are_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()


@given(
    st.floats(3.0, 18.0), st.floats(1.5, 2.6), st.floats(-1.0, 1.0), st.floats(-1, 1)
)
def test_as_many_discs_as_a_long_body_takes_cover_it(length, width, along, across):
    car = Vehicle(length, width, 0.5 * length, 0.2 * length)
    centres, radius = car.disc_cover(0.3)
    x = car.centre_offset + 0.5 * along * length
    gaps = [math.hypot(x - centre, 0.5 * across * width) for centre in centres]
    assert min(gaps) <= radius + 1e-9
    assert radius <= 0.5 * width + 0.3


def test_a_car_is_covered_by_three_discs_and_a_lorry_by_more():
    car, lorry = Vehicle(), Vehicle(12.0, 2.5, 6.5, 3.0)
    assert car.disc_cover(0.3)[0] == pytest.approx(car.disc_offsets)
    assert lorry.disc_cover(0.3)[0].size > 5
