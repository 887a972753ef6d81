import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.states import Trajectory
from planner.tracking.geometric import pure_pursuit, stanley
from planner.tracking.longitudinal import HOLDING, drive_command
from planner.tracking.reference import (
    ALONG,
    CURVATURE,
    HEADING,
    SPEED,
    T,
    errors_against,
    plan_table,
    value_at,
)


def on_arc(radius=50.0, speed=10.0, n=31, acceleration=0.0):
    t = 0.1 * np.arange(n)
    s = speed * t + 0.5 * acceleration * t**2
    angle = s / radius
    return Trajectory(
        t,
        radius * np.sin(angle),
        radius * (1.0 - np.cos(angle)),
        np.arctan2(np.sin(angle), np.cos(angle)),
        np.full(n, 1.0 / radius),
        speed + acceleration * t,
        np.full(n, acceleration),
        s,
        np.zeros(n),
    )


@given(
    at=st.floats(0.1, 2.8),
    left=st.floats(-2.0, 2.0),
    late=st.floats(-0.05, 0.05),
    turned=st.floats(-1.0, 1.0),
)
def test_errors_on_an_arc(at, left, late, turned):
    radius, speed = 50.0, 10.0
    plan = plan_table(on_arc(radius, speed))
    angle = speed * (at - late) / radius
    reach = radius - left
    pose = (
        reach * math.sin(angle),
        radius - reach * math.cos(angle),
        angle + turned + 2.0 * math.pi,
    )
    lateral, behind, heading, place = errors_against(plan, at, pose)
    assert lateral == pytest.approx(left, abs=4e-3)  # chords are 3 mm inside
    assert behind == pytest.approx(speed * late, abs=5e-3)
    assert heading == pytest.approx(turned, abs=1e-3)
    assert place == pytest.approx(radius * angle, abs=5e-3)


def test_beyond_the_ends_the_plan_goes_straight_on():
    plan = plan_table(on_arc(radius=1e9))
    for x in (-3.0, 33.0):
        lateral, behind, _, place = errors_against(plan, 1.0, (x, 0.5, 0.0))
        assert (lateral, place) == pytest.approx((0.5, x), abs=1e-5)
        assert behind == pytest.approx(10.0 - x)


def test_a_table_has_no_full_turns_and_interpolates():
    plan = plan_table(on_arc(radius=3.0, n=40))
    assert np.abs(np.diff(plan[HEADING])).max() < 0.4
    assert value_at(plan, T, SPEED, 0.25) == pytest.approx(10.0)
    assert value_at(plan, ALONG, CURVATURE, -5.0) == pytest.approx(1 / 3)
    assert value_at(plan, T, ALONG, 1e9) == plan[ALONG, -1]


def test_pure_pursuit_steers_on_the_arc_it_is_on():
    plan = plan_table(on_arc(radius=30.0))
    steering = pure_pursuit(plan, 0.0, (0.0, 0.0, 0.0), 2.8, 6.0)
    assert steering == pytest.approx(math.atan(2.8 / 30.0), rel=2e-3)


def test_stanley_steers_back():
    assert stanley(0.0, 0.0, 10.0, 2.8, 1.5) == 0.0
    assert stanley(0.5, 0.0, 10.0, 2.8, 1.5) == pytest.approx(-math.atan(0.75 / 11.0))
    assert stanley(0.0, 0.1, 10.0, 2.8, 1.5) < -0.1


def test_the_drive_asks_early_and_corrects():
    jerky = on_arc(radius=1e9)
    acceleration = np.where(jerky.t > 1.0, -2.0, 0.0)
    columns = {name: getattr(jerky, name) for name in Trajectory.__slots__}
    plan = plan_table(Trajectory(**(columns | {"acceleration": acceleration})))
    on_plan = (0.0, 10.0)
    assert drive_command(plan, 0.5, on_plan, 0.2, (0.6, 1.5)) == 0.0
    assert drive_command(plan, 0.95, on_plan, 0.2, (0.6, 1.5)) == pytest.approx(-2.0)
    late = drive_command(plan, 0.5, (1.0, 9.0), 0.2, (0.6, 1.5))
    assert late == pytest.approx(0.6 + 1.5)


def test_who_stands_is_held():
    standing = on_arc(radius=1e9, speed=0.0)
    plan = plan_table(standing)
    assert drive_command(plan, 0.5, (0.2, 0.0), 0.2, (0.6, 1.5)) == HOLDING
