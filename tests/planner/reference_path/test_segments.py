import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from planner.errors import InvalidInputError
from planner.reference_path.linear_curvature import MAX_SPACING, MAX_TURN
from planner.reference_path.segments import (
    Knots,
    Segment,
    SegmentKind,
    arc,
    clothoid,
    knot_table,
    knots_of_segments,
    line,
)

curvatures = st.floats(-0.2, 0.2)
lengths = st.floats(0.1, 60.0)
segments = st.lists(
    st.one_of(
        lengths.map(line),
        st.builds(arc, lengths, curvatures),
        st.builds(clothoid, lengths, curvatures, curvatures),
    ),
    min_size=1,
    max_size=4,
)
starts = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3, 3))


def driven(chain, start):
    """End of a chain by integration of its heading, segment by segment."""
    x, y, heading = start
    for one in chain:

        def turn(u, one=one, heading=heading):
            return heading + u * (one.curvature + 0.5 * one.rate * u)

        x += quad(lambda u, turn=turn: math.cos(turn(u)), 0.0, one.length)[0]
        y += quad(lambda u, turn=turn: math.sin(turn(u)), 0.0, one.length)[0]
        heading += one.turn
    return x, y, heading


@given(segments, starts)
def test_knots_end_where_integration_does(chain, start):
    knots = knots_of_segments(chain, start)
    assert (knots.x[0], knots.y[0], knots.heading[0]) == pytest.approx(start)
    found = knots.x[-1], knots.y[-1], knots.heading[-1]
    assert found == pytest.approx(driven(chain, start), abs=1e-6)
    assert knots.s[-1] == pytest.approx(sum(one.length for one in chain))


@given(segments, starts)
def test_knots_are_as_close_as_the_series_between_them_need(chain, start):
    knots = knots_of_segments(chain, start)
    steps = np.diff(knots.s)
    assert (steps > 0.0).all()
    assert steps.max() <= MAX_SPACING + 1e-9
    assert np.abs(np.diff(knots.heading)).max() <= MAX_TURN + 1e-9
    # what stands between two knots leads from one to the other
    turned = steps * (knots.curvature[:-1] + 0.5 * knots.curvature_rate[:-1] * steps)
    np.testing.assert_allclose(np.diff(knots.heading), turned, atol=1e-9)


@given(st.floats(1.0, 50.0), st.floats(0.01, 0.2))
def test_an_arc_lies_on_its_circle(length, curvature):
    knots = knots_of_segments([arc(length, curvature)], (0.0, 0.0, 0.0))
    radii = np.hypot(knots.x, knots.y - 1.0 / curvature)
    np.testing.assert_allclose(radii, 1.0 / curvature, rtol=1e-12)


def test_kinds_and_what_follows_from_them():
    assert line(5.0) == Segment(SegmentKind.LINE, 5.0, 0.0, 0.0)
    bent = clothoid(10.0, 0.0, 0.1)
    assert (bent.rate, bent.turn) == pytest.approx((0.01, 0.5))
    assert arc(10.0, 0.1).rate == 0.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: line(0.0),
        lambda: line(math.inf),
        lambda: line(math.nan),
        lambda: arc(1.0, math.nan),
        lambda: clothoid(1.0, 0.0, math.inf),
        lambda: knots_of_segments([], (0.0, 0.0, 0.0)),
        lambda: knots_of_segments([line(1.0)], (0.0, math.nan, 0.0)),
    ],
)
def test_what_is_no_curve_is_refused(make):
    with pytest.raises(InvalidInputError):
        make()


@pytest.mark.parametrize("s", [[0.0], [0.0, 0.0], [1.0, 0.5]])
def test_a_table_needs_growing_knots(s):
    column = np.array(s)
    with pytest.raises(InvalidInputError, match="growing s"):
        knot_table(Knots(column, *(np.zeros(column.size) for _ in range(5))))
