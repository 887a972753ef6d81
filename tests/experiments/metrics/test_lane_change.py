"""Lane-change metrics on hand-made traces."""

import numpy as np
import pytest

from experiments.metrics.lane_change import (
    blockage,
    changed_before_blockage,
    lane_change_done,
    lane_change_time,
)
from experiments.trace.schema import Trace
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, STRAIGHT, cruising, record, trace_of

SPEED = 10.0
RAMP = np.linspace(0.0, 3.5, 41)  # 4 s
CHANGED = np.concatenate([np.zeros(20), RAMP, np.full(30, 3.5)])
REACH = CAR.centre_offset + CAR.length / 2.0  # rear axle to front bumper


def offsets_over_time(values, *bodies: PlacedBody) -> Trace:
    return trace_of(
        [
            record(k, CartesianState(STEP * SPEED * k, float(l), 0, 0, SPEED, 0))
            for k, l in enumerate(values)
        ],
        obstacles=obstacles_on_path(STRAIGHT, list(bodies)),
    )


def wall(s: float, l: float = 0.0, width: float = 2.6, **shape: float) -> PlacedBody:
    return PlacedBody("wall", s, l, length=10.0, width=width, **shape)


def test_a_lane_change_lasts_from_leaving_to_settling():
    trace = offsets_over_time(CHANGED)
    assert lane_change_time(trace) == pytest.approx(4.0, abs=0.3)
    assert lane_change_time(offsets_over_time(-CHANGED)) == lane_change_time(trace)
    # 2 s straight on, 4 s across; the last decimetre counts as settled
    assert lane_change_done(trace) == pytest.approx(6.0, abs=0.15)


def test_no_lane_change():
    aside = np.concatenate([np.zeros(20), 3.0 * np.sin(np.linspace(0, np.pi, 60))])
    begun = np.concatenate([np.zeros(20), RAMP])
    for trace in (offsets_over_time(aside), offsets_over_time(begun), cruising(50)):
        assert lane_change_time(trace) is None
        assert lane_change_done(trace) is None


def test_blockage_is_the_near_end_of_what_closes_the_own_lane():
    far, near = wall(90.0), wall(70.0)
    assert blockage(offsets_over_time(CHANGED, far, near)) == pytest.approx(65.0)
    turned = wall(70.0, heading=np.pi / 2.0)  # 10 m across, 2.6 m along
    assert blockage(offsets_over_time(CHANGED, turned)) == pytest.approx(68.7)


@pytest.mark.parametrize(
    "body",
    [
        wall(70.0, 3.5),  # in the other lane
        wall(70.0, 0.5),  # leaves room at its side
        wall(70.0, width=1.5),  # narrower than the ego
        wall(10.0),  # behind
    ],
)
def test_what_does_not_close_the_own_lane(body):
    ego = CartesianState(30.0, 0, 0, 0, SPEED, 0)
    bodies = obstacles_on_path(STRAIGHT, [body])
    trace = trace_of([record(0, ego)], obstacles=bodies)
    assert blockage(trace) is None
    assert changed_before_blockage(trace) is None


def test_blockage_on_a_bend_is_found_along_the_path():
    path = ReferencePath.from_segments([arc(150.0, 1.0 / 60.0)])
    x, y, heading = path.pose(0.0)
    ego = CartesianState(x, y, heading, 1.0 / 60.0, SPEED, 0.0)
    bodies = obstacles_on_path(path, [wall(80.0)])
    trace = trace_of([record(0, ego, path=path)], path=path, obstacles=bodies)
    assert blockage(trace) == pytest.approx(75.0, abs=0.01)


def test_in_time_is_in_the_other_lane_when_the_front_is_there():
    # the side of the wall is 1.3 m, that of the ego 0.95 m from its middle: 2.25 m
    # aside at t = 2 s + 4 s * 2.25 / 3.5
    place = SPEED * (2.0 + 4.0 * 2.25 / 3.5) + REACH
    in_time = offsets_over_time(CHANGED, wall(place + 2.0 + 5.0))
    late = offsets_over_time(CHANGED, wall(place - 2.0 + 5.0))
    assert changed_before_blockage(in_time) is True
    assert changed_before_blockage(late) is False


def test_who_never_came_to_the_blockage_did_not_change_before_it():
    waiting = offsets_over_time(np.zeros(20), wall(90.0))
    assert changed_before_blockage(waiting) is False
