import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dense.field import (
    Discs,
    ObstacleColumns,
    RoadColumns,
    disc_centre,
    half_span,
    path_curvature,
    squared_distance,
)
from planner.dense.lattice.edge_check import (
    COLLISION,
    FREE,
    OFF_ROAD,
    TOO_SHARP,
    EdgeLimits,
    EdgePoints,
    LateralSpan,
    edge_scratch,
    edge_verdict,
    obstacle_windows,
    road_along,
)
from planner.dense.lattice.edges import (
    blend_price,
    blend_span,
    blend_table,
    fill_blend,
    fill_quintic,
    printed_safety,
    quintic_at,
    quintic_price,
)
from planner.numerics.polynomials import quintic_coefficients

OFFSETS = np.array([-0.2, 1.4, 3.0])
DISCS = Discs(OFFSETS, 1.242, 0.8, 0.95)
EVERYWHERE = LateralSpan(-np.inf, np.inf)


@given(l0=st.floats(-5.0, 5.0), l1=st.floats(-5.0, 5.0), length=st.floats(2.0, 20.0))
def test_blend_is_the_quintic_of_equation_5_16(l0, l1, length):
    x = np.array([0.0, length])
    rows = [np.vander(x, 6, increasing=True)]
    for _ in range(2):
        last = rows[-1]
        step = np.zeros_like(last)
        step[:, 1:] = last[:, :-1]
        rows.append(step)
    powers = np.arange(6)
    value = np.vander(x, 6, increasing=True)
    first = np.zeros((2, 6))
    first[:, 1:] = powers[1:] * np.vander(x, 5, increasing=True)
    second = np.zeros((2, 6))
    second[:, 2:] = powers[2:] * powers[1:-1] * np.vander(x, 4, increasing=True)
    matrix = np.vstack([value[0], first[0], second[0], value[1], first[1], second[1]])
    c = np.linalg.solve(matrix, [l0, 0.0, 0.0, l1, 0.0, 0.0])
    shape = np.empty((3, 9))
    fill_blend(shape, blend_table(8), l0, l1, length)
    s = length * np.arange(9) / 8
    assert shape[0] == pytest.approx(np.polyval(c[::-1], s), abs=1e-8)
    assert shape[1] == pytest.approx(np.polyval(np.polyder(c[::-1]), s), abs=1e-8)
    assert shape[2] == pytest.approx(np.polyval(np.polyder(c[::-1], 2), s), abs=1e-8)


@given(l0=st.floats(-5.0, 5.0), l1=st.floats(-5.0, 5.0), length=st.floats(2.0, 20.0))
def test_closed_prices_agree_with_quadrature(l0, l1, length):
    c = quintic_coefficients(l0, 0.0, 0.0, l1, 0.0, 0.0, length)
    x = np.linspace(0.0, length, 4001)
    l, first, second, third = np.array([quintic_at(c, value) for value in x]).T
    want = (
        np.trapezoid(l**2, x),
        np.trapezoid(first**2 + second**2 + third**2, x),
    )
    assert blend_price(l0, l1, length) == pytest.approx(want, rel=1e-5, abs=1e-9)
    assert quintic_price(c, length) == pytest.approx(want, rel=1e-5, abs=1e-9)


def test_span_holds_all_discs():
    shape = np.empty((3, 201))
    fill_blend(shape, blend_table(200), -1.0, 2.5, 6.0)
    low, high = blend_span(-1.0, 2.5, 6.0, 3.0)
    for offset in OFFSETS:
        places = [disc_centre(0.0, *shape[:2, j], offset, 0.0)[1] for j in range(201)]
        assert low <= min(places)
        assert max(places) <= high


def columns(rows) -> ObstacleColumns:
    return ObstacleColumns(*np.ascontiguousarray(np.array(rows).T))


def naive_verdict(shape, s, road_of, obstacles, max_curvature):
    """The same check, written point by point from the definitions."""
    collided, outside, sharp = False, False, False
    for j in range(s.size):
        l, slope, second = shape[:, j]
        left, right, curvature, rate = road_of(s[j])
        sharp |= abs(path_curvature(l, slope, second, curvature, rate)) > max_curvature
        for offset in OFFSETS:
            turned = curvature * offset
            need = half_span(DISCS, slope, 1.0 - curvature * l, turned, curvature)
            at_s, at_l = disc_centre(s[j], l, slope, offset, curvature)
            outside |= at_l + need > left or at_l - need < right
            for o in obstacles:
                between = 0.5 * (curvature + o[3])
                away2 = squared_distance(at_s, at_l, o[0], o[1], between)
                collided |= away2 < (o[2] + DISCS.radius) ** 2
    return COLLISION if collided else OFF_ROAD if outside else TOO_SHARP if sharp else 0


def checked(edge, s, road, rows, limits):
    """Check one edge among obstacles in rows."""
    obstacles = columns(rows)
    reach = DISCS.radius + limits.clearance
    windows = obstacle_windows(s, road.curvature, obstacles, OFFSETS, reach)
    points = EdgePoints(s, road, windows)
    return edge_verdict(edge, points, EVERYWHERE, obstacles, DISCS, limits)


@pytest.mark.parametrize("curvature", [0.0, 0.03, -0.05])
def test_verdicts_agree_with_the_definitions(curvature):
    random = np.random.default_rng(5)
    s = 20.0 + 12.0 * np.arange(25) / 24
    both = np.ones(2)
    samples = RoadColumns(
        np.array([0.0, 60.0]), 5.0 * both, -5.0 * both, curvature * both
    )
    road = road_along(s, samples, OFFSETS)
    seen = set()
    for _ in range(300):
        edge = edge_scratch(s.size, OFFSETS.size)
        ends = random.uniform(-4.5, 4.5, 2)
        fill_blend(edge.shape, blend_table(24), *ends, 12.0)
        places = np.column_stack(
            [random.uniform(10.0, 42.0, 2), random.uniform(-5.0, 5.0, 2)]
        )
        rows = np.column_stack(
            [places, random.uniform(0.3, 2.0, 2), np.full(2, curvature)]
        )
        verdict, price = checked(edge, s, road, rows, EdgeLimits(1.5, 0.15))
        want = naive_verdict(
            edge.shape, s, lambda _: (5.0, -5.0, curvature, 0.0), rows, 0.15
        )
        assert verdict == want
        assert price >= 0.0
        seen.add(verdict)
    assert seen == {FREE, COLLISION, OFF_ROAD, TOO_SHARP}


def test_clearance_costs_more_the_nearer_the_edge():
    s, both = np.linspace(0.0, 20.0, 41), np.ones(2)
    samples = RoadColumns(np.array([0.0, 60.0]), 9.0 * both, -9.0 * both, 0.0 * both)
    road = road_along(s, samples, OFFSETS)
    found = []
    for l in (2.6, 3.0, 3.5, 4.4):
        edge = edge_scratch(s.size, OFFSETS.size)
        edge.shape[:] = 0.0
        edge.shape[0] = l
        rows = [[10.0, 0.0, 1.0, 0.0]]
        found.append(checked(edge, s, road, rows, EdgeLimits(1.5, 0.2)))
    assert [verdict for verdict, _ in found] == [FREE] * 4
    values = [price for _, price in found]
    assert values[0] > values[1] > values[2] > 0.0
    assert values[3] == 0.0


def test_printed_safety_is_equation_5_22():
    shape = np.zeros((3, 11))
    obstacles = columns([[300.0, 2.0, 1.5, 0.0]])  # s does not matter
    assert printed_safety(shape, 10.0, obstacles) == pytest.approx(1.5 / 20.0)


def test_first_edge_begins_like_the_ego():
    c = quintic_coefficients(0.5, 0.2, -0.01, 2.0, 0.0, 0.0, 9.0)
    shape = np.empty((3, 10))
    fill_quintic(shape, c, 9.0)
    assert shape[:, 0] == pytest.approx([0.5, 0.2, -0.01])
    assert shape[:, -1] == pytest.approx([2.0, 0.0, 0.0], abs=1e-12)
