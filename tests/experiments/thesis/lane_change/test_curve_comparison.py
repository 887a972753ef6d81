import math
from dataclasses import replace

import numpy as np
import pytest

from experiments.thesis.lane_change.curve_comparison import (
    COSINE,
    CUBIC,
    DUBINS,
    QUINTIC,
    RAMP,
    SPLINE,
    LaneShift,
    compare_curves,
    lane_change_curves,
)
from experiments.thesis.lane_change.path_costs import (
    PathCostWeights,
    bending_cost,
    printed_cost,
    turning_cost,
)

WEIGHTS = PathCostWeights()


def held(comparison) -> dict[str, bool]:
    return {claim.text: claim.holds for claim in comparison.claims}


@pytest.mark.parametrize("length", [30.0, 60.0, 120.0])
@pytest.mark.parametrize("shift", [3.5, -3.0])
def test_which_claims_hold_does_not_hang_on_the_lane_change(length, shift):
    task = LaneShift(length=length, shift=shift, spline_c=0.2 * length, spacing=0.25)
    assert list(held(compare_curves(replace(task, dubins_radius=50.0))).values()) == [
        True,  # Dubins jumps
        True,  # the others do not
        True,  # half cosine and four points end bent
        False,  # but not the ramp and the quintic
        True,  # the B-spline ends straight
        False,  # and is not the least bent
    ]


def test_a_third_less_peak_curvature_than_the_b_spline():
    measures = compare_curves().measures
    share = measures[QUINTIC].peak_curvature / measures[SPLINE].peak_curvature
    assert share == pytest.approx(2.0 / 3.0, abs=0.01)


def test_columns_against_their_definitions():
    measures = compare_curves().measures
    dubins = measures[DUBINS]
    assert (dubins.jumps, dubins.peak_rate) == (2, math.inf)
    assert dubins.largest_jump == pytest.approx(0.01)
    for name in (COSINE, CUBIC):
        assert measures[name].end_curvature > 1e-3
    for name in (RAMP, QUINTIC, SPLINE):
        assert measures[name].start_curvature < 1e-12
    for name, curve in lane_change_curves(LaneShift()).items():
        assert measures[name].length == pytest.approx(
            float(np.hypot(np.diff(curve.x), np.diff(curve.y)).sum()), abs=1e-5
        )
        # two S-bends: the heading goes up to its peak and back
        turned = 2.0 * np.abs(curve.heading).max()
        expected = WEIGHTS.turning * turned + WEIGHTS.length * curve.length
        assert measures[name].cost_turning == pytest.approx(expected, abs=3e-3)


def test_costs_of_an_arc_in_closed_form():
    radius, angle = 20.0, 1.2
    t = np.linspace(0.0, angle, 2001)
    x, y, distance = radius * np.sin(t), radius * (1 - np.cos(t)), radius * t
    length = radius * angle
    weights = PathCostWeights(bending=3.0, turning=2.0, length=0.5)
    bent = bending_cost(distance, np.full_like(t, 1 / radius), weights)
    assert bent == pytest.approx(3.0 * length / radius**2 + 0.5 * length)
    assert turning_cost(x, y, weights) == pytest.approx(
        2.0 * angle + 0.5 * length, rel=1e-3
    )


def test_without_ds_the_cost_grows_with_the_number_of_points():
    coarse, fine = (
        lane_change_curves(LaneShift(spacing=h))[SPLINE] for h in (0.5, 0.05)
    )
    lengthless = PathCostWeights(length=0.0)
    assert printed_cost(fine.x, fine.y, lengthless) > 9.0 * printed_cost(
        coarse.x, coarse.y, lengthless
    )
    assert turning_cost(fine.x, fine.y, lengthless) == pytest.approx(
        turning_cost(coarse.x, coarse.y, lengthless), rel=0.02
    )


def test_total_turning_prefers_the_sharpest_path_and_bending_does_not():
    tight, wide = (
        lane_change_curves(LaneShift(dubins_radius=r))[DUBINS] for r in (5.0, 200.0)
    )
    assert turning_cost(tight.x, tight.y, WEIGHTS) < turning_cost(
        wide.x, wide.y, WEIGHTS
    )
    assert bending_cost(tight.distance, tight.curvature, WEIGHTS) > bending_cost(
        wide.distance, wide.curvature, WEIGHTS
    )
