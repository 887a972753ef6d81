"""Times and gaps at a junction, against step-by-step integration and by hand."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.right_of_way.gaps import (
    EARLY_FOE,
    GENTLE,
    LATE_EGO,
    LATE_IN_A_HURRY,
    SLOW,
    START,
    START_IN_A_HURRY,
    counts,
    ego_interval,
    foe_interval,
    is_open,
    travel_time,
)
from planner.right_of_way.records import AtJunction, Foe, JunctionAhead, Rule

JUNCTION = JunctionAhead("j", Rule.MINOR, stop_s=100.0, exit_s=120.0, speed=8.0)
WAITING = AtJunction(99.0, 94.0, 0.0, 13.9, 3.0, 8.0)
FOE = Foe(
    junction=0,
    vehicle="foe",
    begin_s=103.0,
    end_s=109.0,
    entry=63.0,
    exit=75.0,
    to_line=60.0,
    speed=13.9,
    limit=13.9,
    turn_speed=13.9,
    road=200.0,
    merges=False,
    stood=0.0,
    goes_first=True,
    gives_way=False,
    held=False,
)


@given(
    st.floats(0.1, 200.0), st.floats(0.0, 20.0), st.floats(0.5, 4.0), st.floats(1, 30)
)
def test_travel_time_is_that_of_a_fine_integration(distance, speed, gain, highest):
    time, driven, step = 0.0, 0.0, 1e-3
    v = speed
    while driven < distance:
        faster = min(v + gain * step, max(highest, speed))
        driven += 0.5 * (v + faster) * step
        v = faster
        time += step
    assert travel_time(distance, speed, gain, highest) == pytest.approx(time, abs=2e-3)


def test_no_way_takes_no_time():
    assert travel_time(0.0, 0.0, 1.0, 10.0) == 0.0
    assert travel_time(-3.0, 5.0, 1.0, 10.0) == 0.0


def test_intervals_by_hand():
    # from a stand: 4 m early, 15 m late, both below 8 m/s
    early, late = ego_interval(WAITING, JUNCTION, FOE)
    assert early == pytest.approx(math.sqrt(2.0 * 4.0 / 2.0))
    assert late == pytest.approx(START + math.sqrt(2.0 * 15.0 / LATE_EGO))
    # at the limit already: constant speed
    assert foe_interval(FOE) == pytest.approx((63.0 / 13.9, 75.0 / 13.9))
    slow = FOE._replace(speed=5.0)
    ramp = (13.9 - 5.0) / EARLY_FOE
    covered = 0.5 * (5.0 + 13.9) * ramp
    arrives = ramp + (63.0 - covered) / 13.9
    assert foe_interval(slow) == pytest.approx((arrives, 15.0))


def test_a_foe_that_turns_arrives_later():
    turning = FOE._replace(turn_speed=6.0)
    assert foe_interval(turning)[0] > foe_interval(FOE)[0] + 1.0


def test_a_foe_on_a_road_before_keeps_the_limit_of_the_last_one():
    ring = FOE._replace(limit=8.0, turn_speed=8.0, road=20.0)
    assert foe_interval(ring)[0] == pytest.approx(40.0 / 13.9 + 23.0 / 8.0)


@given(st.floats(0.0, 150.0), st.floats(0.0, 20.0), st.floats(3.0, 20.0))
def test_a_turn_never_makes_a_foe_early(way, speed, turn):
    straight = FOE._replace(to_line=way, entry=way + 3.0, speed=speed, limit=20.0)
    straight = straight._replace(turn_speed=20.0)
    early, _ = foe_interval(straight)
    assert foe_interval(straight._replace(turn_speed=turn))[0] >= early - 1e-9


def test_gap_opens_with_distance_and_never_closes_again():
    def opens(way):
        return is_open(WAITING, JUNCTION, FOE._replace(to_line=way, entry=way + 3), 1.5)

    ways = [float(way) for way in range(1, 150)]
    found = [opens(way) for way in ways]
    assert not found[0]
    assert found[-1]
    assert found == sorted(found)
    # needs 5.6 s to leave and a gap of 1.5 s: 99 m at 13.9 m/s
    first = ways[found.index(True)]
    assert 90.0 < first < 100.0


def test_the_ego_passes_behind_a_foe_that_leaves():
    leaving = FOE._replace(to_line=-6.0, entry=-3.0, exit=4.0)
    far = WAITING._replace(front=60.0, rear=55.0)
    assert is_open(far, JUNCTION, leaving, 1.5)
    assert not is_open(WAITING._replace(front=102.5), JUNCTION, leaving, 1.5)
    stuck = leaving._replace(speed=0.0)
    assert not is_open(far, JUNCTION, stuck, 1.5)


@given(
    st.floats(5.0, 20.0), st.floats(0.0, 8.0), st.floats(3.0, 10.0), st.floats(0.5, 2.5)
)
def test_who_is_merged_before_brakes_gently_and_keeps_its_distance(
    fast, speed, through, gap
):
    """The nearest foe for which the gap is open, step by step."""
    junction = replace(JUNCTION, speed=through)
    ego = WAITING._replace(speed=speed, target_speed=13.9)

    def at(entry):
        foe = FOE._replace(to_line=entry - 3.0, entry=entry, speed=fast, limit=fast)
        return foe._replace(turn_speed=fast, merges=True)

    entry = next(way for way in range(4, 400) if is_open(ego, junction, at(way), gap))
    way = FOE.begin_s - ego.rear  # until the ego is in the lane of both
    time, step, own = (START if speed < SLOW else 0.0), 1e-3, min(speed, through)
    while way > 0.0:
        own = min(own + LATE_EGO * step, through)
        way -= own * step
        time += step
    apart = entry - fast * time  # from the other's front to where the ego's rear is
    braking = max(fast - own, 0.0) ** 2 / (2.0 * GENTLE)
    assert apart - braking >= gap * fast - 0.02 * fast
    if entry > 4:  # and no more than that: it is the nearest one, to a metre
        assert apart - braking <= gap * fast + 1.0 + 0.02 * fast


def test_a_merging_ego_needs_no_more_than_one_that_crosses():
    for way in range(1, 200):
        foe = FOE._replace(to_line=float(way), entry=way + 3.0, speed=8.0, limit=8.0)
        foe = foe._replace(turn_speed=8.0)
        if is_open(WAITING, JUNCTION, foe, 1.5):
            assert is_open(WAITING, JUNCTION, foe._replace(merges=True), 1.5)
            break


def test_who_counts():
    assert counts(FOE)
    assert not counts(FOE._replace(held=True))  # 21 m to stop, it has 60
    assert counts(FOE._replace(held=True, to_line=20.0, entry=23.0))
    assert counts(FOE._replace(stood=6.0, speed=0.0))  # it may set off
    assert not counts(FOE._replace(exit=-0.1))
    inside = FOE._replace(entry=-1.0, to_line=-4.0, goes_first=False)
    assert counts(inside)
    lower = FOE._replace(goes_first=False)
    assert not counts(lower)  # 21 m to stop, it has 63
    assert counts(lower._replace(entry=20.0))


def test_the_ego_does_not_enter_before_one_that_it_lets_go_first():
    # where ways meet 40 m behind its line the ego comes long after the other ...
    far = JunctionAhead("j", Rule.MINOR, stop_s=100.0, exit_s=150.0, speed=8.0)
    foe = FOE._replace(begin_s=140.0, end_s=150.0, entry=20.0, exit=32.0)
    early, _ = ego_interval(WAITING, far, foe)
    assert early > foe_interval(foe)[1] + 1.0
    # ... which brakes all the same for an ego that is in the junction before it
    assert not is_open(WAITING, far, foe, 2.0)
    assert is_open(WAITING, far, foe._replace(entry=-1.0, exit=11.0), 2.0)
    assert is_open(WAITING, far, foe._replace(goes_first=False), 2.0)
    entered = WAITING._replace(front=104.0, rear=99.0)
    assert is_open(entered, far, foe, 2.0)


def test_an_ego_in_a_hurry_counts_on_its_own_start():
    patient = ego_interval(WAITING, JUNCTION, FOE)
    hurried = ego_interval(WAITING, JUNCTION, FOE, hurry=1.0)
    assert hurried[0] == patient[0]
    way = FOE.end_s - WAITING.rear
    expected = START_IN_A_HURRY + travel_time(way, 0.0, LATE_IN_A_HURRY, 8.0)
    assert hurried[1] == pytest.approx(expected)
    assert hurried[1] < patient[1]
