"""Chapter 6 recomputed: Figures 6.2, 6.3, 6.7-6.9, Table 6.1, and random scenes."""

from collections.abc import Iterable, Sequence

from experiments.sweep.processes.parallel import Work
from experiments.thesis.claims import (
    Chapter,
    Claim,
    Share,
)
from experiments.thesis.effort import Effort
from experiments.thesis.lane_change.claims import (
    case_claims,
    curve_claims,
    path_claim,
)
from experiments.thesis.lane_change.figures import (
    case_pictures,
    curve_pictures,
    path_picture,
)
from experiments.thesis.lane_change.published_cases import solve_case
from experiments.thesis.lane_change.random_scenes import (
    ALL_ORDERS,
    AREA,
    Asked,
    Found,
    dp_name,
    same_cost,
    study_scene,
)
from experiments.thesis.lane_change.solver_times import time_cases
from experiments.thesis.lane_change.speed_study import START_SPEEDS
from experiments.thesis.lane_change.tables import (
    case_table,
    crowd_table,
    curve_table,
    order_table,
    solvable,
)
from experiments.thesis.lane_change.times import (
    crowd_times,
    scene_times,
    time_claim,
    time_table,
)

ONE_OR_MORE = (1, 4)  # vehicles of the random scenes
CROWDS = range(1, 9)  # vehicles of the scenes of 7.1.1
ALL_TRIED_UP_TO = 6  # vehicles for which all orders are tried by brute force
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
        (curve_table(), case_table(cases), order_table(scenes)),
        (crowd_table(crowds),),
        (time_claim(timed),),
        (time_table(timed), scene_times(scenes), crowd_times(crowds)),
        tuple(missing),
        (*curve_pictures(), path_picture(), *case_pictures(cases)),
    )


def _scenes(effort: Effort) -> list[Asked]:
    """Describe the random scenes, with one to four vehicles in turn."""
    low, high = ONE_OR_MORE
    return [
        Asked(seed, low + seed % (high - low + 1), REPEATS)
        for seed in range(effort.scenes)
    ]


def _crowd(n: int, effort: Effort) -> list[Asked]:
    """Describe scenes of n vehicles."""
    tried = n <= ALL_TRIED_UP_TO
    return [Asked(1000 + k, n, 1, tried) for k in range(effort.crowds)]


def _order_claims(scenes: Sequence[Found]) -> Iterable[Claim]:
    """Check how often the direct method and the search find the best order."""
    found = solvable(scenes)
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
