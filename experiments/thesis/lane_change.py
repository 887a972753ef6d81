"""Chapter 6 recomputed: Figures 6.2, 6.3, 6.7-6.9, Table 6.1, and random scenes."""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from experiments.thesis.claims import (
    Chapter,
    Claim,
    Number,
    Picture,
    ResultTable,
    Series,
    Share,
    decline,
    numbers,
    printed,
    shown,
)
from experiments.thesis.effort import Effort, Work
from experiments.thesis.lane_change_claims import (
    CANDIDATES,
    candidate_paths,
    case_claims,
    curve_claims,
    path_claim,
)
from experiments.thesis.published import published
from experiments.thesis.speed import START_SPEEDS
from experiments.thesis.speed_cases import SpeedCase, solve_case
from experiments.thesis.speed_scenes import (
    ALL_ORDERS,
    AREA,
    GRIDS,
    RULES,
    SETTINGS,
    Asked,
    Found,
    dp_name,
    same_cost,
    study_scene,
)
from experiments.thesis.speed_times import ALL_SOLVERS, Timed, mean_over, time_cases
from planner.geometry.curve_comparison import (
    LaneShift,
    compare_curves,
    lane_change_curves,
)
from planner.lane_change.speed_program import knot_times
from planner.states import FloatArray

ONE_OR_MORE = (1, 4)  # vehicles of the random scenes
CROWDS = range(1, 9)  # vehicles of the scenes of 7.1.1
ALL_TRIED_UP_TO = 6  # vehicles for which all orders are tried by brute force
EVERY = 5  # points of a curve that are drawn
REPEATS = 3  # of each timed plan


def lane_change_chapter(effort: Effort, work: Work) -> Chapter:
    """Recompute chapter 6."""
    scenes = work.map("random scenes", study_scene, _scenes(effort))
    crowds = {
        n: work.map(f"scenes of {n} vehicles", study_scene, _crowd(n, effort))
        for n in CROWDS
    }
    (timed,) = work.map("run times", time_cases, [effort.timing_repeats])
    cases = [solve_case(speed) for speed in START_SPEEDS]
    missing = sorted({why for case in timed for why in case.missing.values()})
    return Chapter(
        "lane_change",
        6,
        "Changing lanes",
        {
            "random scenes drawn": effort.scenes,
            "scenes a number of vehicles": effort.crowds,
        },
        (*curve_claims(), path_claim(), *case_claims(cases), *_order_claims(scenes)),
        (_curve_table(), _case_table(cases), _order_table(scenes)),
        (_crowd_table(crowds),),
        (_time_claim(timed),),
        (_time_table(timed), _scene_times(scenes), _crowd_times(crowds)),
        tuple(missing),
        (*_curve_pictures(), _path_picture(), *_case_pictures(cases)),
    )


def _scenes(effort: Effort) -> list[Asked]:
    """Ask for the random scenes, one to four vehicles in turn."""
    low, high = ONE_OR_MORE
    return [
        Asked(seed, low + seed % (high - low + 1), REPEATS)
        for seed in range(effort.scenes)
    ]


def _crowd(n: int, effort: Effort) -> list[Asked]:
    """Ask for scenes of n vehicles."""
    tried = n <= ALL_TRIED_UP_TO
    return [Asked(1000 + k, n, 1, tried) for k in range(effort.crowds)]


def _solvable(scenes: Iterable[Found]) -> list[Found]:
    """Keep scenes that leave a choice between orders, one of which can be driven."""
    return [
        one for one in scenes if one.orders > 1 and math.isfinite(one.cost[ALL_ORDERS])
    ]


def _order_claims(scenes: Sequence[Found]) -> Iterable[Claim]:
    """Check how often the direct method and the search find the best order."""
    found = _solvable(scenes)
    for name, words, reason in (
        (
            AREA,
            "the area of the convex spaces tells the better region (eq. 6.18)",
            "the area knows nothing of the wished speed and of comfort, and with "
            "several vehicles each is judged alone",
        ),
        (
            dp_name("17 x 321"),
            "DP&QP, the conventional method, finds the best passing order",
            "the grid's speeds are multiples of its spacing, and a node keeps one "
            "predecessor only",
        ),
        (
            ALL_ORDERS,
            "solving every order that can be reached finds the best one",
            "",
        ),
    ):
        hits = [same_cost(one.cost[name], one.cost[ALL_ORDERS]) for one in found]
        yield Claim(
            f"6.4.2_{name.replace(' ', '_')}",
            "6.4.2, 6.6" if name != ALL_ORDERS else "7.1.1",
            words,
            {},
            {"scenes": len(found), "best order": sum(hits)},
            None,
            Share.count(hits, "random scenes of 1 to 4 vehicles that leave a choice"),
            reason,
            "random scenes",
        )


def _order_table(scenes: Sequence[Found]) -> ResultTable:
    """Lay out how often each rule picks the best order, and what the rest costs."""
    found = _solvable(scenes)
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


def _curve_table() -> ResultTable:
    """Lay out Figures 6.2 and 6.3 in numbers."""
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


def _case_table(cases: Sequence[SpeedCase]) -> ResultTable:
    """Lay out cases 1 and 2."""
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


def _crowd_table(crowds: Mapping[int, Sequence[Found]]) -> ResultTable:
    """Lay out how the tree of orders copes with several vehicles."""
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


def _time_claim(timed: list[Timed]) -> Claim:
    """Check Table 6.1 over all grids and solvers."""
    table = published().tables["6.1"]
    pairs = {
        (grid, solver): _totals(timed, grid, solver)
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


def _totals(timed: list[Timed], grid: str, solver: str) -> tuple[float, float]:
    """Time of the direct method and of DP&QP, mean of both cases [ms]."""
    qp = mean_over(timed, lambda case: case.qp[solver])
    direct = mean_over(timed, lambda case: case.direct)
    return direct + qp, mean_over(timed, lambda case: case.search[grid]) + qp


def _time_table(timed: list[Timed]) -> ResultTable:
    """Lay out Table 6.1 over grids and solvers; a solver without a time has a row."""
    rows: list[tuple[str | Number, ...]] = []
    for solver in ALL_SOLVERS:
        why = next((c.missing[solver] for c in timed if solver in c.missing), None)
        if why is not None:
            rows.append((solver, "-", why, "-", "-"))
            continue
        for grid in GRIDS:
            ours, theirs = _totals(timed, grid, solver)
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


def _scene_times(scenes: Sequence[Found]) -> ResultTable:
    """Lay out the time of a whole speed plan in the random scenes."""
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


def _crowd_times(crowds: Mapping[int, Sequence[Found]]) -> ResultTable:
    """Lay out the time of a plan with several vehicles."""
    rows = tuple(
        (n, shown(float(np.median([one.time_ms[ALL_ORDERS] for one in scenes]))))
        for n, scenes in crowds.items()
    )
    title = "A speed plan among several vehicles, every order"
    return ResultTable("crowd_times", title, ("vehicles", "median ms"), rows)


def _curve_pictures() -> Iterable[Picture]:
    """Make Figures 6.2 and 6.3."""
    curves = lane_change_curves(LaneShift())
    ways = [_series(n, c.x[::EVERY], c.y[::EVERY]) for n, c in curves.items()]
    yield Picture("fig_6.2", "Fig. 6.2: curve models", "x m", "y m", tuple(ways))
    bends = [
        _series(n, c.distance[::EVERY], c.curvature[::EVERY]) for n, c in curves.items()
    ]
    title = "Fig. 6.3: their curvature"
    yield Picture("fig_6.3", title, "distance m", "curvature 1/m", tuple(bends))


def _path_picture() -> Picture:
    """Make Figure 6.7: some candidates, and the one that is chosen."""
    paths = candidate_paths()
    best = min(paths, key=lambda path: path.cost)
    some = [p for p in paths if p.ratio == CANDIDATES[0] and p is not best]
    chosen = [(f"{p.length:g} m", p) for p in some] + [("chosen", best)]
    series = tuple(
        _series(n, p.curve.x[::EVERY], p.curve.y[::EVERY]) for n, p in chosen
    )
    title = "Fig. 6.7: candidates of different length, and the chosen path"
    return Picture("fig_6.7", title, "x m", "y m", series)


def _case_pictures(cases: Sequence[SpeedCase]) -> Iterable[Picture]:
    """Make Figures 6.8 and 6.9: s-T, speed, acceleration and jerk."""
    times = knot_times(SETTINGS)
    for number, case in enumerate(cases):
        profile, graph = case.plan.profile, case.plan.graph
        if profile is None:
            continue
        figure, hit = f"6.{8 + number}", graph.hit[0]
        ways = (
            _series("ego", times, profile.distance),
            _series("car, rear", times[hit], graph.lower[0][hit]),
            _series("car, front", times[hit], graph.upper[0][hit]),
        )
        title = f"Fig. {figure} (a), case {number + 1}: s-T graph"
        yield Picture(f"fig_{figure}a", title, "t s", "s m", ways)
        for part, words, unit, values in (
            ("b", "speed", "m/s", profile.speed),
            ("c", "acceleration", "m/s²", profile.acceleration),
            ("d", "jerk", "m/s³", profile.jerk),
        ):
            title = f"Fig. {figure} ({part}), case {number + 1}: {words}"
            line = (_series(words, times, values),)
            yield Picture(f"fig_{figure}{part}", title, "t s", f"{words} {unit}", line)


def _series(name: str, x: FloatArray, y: FloatArray) -> Series:
    """Make a line of a picture."""
    return Series(name, tuple(map(shown, x.tolist())), tuple(map(shown, y.tolist())))
