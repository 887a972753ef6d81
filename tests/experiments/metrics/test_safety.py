"""Safety metrics on hand-made traces, and against brute force."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.cosim import ego_driver
from experiments.metrics import safety
from experiments.metrics.pairs import Neighbours
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.shapes.rectangles import Rectangle, Rectangles, distance, distances
from planner.states import CartesianState
from tests.experiments.traces import CAR, record, trace_of


def test_time_to_collision_with_a_slower_leader():
    # centres 50 m apart, lengths 4.8 and 4: gap 45.6 m, closing 10 - 4 = 6 m/s
    centre = CAR.centre_offset
    trace = trace_of(
        [
            record(
                0,
                CartesianState(0, 0, 0, 0, 10, 0),
                cars=[("a", 50.0 + centre, 0.0, 0.0, 4.0, 0.0)],
            )
        ]
    )
    assert safety.min_time_to_collision(trace) == pytest.approx(45.6 / 6.0)
    assert safety.min_time_headway(trace) == pytest.approx(45.6 / 10.0)


@pytest.mark.parametrize(
    "car",
    [
        ("faster", 50.0, 0.0, 0.0, 11.0, 0.0),
        ("aside", 50.0, 2.2, 0.0, 4.0, 0.0),
        ("oncoming aside", 50.0, 3.0, math.pi, 10.0, 0.0),
        ("too far ahead in time", 100.0, 0.0, 0.0, 9.9, 0.0),
        ("behind and slower", -30.0, 0.0, 0.0, 4.0, 0.0),
    ],
)
def test_no_time_to_collision(car):
    records = [record(0, CartesianState(0, 0, 0, 0, 10, 0), cars=[car])]
    assert safety.min_time_to_collision(trace_of(records)) is None


def test_oncoming_traffic_in_a_bend_is_no_conflict():
    # its tangent crosses the ego's; along the road it keeps 10 m to the left
    path = ReferencePath.from_segments([arc(300.0, 1.0 / 60.0)])
    x, y, heading = path.pose(0.0)
    x2, y2, heading2 = path.pose(40.0)
    car = (
        "oncoming",
        x2 + 10.0 * math.sin(heading2),
        y2 - 10.0 * math.cos(heading2),
        heading2 + math.pi,
        14.0,
        0.0,
    )
    ego = CartesianState(x, y, heading, 1.0 / 60.0, 14.0, 0.0)
    trace = trace_of([record(0, ego, path=path, cars=[car])], path=path)
    assert trace.vehicles["l_m"][0] == pytest.approx(-10.0)
    assert safety.min_time_to_collision(trace) is None


GRID = np.linspace(0.0, 5.0, 2001)


def _swept_by_brute_force(pairs: Neighbours) -> float:
    """First time on a fine grid at which the rectangles overlap."""
    n = np.ones(GRID.size)
    others = Rectangles(
        pairs.ds + GRID * pairs.ds_dot,
        pairs.dl + GRID * pairs.dl_dot,
        pairs.heading * n,
        pairs.length * n,
        pairs.width * n,
        0.0 * n,
    )
    ego = Rectangle(0, 0, float(pairs.ego_heading[0]), CAR.length, CAR.width)
    touching = np.flatnonzero(distances(ego, others) <= 0.0)
    return float(GRID[touching[0]]) if touching.size else math.inf


angle = st.floats(-math.pi, math.pi)


@settings(deadline=None)
@given(
    place=st.tuples(st.floats(-30, 30), st.floats(-15, 15)),
    rate=st.tuples(st.floats(-15, 15), st.floats(-8, 8)),
    headings=st.tuples(angle, angle),
)
def test_time_to_contact_agrees_with_brute_force(place, rate, headings):
    def one(value):
        return np.array([value])

    pairs = Neighbours(
        np.array([0]),
        np.array(["a"]),
        one(place[0]),
        one(place[1]),
        one(rate[0]),
        one(rate[1]),
        one(headings[0]),
        one(4.5),
        one(1.8),
        one(10.0),
        one(0.0),
        one(headings[1]),
        one(10.0),
        CAR.length,
        CAR.width,
    )
    found = float(safety.time_to_contact(pairs)[0])
    brute = _swept_by_brute_force(pairs)
    if math.isinf(brute):
        # a graze shorter than the grid may be missed by it
        assert found > 5.0 or _graze(pairs, found)
    else:
        assert found <= brute + 1e-9
        assert found >= brute - 5.0 / 2000 - 1e-9 or _graze(pairs, found)


def _graze(pairs: Neighbours, t: float) -> bool:
    """Tell whether the bodies really touch at the time that the grid missed."""
    other = Rectangle(
        float(pairs.ds[0] + t * pairs.ds_dot[0]),
        float(pairs.dl[0] + t * pairs.dl_dot[0]),
        float(pairs.heading[0]),
        4.5,
        1.8,
    )
    ego = Rectangle(0, 0, float(pairs.ego_heading[0]), CAR.length, CAR.width)
    return distance(ego, other) < 1e-6


def test_contacts_clearance_and_road():
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    trace = trace_of(
        [
            record(0, ego, clearance=2.0, off_road=0.005),
            record(1, ego, clearance=0.5, off_road=0.2),
            record(2, ego, clearance=0.1, contacts=("b", "a")),
            record(3, ego, clearance=0.1, contacts=("a",)),
        ]
    )
    assert safety.contacts(trace) == ["b", "a"]
    assert safety.min_clearance(trace) == 0.0
    assert safety.off_road_steps(trace) == 1
    assert safety.min_clearance(trace_of([record(0, ego, clearance=0.7)])) == 0.7
    assert safety.min_clearance(trace_of([record(0, ego)])) is None


def test_off_road_counts_what_the_loop_counts():
    assert safety.OFF_ROAD_TOLERANCE == ego_driver.OFF_ROAD_TOLERANCE


SLANTING = math.atan2(0.6, 0.8)


@pytest.mark.parametrize(
    ("car", "gap"),
    [
        # 4 m x 2 m, the ego is 4.8 m x 1.9 m: its corridor is 0.95 m to each side
        ((50.0, 0.0, 0.0), 50.0 - 2.0 - 2.4),
        ((50.0, 1.94, 0.0), 50.0 - 2.0 - 2.4),
        ((50.0, 1.96, 0.0), None),  # beside the corridor
        # a neighbour that slants away, its rear beside the ego: clearance 0.6 m
        ((3.0, 2.3, 0.5), None),
        # cutting in: its right side runs from (11, 0) to (7.8, 2.4), and enters the
        # corridor at l = 0.95, s = 11 - 3.2 * 0.95 / 2.4
        ((10.0, 2.0, -SLANTING), 11.0 - 3.2 * 0.95 / 2.4 - 2.4),
        ((10.0, 2.94, -SLANTING), 11.0 - 3.2 * 0.01 / 2.4 - 2.4),
        ((10.0, 2.96, -SLANTING), None),  # its nose ends 1 cm beside the corridor
        # turned off the road: the rear edge lies across the corridor; from (9, -1) to
        # (7.8, 0.6) and from there, its first corner, on
        ((10.0, 0.0, SLANTING), 7.8 - 2.4),
        ((10.0, 0.0, math.pi - SLANTING), None),  # oncoming
        ((102.4 + 2.0, 0.0, 0.0), 100.0),
        ((102.4 + 2.1, 0.0, 0.0), None),  # too far
        ((4.4, 0.0, 0.0), 0.0),  # bumper to bumper
    ],
)
def test_leaders_and_their_gaps(car, gap):
    ds, dl, heading = car
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    place = (ds + CAR.centre_offset, dl, heading, 5.0, 0.0)
    trace = trace_of([record(0, ego, cars=[("a", *place)])])
    expected = None if gap is None else pytest.approx(gap / 10.0, abs=1e-8)
    assert safety.min_time_headway(trace) == expected


@given(
    ds=st.floats(5.5, 40.0),
    dl=st.floats(-6.0, 6.0),
    heading=st.floats(-1.5, 1.5),
)
def test_the_gap_ends_where_the_footprint_enters_the_corridor(ds, dl, heading):
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    car = ("a", ds + CAR.centre_offset, dl, heading, 5.0, 0.0)
    found = safety.min_time_headway(trace_of([record(0, ego, cars=[car])]))
    along, across = np.meshgrid(np.linspace(-2, 2, 401), np.linspace(-1, 1, 201))
    s = ds + along * math.cos(heading) - across * math.sin(heading)
    l = dl + along * math.sin(heading) + across * math.cos(heading)
    inside = np.abs(l) <= CAR.width / 2.0
    if not inside.any():  # or by less than the grid shows
        nearest = np.abs(l).min() - CAR.width / 2.0
        assert found is None or nearest < 0.02
        return
    gap = max(float(s[inside].min()) - CAR.length / 2.0, 0.0)
    assert found == pytest.approx(gap / 10.0, abs=0.004)
