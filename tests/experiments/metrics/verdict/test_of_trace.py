"""Verdicts of recorded episodes: in the row, at their moment, among the events."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.metrics import columns
from experiments.metrics.events import EventKind, events
from experiments.metrics.impact import impact_speed
from experiments.metrics.moments import moments
from experiments.metrics.row import metric_row
from experiments.metrics.verdict.of_trace import verdict_of
from experiments.metrics.verdict.records import Fault
from planner.right_of_way.records import JunctionAhead, Rule
from planner.scene import Obstacles
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, record, trace_of
from tests.planner.right_of_way.test_gaps import FOE

SPEED = 15.0
FRONT = CAR.length - CAR.rear_overhang  # of the ego, before its rear axle [m]


def drive(until, other=None, speed=SPEED, contacts=(), obstacles=None, off_road=0.0):
    """Drive straight on; other(k) is (x, y, heading, speed, acceleration)."""
    records = []
    for k in range(until + 1):
        ego = CartesianState(50.0 + speed * STEP * k, 0, 0, 0, speed, 0)
        cars = () if other is None else (("car", *other(k)),)
        touched = contacts if k == until else ()
        beyond = off_road if k == until else 0.0
        records.append(record(k, ego, cars=cars, contacts=touched, off_road=beyond))
    return trace_of(records, obstacles=obstacles)


def steps_to(gap, closing):
    """Return the step of the contact: the gap is gone."""
    return int(np.ceil(gap / (closing * STEP)))


def test_a_standing_car_is_hit_by_the_ego():
    x = 50.0 + FRONT + 60.0 + 2.0
    trace = drive(steps_to(60.0, SPEED), lambda _: (x, 0, 0, 0, 0), contacts=("car",))
    row = metric_row(trace)
    assert row[columns.VERDICT] == "ego at fault"
    assert row[columns.IMPACT_SPEED] == pytest.approx(SPEED)
    # braking with 8 m/s² takes 14.1 m; past the car on its left it can go later still
    stop = (60.0 - SPEED**2 / 16.0) / SPEED
    assert stop - STEP <= row[columns.AVOIDABLE_UNTIL] <= 60.0 / SPEED
    step = moments(trace)[columns.VERDICT]
    assert trace.steps["time_s"][step] == row[columns.AVOIDABLE_UNTIL]
    (found,) = [one for one in events(trace) if one.kind is EventKind.VERDICT]
    assert found.step == step
    assert "ego at fault: drives into what is ahead of it" in found.text


def test_a_follower_hits_the_ego():
    def faster(k):
        return (20.0 + 25.0 * STEP * k, 0, 0, 25.0, 0)

    gap = 50.0 - CAR.rear_overhang - 22.0
    trace = drive(steps_to(gap, 10.0), faster, contacts=("car",))
    assert metric_row(trace)[columns.VERDICT] == "other at fault"
    assert impact_speed(trace) == pytest.approx(10.0)


def test_an_obstacle_is_hit_by_the_ego():
    one = np.array([100.0])
    none = np.zeros(1)
    disc = Obstacles(("rock",), one, none, none, none, none, np.ones(1))
    gap = 99.0 - 50.0 - FRONT
    trace = drive(steps_to(gap, SPEED), contacts=("rock",), obstacles=disc)
    assert verdict_of(trace).fault is Fault.EGO
    assert impact_speed(trace) == pytest.approx(SPEED)


def test_a_lorry_that_turns_on_the_spot_is_an_artefact():
    def turning(k):
        return (54.0, 3.0, -0.08 * max(k - 20, 0), 0.0, 0.0)

    trace = drive(30, turning, speed=0.0, contacts=("car",))
    found = verdict_of(trace)
    assert found.fault is Fault.ARTEFACT
    assert "turns on the spot" in found.why


def test_a_car_that_was_not_there_is_an_artefact():
    records = []
    for k in range(21):
        ego = CartesianState(50.0 + SPEED * STEP * k, 0, 0, 0, SPEED, 0)
        cars = (("car", 55.0 + SPEED * STEP * k, 0, 0, 0, 0),) if k == 20 else ()
        touched = ("car",) if k == 20 else ()
        records.append(record(k, ego, cars=cars, contacts=touched))
    assert verdict_of(trace_of(records)).fault is Fault.ARTEFACT


@pytest.mark.parametrize(
    ("begin", "why"),
    [(52.0, "the ego has to give way"), (58.0, "the other has to give way")],
    ids=["in", "before"],
)
def test_one_that_stands_before_a_zone_gives_way_there(begin, why):
    """A turning vehicle with the right of way that cuts the corner hits it."""
    records = []
    for k in range(41):
        ego = CartesianState(50.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        car = ("foe", 53.0, 26.0 - 6.0 * STEP * k, -np.pi / 2, 6.0, 0.0)
        touched = ("foe",) if k == 40 else ()
        made = record(k, ego, cars=[car], contacts=touched)
        junctions = (JunctionAhead("j", Rule.MINOR, 55.0, 75.0, 8.0),)
        foe = FOE._replace(begin_s=begin, end_s=begin + 6.0, entry=1.0)
        traffic = replace(made.traffic, junctions=junctions, foes=(foe,))
        records.append(replace(made, traffic=traffic))
    found = verdict_of(trace_of(records))
    assert found.why.startswith(why)
    assert found.fault is Fault.OTHER  # which has seen it long before


def test_leaving_the_road_is_the_egos_fault():
    found = verdict_of(drive(10, off_road=0.5))
    assert found.fault is Fault.EGO
    assert found.step == 9


def test_there_is_no_verdict_without_a_contact():
    row = metric_row(drive(10))
    assert row[columns.VERDICT] is None
    assert row[columns.AVOIDABLE_UNTIL] is None
    assert row[columns.IMPACT_SPEED] is None
