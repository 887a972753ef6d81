import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.sumo import frames
from planner.numerics.angles import wrapped
from planner.states import CartesianState
from planner.vehicle import Vehicle, centre_from_rear_axle

coordinates = st.floats(-1e4, 1e4)
headings = st.floats(-math.pi, math.pi, exclude_min=True)
lengths = st.floats(0.5, 20.0)


@pytest.mark.parametrize(
    ("angle", "heading"),
    [(90.0, 0.0), (0.0, math.pi / 2), (180.0, -math.pi / 2), (270.0, math.pi)],
)
def test_compass_points(angle, heading):
    assert frames.heading_from_angle(angle) == pytest.approx(heading)
    assert frames.angle_from_heading(heading) == pytest.approx(angle)


@given(st.floats(-20.0, 20.0))
def test_angle_is_a_compass_reading(heading):
    angle = frames.angle_from_heading(heading)
    assert 0.0 <= angle < 360.0
    # sin and cos of a compass reading are the east and north parts of the direction.
    assert math.sin(math.radians(angle)) == pytest.approx(math.cos(heading), abs=1e-9)
    assert math.cos(math.radians(angle)) == pytest.approx(math.sin(heading), abs=1e-9)


@given(st.floats(-1e-300, 1e-300))
def test_angle_stays_below_a_full_turn_at_north(tiny):
    assert 0.0 <= frames.angle_from_heading(math.pi / 2 + tiny) < 360.0


@given(coordinates, coordinates, headings, lengths)
def test_centre_round_trip(x, y, heading, length):
    front_x = x + length / 2.0 * math.cos(heading)
    front_y = y + length / 2.0 * math.sin(heading)
    angle = frames.angle_from_heading(heading)
    front = np.array([[front_x, front_y, angle, 1.0, 2.0, 3.0, length, 4.0]])
    (centre,) = frames.centres_of(front).T
    assert centre[:2] == pytest.approx((x, y), abs=1e-9)
    assert abs(wrapped(centre[2] - heading)) < 1e-12
    assert centre[3:].tolist() == [1.0, 2.0, 3.0, length, 4.0]


@given(coordinates, coordinates, headings)
def test_rear_axle_round_trip(x, y, heading):
    vehicle = Vehicle()
    ego = CartesianState(x, y, heading, 0.0, 0.0, 0.0)
    pose = frames.front_from_rear_axle(ego, vehicle)
    back = frames.rear_axle_from_front(*pose, vehicle)
    assert back[0] == pytest.approx(x, abs=1e-9)
    assert back[1] == pytest.approx(y, abs=1e-9)
    assert abs(wrapped(back[2] - heading)) < 1e-12


@given(coordinates, coordinates, headings)
def test_centre_lies_between_the_bumpers(x, y, heading):
    vehicle = Vehicle()
    ego = CartesianState(x, y, heading, 0.0, 0.0, 0.0)
    front_x, front_y, _ = frames.front_from_rear_axle(ego, vehicle)
    rear_x = x - vehicle.rear_overhang * math.cos(heading)
    rear_y = y - vehicle.rear_overhang * math.sin(heading)
    centre = centre_from_rear_axle(ego, vehicle)
    assert centre[0] == pytest.approx((front_x + rear_x) / 2, abs=1e-9)
    assert centre[1] == pytest.approx((front_y + rear_y) / 2, abs=1e-9)


def test_many_are_many_single_ones():
    rng = np.random.default_rng(1)
    fronts = rng.uniform(0.0, 360.0, (20, 8))
    together = frames.centres_of(fronts)
    assert together.shape == (8, 20)
    for k, front in enumerate(fronts):
        assert frames.centres_of(front[None])[:, 0].tolist() == together[:, k].tolist()
    assert frames.centres_of(np.empty((0, 8))).shape == (8, 0)
