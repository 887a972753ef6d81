"""The tables of chapter 6."""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from experiments.thesis.claims import (
    ResultTable,
    shown,
)
from experiments.thesis.lane_change.curve_comparison import (
    compare_curves,
)
from experiments.thesis.lane_change.published_cases import SpeedCase
from experiments.thesis.lane_change.random_scenes import (
    ALL_ORDERS,
    RULES,
    Found,
    same_cost,
)


def solvable(scenes: Iterable[Found]) -> list[Found]:
    """Select scenes with a choice between orders, at least one of them feasible."""
    return [
        one for one in scenes if one.orders > 1 and math.isfinite(one.cost[ALL_ORDERS])
    ]


def order_table(scenes: Sequence[Found]) -> ResultTable:
    """Tabulate how often each rule picks the best order, and what the rest costs."""
    found = solvable(scenes)
    rows = []
    for name in RULES:
        solved = [one for one in found if math.isfinite(one.cost[name])]
        best = sum(same_cost(one.cost[name], one.cost[ALL_ORDERS]) for one in found)
        gaps = [
            100.0 * (one.cost[name] / one.cost[ALL_ORDERS] - 1.0)
            for one in solved
            if not same_cost(one.cost[name], one.cost[ALL_ORDERS])
        ]
        rows.append(
            (
                name,
                len(found),
                best,
                len(found) - len(solved),
                shown(float(np.median(gaps))) if gaps else 0,
                shown(max(gaps)) if gaps else 0,
            )
        )
    return ResultTable(
        "orders",
        "Passing orders in random scenes of 1 to 4 vehicles",
        (
            "rule",
            "scenes with a choice",
            "best order",
            "no solution",
            "cost above the best where another, median %",
            "largest %",
        ),
        tuple(rows),
        f"{len(scenes) - len(found)} of {len(scenes)} scenes are left out: only one "
        "order can be reached, or none can be driven. DP: times x places.",
    )


def curve_table() -> ResultTable:
    """Tabulate Figures 6.2 and 6.3 in numbers."""
    comparison = compare_curves()
    return ResultTable(
        "curves",
        "Figures 6.2 and 6.3: curve models for a lane change of 3.5 m over 60 m",
        (
            "model",
            "length m",
            "jumps of curvature inside",
            "curvature at the start 1/m",
            "curvature at the end 1/m",
            "peak curvature 1/m",
        ),
        tuple(
            (
                name,
                round(m.length, 3),
                m.jumps,
                round(m.start_curvature, 5) + 0.0,
                round(m.end_curvature, 5) + 0.0,
                round(m.peak_curvature, 5),
            )
            for name, m in comparison.measures.items()
        ),
        f"As lines they are at most {comparison.apart:.2f} m apart.",
    )


def case_table(cases: Sequence[SpeedCase]) -> ResultTable:
    """Tabulate cases 1 and 2."""
    rows = []
    for k, case in enumerate(cases):
        profile = case.plan.profile
        if profile is None:
            raise ValueError(f"case {k + 1} has no plan: {case.plan.reason}")
        v = profile.speed
        least = int(v.argmin())
        speeds = (v[0], v[least], v[least:].max(), v[-1])
        largest = (
            np.abs(profile.acceleration).max(),
            np.abs(profile.jerk).max(),
            case.area_a,
            case.area_b,
        )
        rows.append(
            (
                k + 1,
                case.region,
                *(shown(float(x)) for x in speeds),
                *(shown(float(x)) for x in largest),
            )
        )
    return ResultTable(
        "cases",
        "Figures 6.8 and 6.9: cases 1 and 2",
        (
            "case",
            "region",
            "speed at the start m/s",
            "least m/s",
            "greatest after it m/s",
            "end m/s",
            "largest acceleration m/s²",
            "largest jerk m/s³",
            "area A m s",
            "area B m s",
        ),
        tuple(rows),
    )


def crowd_table(crowds: Mapping[int, Sequence[Found]]) -> ResultTable:
    """Tabulate how the tree of orders copes with several vehicles."""
    rows = []
    for n, scenes in crowds.items():
        tried = [one for one in scenes if one.brute_force is not None]
        wrong = sum(
            not same_cost(one.cost[ALL_ORDERS], one.brute_force or 0.0) for one in tried
        )
        rows.append(
            (
                n,
                len(scenes),
                shown(float(np.mean([one.on_path for one in scenes]))),
                shown(float(np.mean([one.nodes for one in scenes]))),
                shown(float(np.mean([one.orders for one in scenes]))),
                sum(math.isfinite(one.cost[ALL_ORDERS]) for one in scenes),
                f"{wrong} of {len(tried)}" if tried else "not tried",
            )
        )
    return ResultTable(
        "beyond_crowds",
        "Several vehicles in speed planning (chapter 6)",
        (
            "vehicles",
            "scenes",
            "on the path, mean",
            "nodes, mean",
            "orders left to solve, mean",
            "scenes that can be driven",
            "other cost than brute force",
        ),
        tuple(rows),
        "Brute force solves all 2^m orders by another solver (piqp) and prunes "
        "nothing.",
    )
