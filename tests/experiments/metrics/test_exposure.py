"""TET, DRAC, PET and TTC to obstacles, by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.metrics import exposure
from experiments.metrics.exposure import (
    max_drac,
    min_post_encroachment_time,
    time_exposed_ttc,
)
from experiments.metrics.static_bodies import min_static_time_to_collision
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from planner.shapes.rectangles import Rectangle, distance
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, STRAIGHT, record, trace_of

FRONT = CAR.length / 2.0  # from the centre, in which the places below are given [m]


def ego_at(k, speed=10.0, l=0.0):
    return CartesianState(speed * STEP * k - CAR.centre_offset, l, 0.0, 0.0, speed, 0.0)


def drive(n, car, speed=10.0):
    """Return a trace; `car` gives (centre s, l, heading, speed) in each step."""
    return trace_of(
        [
            record(k, ego_at(k, speed), cars=[("a", *car(k), 0.0)] if car(k) else [])
            for k in range(n)
        ]
    )


def test_drac_is_half_the_square_of_the_closing_speed_over_the_gap():
    # gap 45.6 m (lengths 4.8 and 4), closing 6 m/s: 36 / 91.2
    trace = drive(1, lambda _: (50.0, 0.0, 0.0, 4.0))
    assert max_drac(trace) == pytest.approx(36.0 / (2.0 * 45.6))
    assert max_drac(drive(1, lambda _: (50.0, 0.0, 0.0, 12.0))) == 0.0
    assert max_drac(drive(1, lambda _: (50.0, 3.5, 0.0, 4.0))) is None


def test_time_exposed_counts_the_steps_below_three_seconds():
    # gap 20.7 m less 0.5 m a step, closing 5 m/s: below 3 s from k = 12 on
    def slower(k):
        return (20.7 + FRONT + 2.0 + 0.5 * k, 0.0, 0.0, 5.0)

    assert time_exposed_ttc(drive(20, slower)) == pytest.approx(8 * STEP)
    assert time_exposed_ttc(drive(5, slower)) == 0.0
    assert time_exposed_ttc(drive(5, lambda _: None)) is None


def test_post_encroachment_of_a_follower_is_its_gap_in_time():
    # 20 m from bumper to bumper at 10 m/s
    def follower(k):
        return (1.0 * k - 20.0 - FRONT - 2.0, 0.0, 0.0, 10.0)

    found = min_post_encroachment_time(drive(60, follower))
    assert found == pytest.approx(2.0, abs=0.11)


def test_post_encroachment_of_a_crossing_car():
    # the car, 2 m wide about s = 20, comes from the right with 10 m/s, its front at
    # l = -0.95 at 3 s. The last place both cover: cell s = 20.75, l = -0.75
    def crossing(k):
        return (20.0, 10.0 * (STEP * k - 3.0) - 0.95 - 2.0, math.pi / 2.0, 10.0)

    found = min_post_encroachment_time(drive(60, crossing))
    left, comes = (20.75 + FRONT) / 10.0, 3.0 + 0.02
    assert found == pytest.approx(comes - left, abs=0.11)


def test_no_post_encroachment_without_a_shared_place():
    beside = drive(40, lambda k: (1.0 * k - 20.0, 3.5, 0.0, 10.0))
    assert min_post_encroachment_time(beside) is None
    late = drive(90, lambda k: (1.0 * k - 70.0, 0.0, 0.0, 10.0))
    assert min_post_encroachment_time(late) is None
    assert min_post_encroachment_time(drive(5, lambda _: None)) is None


def test_overlap_is_no_time_at_all():
    assert min_post_encroachment_time(drive(1, lambda _: (1.0, 0.0, 0.0, 10.0))) == 0.0


@given(
    start=st.floats(-40.0, 60.0),
    speed=st.floats(-12.0, 18.0),
    l=st.floats(-8.0, 8.0),
    drift=st.floats(-3.0, 3.0),
    heading=st.floats(-math.pi, math.pi),
)
def test_post_encroachment_looks_at_all_that_counts(start, speed, l, drift, heading):
    def car(k):
        return (start + speed * STEP * k, l + drift * STEP * k, heading, abs(speed))

    trace = drive(90, car)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            exposure, "_near_in_time", lambda _, cars, __: np.isfinite(cars.s)
        )
        every = exposure.closest_encroachment(trace)
    assert exposure.closest_encroachment(trace) == every


def with_obstacle(body, speed=10.0, l=0.0):
    obstacles = obstacles_on_path(STRAIGHT, [body])
    return trace_of([record(0, ego_at(0, speed, l))], obstacles=obstacles)


@pytest.mark.parametrize(
    ("body", "time"),
    [
        (PlacedBody("b", 50.0, 0.0, 4.0, 2.0), (50.0 - 2.0 - FRONT) / 10.0),
        (PlacedBody("b", 50.0, 0.0, radius=1.5), (50.0 - 1.5 - FRONT) / 10.0),
        # a disc beside: its centre 1 m outside the ego's side, radius 1.25: touched by
        # the front corner when its centre is 0.75 m ahead of it (3-4-5)
        (PlacedBody("b", 50.0, 0.95 + 1.0, radius=1.25), (50.0 - 0.75 - FRONT) / 10.0),
        (PlacedBody("b", 50.0, 0.95 + 1.3, radius=1.25), None),
        (PlacedBody("b", 120.0, 0.0, radius=1.0), None),  # beyond 10 s
        (PlacedBody("b", 50.0, 2.0, 4.0, 2.0), None),  # beside
    ],
)
def test_time_to_what_stands(body, time):
    found = min_static_time_to_collision(with_obstacle(body))
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))


@given(s=st.floats(6.0, 60.0), l=st.floats(-4.0, 4.0), radius=st.floats(0.2, 2.0))
def test_time_to_a_disc_agrees_with_brute_force(s, l, radius):
    found = min_static_time_to_collision(
        with_obstacle(PlacedBody("b", s, l, radius=radius))
    )
    disc = Rectangle(s, l, 0.0, 0.0, 0.0, radius)
    times = np.linspace(0.0, 8.0, 801)
    gaps = [
        distance(Rectangle(10.0 * t, 0.0, 0.0, CAR.length, CAR.width), disc)
        for t in times
    ]
    touching = np.flatnonzero(np.array(gaps) <= 0.0)
    if touching.size:
        assert found == pytest.approx(times[touching[0]], abs=0.011)
    else:
        assert found is None or min(gaps) < 0.05
