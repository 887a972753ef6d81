"""Metrics of rules on hand-made traces."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.sumo.vehicle_reader import PERSON
from experiments.cosim.waiting_lines import OVER_LINE
from experiments.metrics import right_of_way
from experiments.trace.schema import TABLES, column
from planner.right_of_way.records import Foe, JunctionAhead, Rule
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, record, trace_of
from tests.planner.right_of_way.test_gaps import FOE

SPEED = 10.0
LINE = 20.0  # [m]


def drive(n=41, *, lines=(), foes=(), cars=(), speed=SPEED, waits=None):
    """Drive straight on from s = 0; `lines`, `foes` and `cars` are functions of k."""
    records = []
    for k in range(n):
        ego = CartesianState(speed * STEP * k, 0.0, 0.0, 0.0, speed, 0.0)
        made = record(k, ego, cars=cars(k) if cars else ())
        traffic = replace(
            made.traffic,
            junctions=(JunctionAhead("j", Rule.MINOR, LINE, 30.0, 8.0),)
            if foes
            else (),
            foes=tuple(foes(k)) if foes else (),
        )
        made = replace(
            made,
            traffic=traffic,
            stop_lines=tuple(lines(k)) if lines else (),
            gives_way_to=waits(k) if waits else None,
        )
        records.append(made)
    return trace_of(records)


def test_a_closed_line_that_is_driven_over_is_counted_once():
    assert right_of_way.line_violations(drive()) == 0
    assert right_of_way.line_violations(drive(lines=lambda _: [LINE])) == 1
    assert right_of_way.line_violations(drive(lines=lambda _: [LINE, 30.0])) == 2
    crossing = (LINE - CAR.front_reach) / (SPEED * STEP)
    opens = drive(lines=lambda k: [LINE] if k < crossing - 2 else [])
    assert right_of_way.line_violations(opens) == 0
    beyond = drive(lines=lambda _: [500.0])
    assert right_of_way.line_violations(beyond) == 0


def braking_foe(acceleration, entry=30.0, **changes):
    foe = FOE._replace(
        begin_s=22.0, end_s=28.0, entry=entry, to_line=entry - 3.0, **changes
    )
    return drive(
        foes=lambda _: [foe],
        cars=lambda _: [("foe", 50.0, 30.0, -1.57, 10.0, acceleration)],
    )


def test_only_those_with_the_right_of_way_are_hindered():
    assert right_of_way.encroachments(drive()) is None
    assert right_of_way.encroachments(braking_foe(-2.5)) == 1
    assert right_of_way.encroachments(braking_foe(-1.5)) == 0
    assert right_of_way.encroachments(braking_foe(-2.5, goes_first=False)) == 0
    assert right_of_way.encroachments(braking_foe(-2.5, gives_way=True)) == 0
    assert right_of_way.encroachments(braking_foe(-2.5, held=True)) == 0
    # from 13.9 to 5 m/s within 27 m: 3.1 m/s² are its own
    assert right_of_way.encroachments(braking_foe(-4.5, turn_speed=5.0)) == 0
    assert right_of_way.encroachments(braking_foe(-5.5, turn_speed=5.0)) == 1
    # one that could stop before the zone with 2 m/s² much later brakes for another
    assert right_of_way.encroachments(braking_foe(-4.5, entry=100.0)) == 0


def standing_person(**changes):
    """Drive over a crossing from 22 to 28 m before which somebody stands."""
    foe = FOE._replace(
        vehicle="person:p", begin_s=22.0, end_s=28.0, entry=1.0, to_line=-1.0, speed=0.0
    )._replace(**changes)
    return drive(foes=lambda _: [foe])


def test_people_with_the_right_of_way_who_have_to_stand_are_hindered():
    assert right_of_way.people_hindered(drive()) is None
    assert right_of_way.people_hindered(standing_person()) == 1
    assert right_of_way.encroachments(standing_person()) == 0
    for changes in (
        {"speed": 1.2},
        {"goes_first": False},
        {"held": True},
        {"entry": -0.5},  # on the ego's way already
        {"vehicle": "car"},
        {"begin_s": 500.0, "end_s": 506.0},  # the ego does not get there
    ):
        assert right_of_way.people_hindered(standing_person(**changes)) == 0


def test_waiting_counts_while_the_ego_stands():
    def waits(k):
        return "foe" if k < 10 else None

    foes = {"foes": lambda _: [FOE]}
    stands = drive(speed=0.0, waits=waits, **foes)
    assert right_of_way.gave_way_time(stands) == pytest.approx(1.0)
    assert right_of_way.gave_way_time(drive(waits=waits, **foes)) == 0.0
    assert right_of_way.gave_way_time(drive(waits=waits)) is None


def passing(first, last):
    """A foe that is in the zone from step `first` until `last`."""

    def foes(k):
        if k > last:
            return []
        return [FOE._replace(begin_s=22.0, end_s=28.0, entry=1.0 * (first - k))]

    return foes


def test_time_between_two_in_a_zone():
    # the ego's front is in the zone after step 18.2, its rear out of it after 29.1
    reach, overhang = CAR.front_reach, CAR.rear_overhang
    enters = int(np.floor((22.0 - reach) / (SPEED * STEP))) + 1
    leaves = int(np.floor((28.0 + overhang) / (SPEED * STEP))) + 1
    before = right_of_way.post_encroachment_time(drive(foes=passing(5, 9)))
    assert before == pytest.approx((enters - 10) * STEP)
    after = right_of_way.post_encroachment_time(drive(foes=passing(leaves + 4, 38)))
    assert after == pytest.approx(4 * STEP)
    both = right_of_way.post_encroachment_time(drive(foes=passing(enters + 1, 30)))
    assert both == 0.0
    assert right_of_way.post_encroachment_time(drive()) is None
    assert right_of_way.post_encroachment_time(drive(foes=lambda _: [FOE])) is None


def test_columns_of_the_table_are_the_fields_of_the_record():
    table = TABLES["foes"]
    assert len(table) == 1 + len(Foe._fields)
    for name, field in zip(list(table)[1:], Foe._fields, strict=True):
        assert name.startswith(field.removesuffix("_s"))
    assert column([1, 0], table["held"]).tolist() == [1, 0]


def test_the_simulator_and_the_metrics_mean_the_same():
    """Metrics load nothing that drives, so these stand in both."""
    assert right_of_way.ON_FOOT == PERSON
    assert right_of_way.OVERSHOOT == OVER_LINE
