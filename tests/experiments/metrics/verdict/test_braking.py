"""Verdicts of hard braking: made-up motions with a known answer."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.metrics import columns
from experiments.metrics.events import EventKind, events
from experiments.metrics.moments import moments
from experiments.metrics.row import metric_row
from experiments.metrics.verdict.braking import braking_verdicts, hardest_braking
from experiments.metrics.verdict.records import Fault
from planner.scene import Obstacles
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, record, trace_of

STEPS = 80
BRAKES = 5.0  # [m/s²]
START = 100.0  # of the ego [m]
LANE = 3.5


def motion(x, speed, brakes_at=None, until=STEPS, l=None):
    """Return x, y, speed and acceleration of each step."""
    return motion_braking(
        x, speed, [] if brakes_at is None else [(brakes_at, until)], l
    )


def motion_braking(x, speed, spans, l=None, steps=STEPS):
    """Return the same of one that brakes from a step to another, several times."""
    rows = []
    for k in range(steps):
        braking = any(first <= k < until for first, until in spans) and speed > 0.0
        rate = -BRAKES if braking else 0.0
        rows.append((x, 0.0 if l is None else l(k), speed, rate))
        x += speed * STEP + 0.5 * rate * STEP**2
        speed = max(speed + rate * STEP, 0.0)
    return rows


def changes_lane(at, lasts=15):
    """Return an offset over steps: from the lane to the left into the ego's."""
    return lambda k: LANE * (1.0 - min(max((k - at) / lasts, 0.0), 1.0))


def drive(ego, *, obstacles=None, **cars):
    records = []
    for k, (x, y, speed, rate) in enumerate(ego):
        state = CartesianState(x, y, 0.0, 0.0, speed, rate)
        others = tuple(
            (name, rows[k][0], rows[k][1], 0.0, rows[k][2], rows[k][3])
            for name, rows in cars.items()
        )
        records.append(record(k, state, cars=others))
    return trace_of(records, obstacles=obstacles)


def test_nobody_brakes_hard():
    trace = drive(motion(START, 15.0), other=motion(START + 50.0, 15.0))
    assert braking_verdicts(trace) == []
    row = metric_row(trace)
    assert row[columns.HARD_BRAKING_VERDICT] is None
    assert row[columns.HARD_BRAKINGS_CAUSED] == 0


def test_who_cuts_in_closely_is_at_fault_for_the_ego_that_brakes():
    other = motion(START + 31.0, 9.0, l=changes_lane(20))
    found = hardest_braking(drive(motion(START, 15.0, 32), other=other))
    assert found.fault is Fault.OTHER
    assert "moves into the way" in found.why
    assert found.cause == "other"


def test_who_was_ahead_all_the_time_is_not():
    other = motion(START + 40.0, 8.0)
    found = hardest_braking(drive(motion(START, 15.0, 30), other=other))
    assert found.fault is Fault.EGO
    assert "too fast" in found.why


def test_who_brakes_hard_ahead_is():
    other = motion(START + 30.0, 15.0, brakes_at=30)
    found = hardest_braking(drive(motion(START, 15.0, 36), other=other))
    assert found.fault is Fault.OTHER
    assert "brakes hard ahead" in found.why


def test_a_far_slow_one_that_moved_in_long_ago_is_not():
    other = motion(START + 60.0, 9.0, l=changes_lane(0))
    found = hardest_braking(drive(motion(START, 15.0, 60), other=other))
    assert found.fault is Fault.EGO


def test_braking_for_nothing_is_ones_own_doing():
    found = hardest_braking(drive(motion(START, 15.0, 30)))
    assert found.fault is Fault.EGO
    assert found.cause == ""


@pytest.mark.parametrize(
    ("closes_at", "fault", "why"),
    [
        (30, Fault.UNAVOIDABLE, "brakes for a line that closed before it"),
        (0, Fault.EGO, "brakes late for a closed line"),
    ],
)
def test_a_line_that_closes_too_near_is_nobodys_fault(closes_at, fault, why):
    """45 m from the line 2.5 m/s² would do, and after 3 s they are gone."""
    line = START + CAR.front_reach + 45.0 + 24.0
    records = []
    for k, (x, y, speed, rate) in enumerate(motion(START, 15.0, 31)):
        state = CartesianState(x, y, 0.0, 0.0, speed, rate)
        lines = (line,) if k >= closes_at else ()
        records.append(replace(record(k, state), stop_lines=lines))
    found = hardest_braking(trace_of(records))
    assert (found.fault, found.why) == (fault, why)


def test_an_obstacle_is_no_excuse():
    one, none = np.array([START + 60.0]), np.zeros(1)
    rock = Obstacles(("rock",), one, none, none, none, none, np.ones(1))
    found = hardest_braking(drive(motion(START, 15.0, 20), obstacles=rock))
    assert found.fault is Fault.EGO
    assert found.cause == "rock"


def follower_behind(gap, speed, brakes_at):
    return motion(START - 4.5 - gap, speed, brakes_at)


def test_an_ego_that_cuts_in_is_at_fault_for_its_follower():
    ego = motion(START, 9.0, l=changes_lane(20))
    trace = drive(ego, behind=follower_behind(20.0, 15.0, 33))
    found = hardest_braking(trace)
    assert found.fault is Fault.EGO
    assert found.stretch.who == "behind"
    assert metric_row(trace)[columns.HARD_BRAKINGS_CAUSED] == 1
    assert moments(trace)[columns.HARD_BRAKING_VERDICT] == found.stretch.first
    (event,) = (e for e in events(trace) if e.kind is EventKind.FOLLOWER_BRAKING)
    assert "ego at fault: moves into the way" in event.text


def test_a_follower_that_comes_too_fast_is_at_fault_itself():
    trace = drive(motion(START, 9.0), behind=follower_behind(45.0, 16.0, 30))
    assert hardest_braking(trace).fault is Fault.OTHER


def test_a_follower_that_brakes_for_nobody_is_not_the_egos_fault():
    trace = drive(motion(START, 20.0), behind=follower_behind(30.0, 15.0, 30))
    found = hardest_braking(trace)
    assert found.fault is Fault.OTHER
    assert "not for the ego" in found.why or "too fast" in found.why


@pytest.mark.parametrize("excused", [True, False])
def test_a_follower_of_an_ego_that_brakes_hard_shares_its_verdict(excused):
    ego = motion(START, 15.0, 36)
    cars = {"behind": follower_behind(15.0, 15.0, 42)}
    if excused:
        cars["ahead"] = motion(START + 30.0, 15.0, brakes_at=30)
    faults = {
        one.stretch.who: one.fault for one in braking_verdicts(drive(ego, **cars))
    }
    expected = Fault.OTHER if excused else Fault.EGO
    assert faults == {"ego": expected, "behind": expected}


@pytest.mark.parametrize("first", [0, 32])
def test_an_excused_braking_excuses_no_later_one(first):
    # cut into at step 32, then a braking of its own: the follower brakes in each
    steps, later = 240, 200
    spans, behind = [(later, later + 10)], [(later + 6, later + 16)]
    cars = {}
    if first:
        spans, behind = (
            [(first, first + 10), *spans],
            [(first + 6, first + 16), *behind],
        )
        into, out_of = changes_lane(20), changes_lane(60)
        cars["ahead"] = motion_braking(
            START + 31.0, 9.0, [], lambda k: LANE + into(k) - out_of(k), steps
        )
    ego = motion_braking(START, 15.0, spans, steps=steps)
    cars["behind"] = motion_braking(START - 19.5, 15.0, behind, steps=steps)
    found = braking_verdicts(drive(ego, **cars))
    faults = [
        (one.stretch.first, one.fault) for one in found if one.stretch.who == "behind"
    ]
    own = [(later + 6, Fault.EGO)]
    assert faults == ([(first + 6, Fault.OTHER), *own] if first else own)
