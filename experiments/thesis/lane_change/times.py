"""Computation times of chapter 6: Table 6.1 and the random scenes."""

from collections.abc import Mapping, Sequence

import numpy as np

from experiments.thesis.claims import (
    Claim,
    Number,
    ResultTable,
    Share,
    decline,
    numbers,
    printed,
    shown,
)
from experiments.thesis.lane_change.random_scenes import (
    ALL_ORDERS,
    GRIDS,
    RULES,
    Found,
)
from experiments.thesis.lane_change.solver_times import ALL_SOLVERS, Timed, mean_over
from experiments.thesis.published import published


def time_claim(timed: list[Timed]) -> Claim:
    """Check Table 6.1 over all grids and solvers."""
    table = published().tables["6.1"]
    pairs = {
        (grid, solver): totals(timed, grid, solver)
        for grid in GRIDS
        for solver in ALL_SOLVERS
        if all(solver in case.qp for case in timed)
    }
    direct, conventional = pairs["17 x 321", "riccati"]
    return Claim(
        "6.1_time",
        table.place,
        "the direct method takes less time than DP&QP",
        printed(
            DP_QP_ms=table.value("DP&QP", "time ms"),
            ours_ms=table.value("ours", "time ms"),
            decline_percent=table.value("ours", "decline %"),
        ),
        numbers(
            DP_QP_ms=conventional,
            ours_ms=direct,
            decline_percent=decline(conventional, direct),
        ),
        direct < conventional,
        Share.count((a < b for a, b in pairs.values()), "grids and solvers"),
        "a coarse grid and a slow solver leave no difference that can be measured",
        "grid 17 x 321 and this project's own solver, mean of cases 1 and 2",
    )


def totals(timed: list[Timed], grid: str, solver: str) -> tuple[float, float]:
    """Return the times of the direct method and of DP&QP, mean of both cases [ms]."""
    qp = mean_over(timed, lambda case: case.qp[solver])
    direct = mean_over(timed, lambda case: case.direct)
    return direct + qp, mean_over(timed, lambda case: case.search[grid]) + qp


def time_table(timed: list[Timed]) -> ResultTable:
    """Tabulate Table 6.1 over grids and solvers; a solver without a time has a row."""
    rows: list[tuple[str | Number, ...]] = []
    for solver in ALL_SOLVERS:
        why = next((c.missing[solver] for c in timed if solver in c.missing), None)
        if why is not None:
            rows.append((solver, "-", why, "-", "-"))
            continue
        for grid in GRIDS:
            ours, theirs = totals(timed, grid, solver)
            rows.append(
                (
                    solver,
                    grid,
                    shown(theirs),
                    shown(ours),
                    round(decline(theirs, ours), 1),
                )
            )
    return ResultTable(
        "table_6_1_measured",
        "Table 6.1 over grids of the search (times x places) and solvers, 101 knots",
        ("solver", "grid", "DP&QP ms", "direct ms", "decline %"),
        tuple(rows),
        "Mean of cases 1 and 2, each part the shortest of some calls. The published "
        "times are of Matlab on an Intel Core i9 at 3 GHz.",
    )


def scene_times(scenes: Sequence[Found]) -> ResultTable:
    """Tabulate the time of a whole speed plan in the random scenes."""
    rows = tuple(
        (
            name,
            shown(float(np.median([one.time_ms[name] for one in scenes]))),
            shown(float(np.percentile([one.time_ms[name] for one in scenes], 95))),
        )
        for name in RULES
    )
    header = ("rule", "median ms", "95 % ms")
    return ResultTable("order_times", "A speed plan in random scenes", header, rows)


def crowd_times(crowds: Mapping[int, Sequence[Found]]) -> ResultTable:
    """Tabulate the time of a plan with several vehicles."""
    rows = tuple(
        (n, shown(float(np.median([one.time_ms[ALL_ORDERS] for one in scenes]))))
        for n, scenes in crowds.items()
    )
    title = "A speed plan among several vehicles, every order"
    return ResultTable("crowd_times", title, ("vehicles", "median ms"), rows)
