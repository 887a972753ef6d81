import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.numerics.angles import wrapped, wrapped_all


@given(st.floats(-50.0, 50.0))
def test_wrapped_heading_points_the_same_way(heading):
    turned = wrapped(heading)
    assert -math.pi < turned <= math.pi
    assert math.cos(turned) == pytest.approx(math.cos(heading), abs=1e-9)
    assert math.sin(turned) == pytest.approx(math.sin(heading), abs=1e-9)


def test_wrapped_keeps_west_positive():
    assert wrapped(-math.pi) == math.pi
    assert wrapped(math.pi) == math.pi


def test_many_headings_are_wrapped_as_one_is():
    headings = np.array([0.0, 1.0, -3.0, math.pi, -math.pi, 4.0, 12.0, -9.5])
    one_by_one = [wrapped(float(heading)) for heading in headings]
    np.testing.assert_allclose(wrapped_all(headings), one_by_one, atol=1e-12)
