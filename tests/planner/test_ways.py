"""Predictions along ways, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InvalidInputError
from planner.prediction import constant_speed
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.ways import (
    FADE,
    NEXT_LANE,
    NO_WAY,
    SLOWING,
    TURNING,
    Ways,
    along_ways,
    nearest_on,
    point_on,
)
from tests.experiments.road_users import road_users

PATH = ReferencePath.from_segments([line(200.0)])
TIMES = 0.1 * np.arange(51)


def way(*corners):
    x, y = np.array(corners, dtype=np.float64).T
    s = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    return np.ascontiguousarray(np.vstack([s, x, y]))


def arc(radius, n=400):
    angle = np.linspace(0.0, np.pi, n)
    return way(*np.column_stack([radius * np.sin(angle), radius * (1 - np.cos(angle))]))


def predicted(users, ways, brake=False):  # noqa: FBT002
    plain = constant_speed(PATH, users, TIMES)
    return plain, along_ways(plain, PATH, users, ways, TIMES, brake=brake)


def one(*, stop=np.inf, number=0, lines=(), **car):
    users = road_users(
        ("a", car["x"], car["y"], car["heading"], car["speed"], 0.0),
        length=4.0,
        width=2.0,
    )
    return users, Ways(np.array([number]), np.array([stop]), tuple(lines))


def test_a_turn_is_driven_along_its_arc():
    users, ways = one(x=0.0, y=0.0, heading=0.0, speed=6.0, lines=[arc(20.0)])
    plain, turned = predicted(users, ways)
    angle = 6.0 * TIMES / 20.0
    # its middle is inside of the arc by 4²/(8 * 20) = 0.1 m
    assert turned.x[0] == pytest.approx(20.0 * np.sin(angle), abs=0.12)
    assert turned.y[0] == pytest.approx(20.0 * (1.0 - np.cos(angle)), abs=0.12)
    assert turned.heading[0][5:] == pytest.approx(angle[5:], abs=3e-2)
    assert np.abs(plain.y[0]).max() < 1e-9
    assert turned.l[0] == pytest.approx(turned.y[0], abs=1e-6)  # the path lies on y = 0


def test_a_long_vehicle_cuts_the_corner_with_both_ends_on_its_way():
    users, ways = one(x=0.0, y=0.0, heading=0.0, speed=6.0, lines=[arc(20.0)])
    lorry = replace(users, length=np.array([12.0]))
    _, turned = predicted(lorry, ways)
    assert (turned.x[0][0], turned.y[0][0]) == pytest.approx((0.0, 0.0), abs=1e-9)
    later = TIMES > FADE
    x, y, heading = turned.x[0][later], turned.y[0][later], turned.heading[0][later]
    for along in (-6.0, 6.0):
        end = x + along * np.cos(heading), y + along * np.sin(heading)
        assert np.hypot(end[0], end[1] - 20.0) == pytest.approx(20.0, abs=0.08)


def test_without_a_way_nothing_changes():
    users, ways = one(x=0.0, y=0.0, heading=0.0, speed=6.0, number=NO_WAY)
    plain, same = predicted(users, ways)
    assert same is plain


def test_a_vehicle_far_from_its_way_keeps_its_prediction():
    users, ways = one(
        x=0.0, y=9.0, heading=0.0, speed=6.0, lines=[way((0, 0), (50, 0))]
    )
    plain, same = predicted(users, ways)
    assert np.array_equal(plain.table, same.table)


def test_a_lane_change_ends_in_the_middle_of_the_next_lane():
    straight = way((0, 0), (500, 0))
    users, ways = one(x=10.0, y=1.0, heading=0.0, speed=8.0, lines=[straight])
    moving = replace(users, lateral_speed=np.array([0.8]))
    _, changed = predicted(moving, ways)
    assert changed.l[0][10] == pytest.approx(1.8)  # on, not back to its own lane
    assert changed.l[0][-1] == pytest.approx(NEXT_LANE)  # and no farther
    assert np.all(np.diff(changed.l[0]) >= -1e-12)


def test_a_lane_change_ends_in_the_lane_that_it_leads_to():
    straight = way((0, 0), (500, 0))
    users, ways = one(x=10.0, y=-1.2, heading=0.0, speed=8.0, lines=[straight])
    moving = replace(users, lateral_speed=np.array([0.8]))
    _, changed = predicted(moving, ways)
    assert changed.l[0][10] == pytest.approx(-0.4)
    assert changed.l[0][15:] == pytest.approx(0.0)


def test_one_that_changes_its_lane_before_a_turn_turns():
    bend = way((0, 0), (30, 0), (30, 60))
    users, ways = one(x=10.0, y=0.5, heading=0.0, speed=10.0, lines=[bend])
    moving = replace(users, lateral_speed=np.array([1.0]))
    plain, turned = predicted(moving, ways)
    assert turned.y[0][-1] > 20.0  # with the turn, not straight on beside the ego
    assert plain.y[0][-1] < 3.0


def test_one_that_waits_stands_at_its_line():
    straight = way((0, 0), (500, 0))
    users, ways = one(
        x=10.0, y=0.0, heading=0.0, speed=8.0, stop=12.0, lines=[straight]
    )
    _, stops = predicted(users, ways)
    assert stops.x[0][-1] == pytest.approx(22.0, abs=1e-6)
    assert np.all(np.diff(stops.x[0]) >= -1e-12)
    # even braking: 8²/(2 * 12) = 2.67 m/s², after 1 s 8 - 1.33 m
    assert stops.x[0][10] == pytest.approx(10.0 + 8.0 - 0.5 * 8.0 / 3.0)


def test_an_offset_fades():
    straight = way((0, 0), (500, 0))
    users, ways = one(x=10.0, y=1.0, heading=0.0, speed=8.0, lines=[straight])
    _, moved = predicted(users, ways)
    assert moved.y[0][0] == pytest.approx(1.0)
    assert moved.y[0][15] == pytest.approx(0.5)
    assert moved.y[0][-1] == pytest.approx(0.0)


def test_who_stands_aslant_between_two_lanes_stays_so_until_it_drives():
    straight = way((-50, 0), (200, 0))
    for speed in (0.0, 5.0):
        users, ways = one(x=0.0, y=-1.3, heading=0.5, speed=speed, lines=[straight])
        _, moved = predicted(users, ways)
        now, end = moved.heading[0][0], moved.heading[0][-1]
        assert (moved.x[0][0], moved.y[0][0]) == pytest.approx((0.0, -1.3))
        assert now == pytest.approx(0.5)
        assert end == pytest.approx(0.0 if speed else 0.5, abs=1e-6)
        assert moved.y[0][-1] == pytest.approx(0.0 if speed else -1.3, abs=1e-6)


def test_nearest_point_against_brute_force():
    rng = np.random.default_rng(0)
    corners = way(*np.cumsum(rng.normal(size=(30, 2)) * 3.0, axis=0))
    fine = np.array(
        [point_on(corners, at) for at in np.linspace(0, corners[0, -1], 9000)]
    )
    for place in rng.normal(size=(50, 2)) * 10.0:
        at, offset = nearest_on(corners, (place[0], place[1]))
        least = np.hypot(*(fine - place).T).min()
        assert abs(offset) == pytest.approx(least, abs=2e-2)
        assert np.hypot(*(np.array(point_on(corners, at)) - place)) == pytest.approx(
            abs(offset)
        )


def test_ways_must_exist():
    with pytest.raises(InvalidInputError, match="a way that exists"):
        Ways(np.array([0]), np.array([np.inf]), ())


def test_a_vehicle_slows_down_for_its_turn():
    bend = arc(10.0)
    begin = way((-60.0, 0.0), (0.0, 0.0))
    line = np.hstack([begin, bend[:, 1:] + [[60.0], [0.0], [0.0]]])
    users, ways = one(x=-50.0, y=0.0, heading=0.0, speed=14.0, lines=[line])
    _, slows = predicted(users, ways)
    step = np.hypot(np.diff(slows.x[0]), np.diff(slows.y[0])) / 0.1
    inside = slows.x[0][1:] > 5.0
    assert inside.any()
    assert step[inside].max() <= np.sqrt(TURNING * 10.0) * 1.03
    assert step[0] == pytest.approx(14.0)
    assert np.diff(step).min() >= -0.1 * 1.3 * SLOWING


def test_on_a_straight_way_nothing_slows_down():
    users, ways = one(
        x=10.0, y=0.0, heading=0.0, speed=14.0, lines=[way((0, 0), (500, 0))]
    )
    _, same = predicted(users, ways)
    assert same.x[0][-1] == pytest.approx(10.0 + 14.0 * TIMES[-1])
