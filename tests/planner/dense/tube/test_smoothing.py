import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.thesis.dense.layouts import EGO_RADIUS, random_layout
from planner.dense.field import Cover, FrenetObstacles, path_curvature, straight_field
from planner.dense.frenet_path import FrenetPath, check_path
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice.edge_check import RoadAlong
from planner.dense.lattice_methods import (
    LatticeStatus,
    plan_adaptive,
    plan_uniform,
)
from planner.dense.settings import LatticeSettings, SmoothingSettings
from planner.dense.tube.corridor import PathGuess, second_bounds
from planner.dense.tube.smoothing import smooth, smoothing_problem
from planner.piecewise_jerk.solve import solve
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.vehicle import Vehicle

DISC = Cover.single(EGO_RADIUS)
VEHICLE = Vehicle()
BODY = Cover.of(VEHICLE)
STILL = PathStart(0.0, 0.0, 0.0, 0.0)
METHODS = {"uniform": plan_uniform, "adaptive": plan_adaptive}


def plan(method, field, cover=DISC, start=STILL, lattice=None, smoothing=None):
    lattice, smoothing = lattice or LatticeSettings(), smoothing or SmoothingSettings()
    return METHODS[method](field, cover, start, 60.0, lattice, smoothing)


def dense_points(path):
    fine = path.subdivided(20)
    return fine.s, fine.l, fine.slope, fine.second


@pytest.mark.parametrize("method", METHODS)
@given(seed=st.integers(0, 10_000), n=st.integers(0, 4), same=st.booleans())
@settings(max_examples=40)
def test_what_is_returned_is_clear_and_not_too_sharp(method, seed, n, same):
    rows = random_layout(max(n, 1), seed=seed, same_size=same)[:n]
    planned = plan(method, straight_field(rows, 5.0, 60.0))
    assert (planned.path is None) == (
        planned.smoothing is None or planned.smoothing.path is None
    )
    if planned.path is None:
        assert planned.reason
        return
    s, l, slope, second = dense_points(planned.path)
    for o in rows:
        assert np.hypot(s - o[0], l - o[1]).min() >= o[2] + EGO_RADIUS - 2e-3
    assert np.abs(l).max() <= 5.0 + 2e-3
    assert np.abs(second / (1.0 + slope**2) ** 1.5).max() <= 0.5


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4))
@settings(max_examples=40)
def test_the_rectangle_keeps_clear_too(seed, n):
    rows = random_layout(n, seed=seed, same_size=False)
    planned = plan("adaptive", straight_field(rows, 5.0, 60.0), BODY)
    if planned.path is None:
        return
    s, l, slope, _ = dense_points(planned.path)
    heading = np.arctan(slope)
    cos, sin = np.cos(heading), np.sin(heading)
    half = VEHICLE.length / 2.0, VEHICLE.width / 2.0
    centre = s + VEHICLE.centre_offset * cos, l + VEHICLE.centre_offset * sin
    for o in rows:
        ds, dl = o[0] - centre[0], o[1] - centre[1]
        along, across = np.abs(ds * cos + dl * sin), np.abs(dl * cos - ds * sin)
        gap = np.hypot(np.maximum(along - half[0], 0), np.maximum(across - half[1], 0))
        assert gap.min() >= o[2] - 2e-3
    corner = np.abs(centre[1]) + half[0] * np.abs(sin) + half[1] * cos
    assert corner.max() <= 5.0 + 2e-3


def arc_field(rows, curvature):
    rows = np.array(rows)
    ends = np.array([0.0, 70.0])
    columns = rows[:, 0], rows[:, 1], rows[:, 2]
    room = 5.0 * np.ones(2)
    return FrenetObstacles(*columns, ends, room, -room, np.full(2, curvature))


@pytest.mark.parametrize("curvature", [1.0 / 25.0, -1.0 / 25.0])
@pytest.mark.parametrize("method", METHODS)
def test_on_an_arc_distances_are_those_of_the_plane(method, curvature):
    rows = [[18.0, -1.5, 0.8], [36.0, 1.5, 0.8]]
    limits = SmoothingSettings(max_curvature=0.2)
    planned = plan(method, arc_field(rows, curvature), BODY, smoothing=limits)
    assert planned.status is LatticeStatus.OK
    road = ReferencePath.from_segments([arc(75.0, curvature)])
    s, l, slope, second = dense_points(planned.path)
    at = road.at(s)
    x, y = at.x - l * at.sin_heading, at.y + l * at.cos_heading
    heading = at.heading + np.arctan2(slope, 1.0 - curvature * l)
    for offset in BODY.offsets:
        disc = x + offset * np.cos(heading), y + offset * np.sin(heading)
        for o in rows:
            foot = road.at(o[0])
            other = foot.x - o[1] * foot.sin_heading, foot.y + o[1] * foot.cos_heading
            gap = np.hypot(disc[0] - other[0], disc[1] - other[1])
            assert gap.min() >= o[2] + BODY.radius - 0.01  # the series' third order
    # The curvature by differences of the heading in the plane.
    way = np.hypot(np.diff(x), np.diff(y))
    assert np.abs(np.diff(heading) / way).max() <= 0.2 + 1e-3
    assert np.abs(second).max() > 0.0


def test_curvature_bounds_are_on_the_safe_side():
    random = np.random.default_rng(3)
    l, slope = random.uniform(-3.0, 3.0, 400), random.uniform(-0.6, 0.6, 400)
    curvature, none = random.uniform(-0.05, 0.05, 400), np.empty((0, 400))
    road = RoadAlong(curvature, np.zeros(400), none, none, none, none)
    low, high = second_bounds(
        PathGuess.of(np.arange(400.0), l, slope), road, np.full(400, 0.2)
    )
    for k in range(400):
        for second in (low[k], high[k]):
            bent = path_curvature(l[k], slope[k], second, curvature[k], 0.0)
            assert abs(bent) <= 0.2 + 1e-12


def test_knot_spacing_does_not_change_the_answer():
    field = straight_field(np.array([[25.0, 0.5, 1.0]]), 5.0, 60.0)
    ends = []
    for step in (0.5, 0.25):
        path = plan("adaptive", field, smoothing=SmoothingSettings(knot_step=step)).path
        ends.append(np.interp(np.arange(0.0, 60.0, 2.5), path.s, path.l))
    assert np.abs(ends[0] - ends[1]).max() < 0.02


def test_smoothing_costs_less_than_the_coarse_path_where_nothing_binds():
    start = PathStart(0.0, 2.0, 0.0, 0.0)
    planned = plan("adaptive", straight_field(np.empty((0, 3)), 5.0, 60.0), start=start)
    s = planned.path.s
    coarse = planned.search.path.at(s)

    def cost(l, slope, second):
        weights = SmoothingSettings()
        third = np.diff(second) / np.diff(s)
        density = (
            weights.coarse_weight * (l - coarse[0]) ** 2
            + weights.smoothness_weight * (slope**2 + second**2)
            + weights.offset_weight * l**2
        )
        return np.trapezoid(density, s) + 1000.0 * np.sum(third**2 * np.diff(s))

    path = planned.path
    assert cost(path.l, path.slope, path.second) < cost(*coarse)


def test_the_start_is_kept():
    start = PathStart(0.0, 1.0, 0.1, 0.02)
    field = straight_field(np.array([[30.0, 0.0, 1.0]]), 5.0, 60.0)
    path = plan("adaptive", field, start=start).path
    first = [path.l[0], path.slope[0], path.second[0]]
    assert first == pytest.approx(start[1:], abs=1e-9)


def test_slack_is_used_only_where_it_is_allowed_and_is_reported():
    field = straight_field(np.array([[14.0, 0.5, 1.0]]), 5.0, 60.0)
    coarse = plan("adaptive", field).search.path
    # The obstacle grows after the coarse path was found, beyond the road and a little.
    narrow = straight_field(np.array([[14.0, 0.5, 7.0]]), 5.0, 60.0)
    hard = smooth(narrow, DISC, coarse, SmoothingSettings())
    assert hard.path is None
    assert hard.status in {"tube_empty", "infeasible"}
    grown = straight_field(np.array([[14.0, 0.5, 1.05]]), 5.0, 60.0)
    tight = SmoothingSettings(max_curvature=0.02)
    assert smooth(grown, DISC, coarse, tight).status == "infeasible"
    soft = smooth(grown, DISC, coarse, replace(tight, allowed_slack=2.0))
    assert soft.path is not None
    assert 0.0 < soft.slack <= 2.0
    assert soft.check.clearance < 0.0


def test_own_solver_agrees_with_another():
    field = straight_field(np.array([[20.0, 1.0, 1.0], [38.0, -2.0, 1.5]]), 5.0, 60.0)
    coarse = plan("adaptive", field, BODY).search.path
    s = np.linspace(0.0, 60.0, 121)
    l, slope, _ = coarse.at(s)
    problem = smoothing_problem(
        field, BODY, STILL, PathGuess.of(s, l, slope), l, SmoothingSettings()
    )
    own, other = solve(problem), solve(problem, solver="clarabel")
    assert own.objective == pytest.approx(other.objective, rel=1e-6)


BAD = {
    "none": np.empty((0, 3)),
    "overlapping": [[20.0, 0.0, 1.0], [20.0, 0.0, 1.0], [20.5, 0.3, 2.0]],
    "across the road": [[30.0, l, 2.0] for l in (-4.0, -1.0, 2.0, 5.0)],
    "behind": [[-20.0, 0.0, 2.0], [-3.0, 0.5, 1.0]],
    "beyond": [[90.0, 0.0, 2.0]],
    "on the edge": [[25.0, 5.0, 1.0], [40.0, -5.0, 1.0]],
    "on the ego": [[0.5, 0.2, 1.0]],
    "two hundred": np.random.default_rng(1).uniform(
        [8.0, -5.0, 0.1], [55.0, 5.0, 0.4], (200, 3)
    ),
}
STARTS = [
    STILL,
    PathStart(0.0, 4.9, 0.0, 0.0),
    PathStart(0.0, -7.0, 0.0, 0.0),
    PathStart(0.0, 1.0, 1.5, 0.0),
    PathStart(0.0, 0.0, 0.0, 0.6),
]


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("cover", [DISC, BODY], ids=["disc", "body"])
@pytest.mark.parametrize("method", METHODS)
def test_odd_fields_give_a_path_or_a_reason(method, cover, start, case):
    field = straight_field(np.asarray(BAD[case]), 5.0, 70.0)
    planned = plan(method, field, cover, start)
    if planned.status is LatticeStatus.OK:
        assert planned.path is not None
        assert planned.reason == ""
    else:
        assert planned.reason
    if planned.path is not None:
        check = check_path(planned.path, field, cover)
        assert check.clearance >= -1e-3 - 1e-9
        assert check.curvature <= 0.5


def test_same_field_same_path():
    field = straight_field(random_layout(4, seed=3, same_size=True), 5.0, 60.0)
    first, second = plan("adaptive", field), plan("adaptive", field)
    assert first.status is LatticeStatus.OK
    assert np.array_equal(first.path.l, second.path.l)
    assert first.search.path.cost == second.search.path.cost


def test_check_measures_what_is_there():
    s = np.linspace(0.0, 20.0, 41)
    path = FrenetPath(s, np.full(41, 1.0), np.zeros(41), np.zeros(41))
    field = straight_field(np.array([[10.1, -3.0, 0.5]]), 5.0, 20.0)
    check = check_path(path, field, DISC)
    assert check.clearance == pytest.approx(math.hypot(0.025, 4.0) - 3.16, abs=1e-6)
    assert check.road_room == pytest.approx(4.0)
    assert check.curvature == 0.0
