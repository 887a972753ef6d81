"""Gaps of the lane beside: which, when, and what is never entered."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.lane_change.gaps.choice import choose_gaps
from planner.lane_change.phases.cycle_view import look
from planner.lane_change.phases.gap_safety import rss_distance
from planner.lane_change.settings import GapSettings, LaneChangeSettings
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.test_planner import wall
from tests.planner.scenes import Car

SETTINGS = LaneChangeSettings()
RULES = SETTINGS.gaps
SPEED = 14.0
BESIDE = 1.75  # offset of the lane beside [m]


def choose(cars, kept=None, room=400.0, **ego):
    scene = on_lanes(cars=cars, obstacles=wall(100.0 + room), **{"speed": SPEED, **ego})
    return choose_gaps(look(scene, SETTINGS), 0, (1,), kept, SETTINGS)


def ids(plan):
    return plan.ahead, plan.behind


def test_an_empty_lane_is_entered_at_once():
    (plan,) = choose([])
    assert ids(plan) == (None, None)
    assert plan.entry == 0.0
    assert plan.braking < 0.05  # of who comes from where sight ends


def test_who_is_not_seen_yet_may_come_behind_the_last_one():
    """A slow ego does not count on the road being empty beyond its sight."""
    row = [Car(40.0, BESIDE, SPEED), Car(-10.0, BESIDE, SPEED)]
    plans = {ids(plan): plan for plan in choose(row, speed=2.0)}
    assert plans[("car.1", None)].missing > 0.0
    near = LaneChangeSettings(gaps=GapSettings(sight=400.0))
    scene = on_lanes(cars=row, obstacles=wall(500.0), speed=2.0)
    seen = choose_gaps(look(scene, near), 0, (1,), None, near)
    last = next(plan for plan in seen if ids(plan) == ("car.1", None))
    assert last.missing == 0.0


def test_a_wide_gap_beside_is_entered_at_once_ahead_of_a_distant_car():
    best = choose([Car(140.0, BESIDE, SPEED), Car(30.0, BESIDE, SPEED)])[0]
    assert ids(best) == ("car.0", "car.1")
    assert best.entry == 0.0
    assert best.braking < 0.5


def test_between_cars_too_close_together_it_does_not_go_now():
    row = [Car(s, BESIDE, SPEED) for s in (120.0, 100.0, 80.0)]
    for plan in choose(row):
        assert plan.entry > 0.0 or plan.missing > 1.0
    assert choose(row)[0].behind is None  # rather behind all of them
    for plan in choose(row, room=90.0):  # before they have drawn apart
        between = {("car.0", "car.1"), ("car.1", "car.2")}
        assert plan.missing > 5.0 or ids(plan) not in between


def test_it_steps_down_to_the_gap_whose_follower_brakes_less():
    # a gap of 33 m beside and one of 75 m a little farther back
    row = [Car(s, BESIDE, SPEED) for s in (125.0, 87.0, 7.0)]
    best = choose(row)[0]
    assert ids(best) == ("car.1", "car.2")
    assert best.braking <= 1.0
    hurried = LaneChangeSettings(gaps=GapSettings(braking_weight=0.0, wait_weight=0.0))
    scene = on_lanes(cars=row, obstacles=wall(500.0), speed=SPEED)
    first = choose_gaps(look(scene, hurried), 0, (1,), None, hurried)[0]
    assert first.entry < best.entry or first.braking > best.braking


def test_the_next_best_gap_is_ready_and_the_kept_one_is_held_on_to():
    row = [Car(s, BESIDE, SPEED) for s in (150.0, 95.0, 40.0)]
    plans = choose(row)
    assert len(plans) >= 2
    assert plans[0].cost <= plans[1].cost
    apart = plans[1].cost - plans[0].cost
    again = choose(row, kept=plans[1].name)
    expected = plans[1] if apart < RULES.keep_gain else plans[0]
    assert again[0].name == expected.name


@settings(deadline=None, max_examples=100)
@given(
    st.floats(-90.0, 90.0),
    st.floats(0.0, 20.0),
    st.floats(0.0, 18.0),
    st.floats(30.0, 400.0),
)
def test_an_entry_now_is_safe_by_rss_where_the_body_crosses_the_line(
    place, pace, speed, room
):
    car = Car(100.0 + place, BESIDE, pace)
    vehicle = on_lanes().vehicle
    for plan in choose([car], room=room, speed=speed):
        assert np.all(np.diff(plan.distance) >= 0.0)
        assert plan.speed.min() >= 0.0
        assert plan.distance[0] == 0.0
        if plan.entry > 0.0 or plan.behind is None or plan.missing > 0.0:
            continue
        rear = 100.0 - vehicle.rear_overhang + RULES.line_time * speed
        gap = rear - (car.s + 0.5 * car.length + RULES.line_time * pace)
        need = rss_distance(
            np.array(pace),
            np.array(speed),
            RULES.reaction,
            SETTINGS.manoeuvre.rear_braking,
            RULES.promised_braking,
        )
        assert gap >= float(need) - 1e-9


def test_the_way_is_read_at_the_knots_of_a_speed_plan():
    best = choose([Car(125.0, BESIDE, SPEED), Car(87.0, BESIDE, SPEED)])[0]
    times = np.arange(0.0, 10.05, 0.1)
    driven, speed = best.at(times)
    assert driven[0] == 0.0
    assert speed[0] == pytest.approx(SPEED)
    np.testing.assert_allclose(driven[::5], best.distance[:21])
