"""The claims of chapter 6 about curves, paths and the two published cases."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.thesis.claims import Claim, numbers, printed, shown
from experiments.thesis.lane_change.curve_comparison import (
    COSINE,
    CUBIC,
    DUBINS,
    QUINTIC,
    RAMP,
    SPLINE,
    LaneShift,
    compare_curves,
)
from experiments.thesis.lane_change.curve_models import lane_change_b_spline
from experiments.thesis.lane_change.path_costs import (
    PathCostWeights,
    bending_cost,
    printed_cost,
)
from experiments.thesis.lane_change.plane_curve import Curve, sample_curve
from experiments.thesis.lane_change.published_cases import LANE, SpeedCase
from experiments.thesis.published import published

APART = 0.5  # lines that are nowhere farther apart do not differ significantly [m]
LENGTHS = (30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # of candidate paths [m]
CANDIDATES = (0.2, 0.1, 0.15, 0.25, 0.3)  # places of C over the length
MAX_JERK = 5.0  # bound of the cases [m/s³]
STEADY = 0.5  # the speed is steady if it changes by less in the last two seconds [m/s]
LAST = 20  # knots in two seconds
DIRECTIONS = "the lane change of the figure"

# What each claim of the comparison is measured by: models, field, reason if it fails.
CURVE_CLAIMS = (
    ("6.3.4_dubins", (DUBINS,), ("jumps", "largest_jump", "start_curvature"), ""),
    ("6.3.4_continuous", (COSINE, RAMP, CUBIC, QUINTIC, SPLINE), ("jumps",), ""),
    ("6.3.4_ends_bent", (COSINE, CUBIC), ("end_curvature",), ""),
    (
        "6.3.4_all_end_bent",
        (COSINE, RAMP, CUBIC, QUINTIC),
        ("end_curvature",),
        "true of the half cosine and of the Bézier curve with four points; a sine "
        "ramp and a quintic Bézier curve end straight",
    ),
    ("6.3.4_spline", (SPLINE,), ("jumps", "end_curvature"), ""),
    (
        "6.3.4_best",
        (RAMP, QUINTIC, SPLINE),
        ("peak_curvature",),
        "a quintic Bézier curve has neither fault and bends less",
    ),
)


@dataclass(frozen=True, slots=True, eq=False)
class CandidatePath:
    """One B-spline of the candidate set."""

    length: float  # [m]
    ratio: float  # place of C over the length
    curve: Curve
    cost: float  # eq. 6.11, corrected
    printed: float  # without ds

    @property
    def peak(self) -> float:
        """Largest curvature [1/m]."""
        return float(np.abs(self.curve.curvature).max())


def curve_claims() -> Iterator[Claim]:
    """Check Figures 6.2 and 6.3."""
    comparison = compare_curves(LaneShift())
    yield Claim(
        "6.3.4_paths",
        "6.3.4, Figure 6.2",
        "there is no significant difference between the paths of the curve models",
        {},
        numbers(largest_distance_m=comparison.apart),
        comparison.apart < APART,
        None,
        "half a metre is the line that is drawn here; the Dubins curve of R = 100 m "
        "turns later and sharper than the others",
        DIRECTIONS,
    )
    jumps = published().text["curvature_jumps"].value
    for found, (name, models, fields, reason) in zip(
        comparison.claims, CURVE_CLAIMS, strict=True
    ):
        measured = {
            f"{model}, {field.replace('_', ' ')}": shown(
                round(getattr(comparison.measures[model], field), 5) + 0.0
            )
            for model in models
            for field in fields
        }
        yield Claim(
            name,
            "6.3.4, Figure 6.3",
            found.text,
            printed(jumps=jumps) if models == (DUBINS,) else {},
            measured,
            found.holds,
            None,
            reason,
            DIRECTIONS,
        )


def candidate_paths() -> list[CandidatePath]:
    """Build the candidate set of 6.3.5: splines of varied length and position of C."""
    weights = PathCostWeights()
    made = []
    for length in LENGTHS:
        for ratio in CANDIDATES:
            model = lane_change_b_spline(length, LANE, ratio * length)
            curve = sample_curve(model, LaneShift().spacing)
            made.append(
                CandidatePath(
                    length,
                    ratio,
                    curve,
                    bending_cost(curve.distance, curve.curvature, weights),
                    printed_cost(curve.x, curve.y, weights),
                )
            )
    return made


def path_claim() -> Claim:
    """Check 6.3.6: whether eq. 6.11 prefers low curvature, as it says."""
    paths = [path for path in candidate_paths() if path.length == LENGTHS[3]]
    as_printed = min(paths, key=lambda path: path.printed)
    corrected = min(paths, key=lambda path: path.cost)
    peaks = [path.peak for path in paths]
    return Claim(
        "6.3.6_smooth",
        "6.3.6, eq. 6.11, Figure 6.7",
        "the cost prefers paths of low curvature among those of one length",
        {},
        numbers(
            candidates=len(paths),
            peak_curvature_of_the_choice_as_printed_1pm=as_printed.peak,
            of_the_corrected_choice_1pm=corrected.peak,
            least_1pm=min(peaks),
            largest_1pm=max(peaks),
        ),
        as_printed.peak <= float(np.median(peaks)),
        None,
        "the sum of the absolute curvature is the same for all paths that turn as "
        "far: it does not see how sharp they turn, so that length decides; the "
        "corrected cost takes the integral of the squared curvature",
        "candidates of 60 m",
    )


def case_claims(cases: Sequence[SpeedCase]) -> Iterator[Claim]:
    """Check Figures 6.8 and 6.9."""
    text = published().text
    for number, (case, region, words) in enumerate(
        zip(
            cases,
            ("B", "A"),
            (
                "yields, decelerates first and accelerates after the car has passed",
                "goes first, decelerates gradually and then accelerates",
            ),
            strict=True,
        ),
        1,
    ):
        profile = case.plan.profile
        if profile is None:
            raise ValueError(f"case {number} has no plan: {case.plan.reason}")
        v, jerk = profile.speed, np.abs(profile.jerk)
        least = int(v.argmin())
        told = text[f"case_{number}_speed"]
        yield Claim(
            f"6.5.2_case_{number}",
            told.place,
            f"case {number}: the ego {words}",
            printed(speed_at_the_start_mps=told.value),
            numbers(
                speed_at_the_start_mps=float(v[0]),
                least_mps=float(v[least]),
                greatest_after_it_mps=float(v[least:].max()),
                end_mps=float(v[-1]),
            ),
            case.region == region and bool(v[0] > v[least] < v[least:].max()),
            None,
            "the region or the course is another one",
            f"case {number}, region {case.region}",
        )
        yield Claim(
            f"6.5.2_case_{number}_smooth",
            told.place,
            f"case {number}: speed, acceleration and jerk are smooth and end steady",
            {},
            numbers(
                largest_jerk_mps3=float(jerk.max()),
                largest_step_of_the_jerk_mps3=float(
                    np.abs(np.diff(profile.jerk)).max()
                ),
                change_of_speed_in_the_last_two_seconds_mps=float(
                    abs(v[-1] - v[-1 - LAST])
                ),
            ),
            float(jerk.max()) <= MAX_JERK and abs(float(v[-1] - v[-1 - LAST])) < STEADY,
            None,
            "the acceleration is continuous and the jerk bounded, but the jerk is a "
            "step function: nothing in eq. 6.20 asks for more; and the speed is still "
            "on its way to what is wished",
            f"case {number}",
        )
