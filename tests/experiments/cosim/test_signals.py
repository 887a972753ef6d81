import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.records import Signal
from experiments.cosim.signals import OVERSHOOT, closed_stop_lines
from planner.vehicle import VehicleLimits

LIMITS = VehicleLimits(emergency_deceleration=8.0)


def closed(state: str, stop_s: float, front_s: float, speed: float) -> bool:
    lines = closed_stop_lines([Signal("light", stop_s, state)], front_s, speed, LIMITS)
    assert lines in ((), (stop_s,))
    return bool(lines)


@pytest.mark.parametrize("state", list("GgoOMms"))
def test_open_letters(state):
    assert not closed(state, 100.0, 90.0, 1.0)


@pytest.mark.parametrize("state", list("ruy"))
def test_closed_letters_far_away(state):
    assert closed(state, 100.0, 0.0, 10.0)


def test_yellow_asks_for_comfortable_braking_only():
    # v² / 2b: 12 m/s need 24 m comfortably, 9 m in an emergency.
    assert closed("y", 100.0, 75.9, 12.0)
    assert not closed("y", 100.0, 76.4, 12.0)
    assert closed("r", 100.0, 90.9, 12.0)
    assert not closed("r", 100.0, 91.4, 12.0)


def test_lines_behind_the_bumper_are_gone():
    assert not closed("r", 100.0, 100.0 + OVERSHOOT + 0.01, 0.0)


def test_who_stopped_on_the_line_still_waits():
    assert closed("r", 100.0, 100.0 + OVERSHOOT / 2.0, 0.0)
    assert not closed("r", 100.0, 100.0 + OVERSHOOT / 2.0, 3.0)


@given(st.floats(0.0, 120.0), st.floats(0.0, 25.0), st.floats(0.0, 5.0))
def test_yellow_once_open_stays_open_while_driving_on(front_s, speed, driven):
    if not closed("y", 100.0, front_s, speed):
        assert not closed("y", 100.0, front_s + driven, speed)


@given(st.floats(0.0, 120.0), st.floats(0.0, 25.0))
def test_red_holds_whenever_yellow_does(front_s, speed):
    if closed("y", 100.0, front_s, speed):
        assert closed("r", 100.0, front_s, speed)


def test_lines_come_in_the_order_of_travel():
    lights = [Signal("b", 80.0, "r"), Signal("a", 40.0, "y"), Signal("c", 60.0, "G")]
    assert closed_stop_lines(lights, 0.0, 5.0, LIMITS) == (40.0, 80.0)


def test_yellow_that_held_holds_as_long_as_service_braking_does():
    light = [Signal("light", 100.0, "y")]
    # 12 m/s need 24 m comfortably, 16 m in service: a planner that brakes late
    assert closed_stop_lines(light, 80.0, 12.0, LIMITS) == ()
    assert closed_stop_lines(light, 80.0, 12.0, LIMITS, (100.0,)) == (100.0,)
    assert closed_stop_lines(light, 86.0, 12.0, LIMITS, (100.0,)) == ()
