"""Expected braking: more of it with less room, none with much."""

from hypothesis import given
from hypothesis import strategies as st

from planner.lane_change.gaps.reaction import HARDEST, expected_braking

speeds = st.floats(0.0, 30.0)
gaps = st.floats(0.0, 200.0)


@given(gaps, speeds, speeds, st.floats(0.0, 50.0), st.floats(0.0, 10.0))
def test_room_and_a_faster_leader_never_make_it_worse(gap, speed, leader, more, faster):
    braking = expected_braking(gap, speed, leader)
    assert 0.0 <= braking <= HARDEST
    assert expected_braking(gap + more, speed, leader) <= braking + 1e-9
    assert expected_braking(gap, speed, leader + faster) <= braking + 1e-9


def test_at_the_wished_gap_some_brake_and_far_ahead_hardly_anybody():
    assert 0.5 < expected_braking(20.0, 15.0, 15.0) < 3.0
    assert expected_braking(100.0, 15.0, 15.0) < 0.15
    assert expected_braking(5.0, 15.0, 5.0) == HARDEST
