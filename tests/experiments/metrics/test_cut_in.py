"""Followers attributed to a lane change, by hand."""

import numpy as np
import pytest

from experiments.cosim.records import Ending, EpisodeStatus
from experiments.cosim.road import EgoTask, Road
from experiments.metrics.cut_in import (
    added_deceleration,
    attributed,
    cut_in,
    max_deceleration,
)
from experiments.metrics.without_ego import FAR_AHEAD, costs_ahead
from experiments.trace.recording import RunFacts, build_trace, vehicle_table
from planner.scene import Lanes, RoadBounds
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, STRAIGHT, record, traffic

LANES = Lanes(np.zeros(1), np.array([[0.0], [3.5]]), np.full((2, 1), 3.5))
N = 161
T = STEP * np.arange(N)
# 2 s in the lane, 4 s on the way over, then in the other lane
L = np.interp(T, [2.0, 6.0], [0.0, 3.5])
SPEED = 10.0
# the side of the body, 0.95 m from its middle, is over the line at 1.75 m after this
OVER = 2.0 + 4.0 * (1.75 - 0.95) / 3.5
WHOLLY = 2.0 + 4.0 * (1.75 + 0.95) / 3.5


def trace(cars, offsets=L, lanes=LANES):
    """`cars` gives (id, centre s, l, speed, acceleration) of each vehicle in a step."""
    bounds = RoadBounds(np.zeros(1), np.full(1, 5.25), np.full(1, -1.75))
    records = [
        record(
            k,
            CartesianState(100.0 + SPEED * t, float(l), 0.0, 0.0, SPEED, 0.0),
            cars=[(name, s, y, 0.0, v, a) for name, s, y, v, a in cars(k)],
        )
        for k, (t, l) in enumerate(zip(T, offsets, strict=True))
    ]
    return build_trace(
        RunFacts("s", "p", 0, STEP),
        Road(STRAIGHT, bounds, lanes),
        EgoTask(CAR, 900.0, SPEED),
        records,
        Ending(EpisodeStatus.ARRIVED, ""),
        [0.0] * N,
    )


def braking_at(*moments, behind=30.0):
    """Return a car behind, in the other lane, braking at moments [s], with 2, 3, ..."""

    def cars(k):
        rate = 0.0
        for number, moment in enumerate(moments):
            rate = -2.0 - number if abs(T[k] - moment) < 0.5 * STEP else rate
        return [("a", 100.0 + SPEED * T[k] - behind, 3.5, SPEED, rate)]

    return cars


def test_a_change_lasts_from_the_first_body_over_the_line():
    found = cut_in(trace(braking_at()))
    assert found.target == 1
    assert T[found.begin] == pytest.approx(OVER, abs=STEP)
    assert T[found.end] == pytest.approx(WHOLLY + 5.0, abs=STEP)


def test_coming_back_is_no_change_and_the_last_way_over_counts():
    back = np.interp(T, [1.0, 2.0, 3.0, 8.0, 10.0], [0.0, 1.5, 0.0, 0.0, 3.5])
    found = cut_in(trace(braking_at(), back))
    assert T[found.begin] > 8.0
    assert cut_in(trace(braking_at(), np.minimum(back, 1.5))) is None
    assert cut_in(trace(braking_at(), lanes=Lanes.none())) is None


def test_only_braking_during_the_change_and_5_s_after_counts():
    # 2 m/s² before, 3 m/s² in time, 4 m/s² too late
    cars = braking_at(OVER - 0.5, OVER + 1.0, WHOLLY + 5.5)
    assert max_deceleration(trace(cars)) == pytest.approx(3.0)
    early_and_late = braking_at(OVER - 0.5, WHOLLY + 5.5)
    assert max_deceleration(trace(early_and_late)) == 0.0


def test_the_nearest_vehicle_behind_in_the_new_lane_is_the_follower():
    def cars(k):
        place = 100.0 + SPEED * T[k]
        return [
            ("near", place - 20.0, 3.5, SPEED, -1.0),
            ("far", place - 50.0, 3.5, SPEED, -5.0),
            ("old lane", place - 15.0, 0.0, SPEED, -6.0),
            ("ahead", place + 20.0, 3.5, SPEED, -7.0),
        ]

    assert [one.id for one in attributed(trace(cars))] == ["near"]
    assert max_deceleration(trace(cars)) == pytest.approx(1.0)
    assert max_deceleration(trace(lambda _: [])) is None


def test_braking_that_would_have_been_anyway_is_not_added():
    driven = trace(braking_at(OVER - 0.5, OVER + 1.0))  # 3 m/s² in the change

    def without(rate):
        moments = []
        for k, t in enumerate(T):
            car = ("a", 70.0 + SPEED * t, 3.5, 0.0, SPEED, rate)
            moments.append((k, traffic(float(t), [car])))
        return vehicle_table(STRAIGHT, moments)

    assert added_deceleration(driven, without(0.0)) == pytest.approx(3.0)
    assert added_deceleration(driven, without(-1.0)) == pytest.approx(2.0)
    assert added_deceleration(driven, without(-4.0)) == 0.0
    assert added_deceleration(driven, None) is None


def test_far_ahead_is_always_far_ahead():
    def cars(k):
        place = 100.0 + CAR.centre_offset + SPEED * T[k]
        return [
            ("far", place + FAR_AHEAD + 1.0, 3.5, SPEED, 0.0),
            ("caught", place + FAR_AHEAD + 1.0 - T[k], 3.5, SPEED - 1.0, 0.0),
        ]

    seen = trace(cars)
    found = costs_ahead(seen, seen.vehicles)
    assert [cost.id for cost in found] == ["far"]
    assert found[0].delay == pytest.approx(0.0)
