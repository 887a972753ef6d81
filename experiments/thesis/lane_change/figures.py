"""Figures 6.2, 6.3 and 6.7 to 6.9."""

from collections.abc import Iterable, Sequence

from experiments.thesis.claims import (
    Picture,
    Series,
    shown,
)
from experiments.thesis.lane_change.claims import (
    CANDIDATES,
    candidate_paths,
)
from experiments.thesis.lane_change.curve_comparison import (
    LaneShift,
    lane_change_curves,
)
from experiments.thesis.lane_change.published_cases import SpeedCase
from experiments.thesis.lane_change.random_scenes import (
    SETTINGS,
)
from planner.lane_change.speed.program import knot_times
from planner.states import FloatArray

EVERY = 5  # points of a curve that are drawn


def curve_pictures() -> Iterable[Picture]:
    """Build Figures 6.2 and 6.3."""
    curves = lane_change_curves(LaneShift())
    ways = [one_line(n, c.x[::EVERY], c.y[::EVERY]) for n, c in curves.items()]
    yield Picture("fig_6.2", "Fig. 6.2: curve models", "x m", "y m", tuple(ways))
    bends = [
        one_line(n, c.distance[::EVERY], c.curvature[::EVERY])
        for n, c in curves.items()
    ]
    title = "Fig. 6.3: their curvature"
    yield Picture("fig_6.3", title, "distance m", "curvature 1/m", tuple(bends))


def path_picture() -> Picture:
    """Build Figure 6.7: some candidates, and the one that is chosen."""
    paths = candidate_paths()
    best = min(paths, key=lambda path: path.cost)
    some = [p for p in paths if p.ratio == CANDIDATES[0] and p is not best]
    chosen = [(f"{p.length:g} m", p) for p in some] + [("chosen", best)]
    series = tuple(
        one_line(n, p.curve.x[::EVERY], p.curve.y[::EVERY]) for n, p in chosen
    )
    title = "Fig. 6.7: candidates of different length, and the chosen path"
    return Picture("fig_6.7", title, "x m", "y m", series)


def case_pictures(cases: Sequence[SpeedCase]) -> Iterable[Picture]:
    """Build Figures 6.8 and 6.9: s-T, speed, acceleration and jerk."""
    times = knot_times(SETTINGS)
    for number, case in enumerate(cases):
        profile, graph = case.plan.profile, case.plan.graph
        if profile is None:
            continue
        figure, hit = f"6.{8 + number}", graph.hit[0]
        ways = (
            one_line("ego", times, profile.distance),
            one_line("car, rear", times[hit], graph.lower[0][hit]),
            one_line("car, front", times[hit], graph.upper[0][hit]),
        )
        title = f"Fig. {figure} (a), case {number + 1}: s-T graph"
        yield Picture(f"fig_{figure}a", title, "t s", "s m", ways)
        for part, words, unit, values in (
            ("b", "speed", "m/s", profile.speed),
            ("c", "acceleration", "m/s²", profile.acceleration),
            ("d", "jerk", "m/s³", profile.jerk),
        ):
            title = f"Fig. {figure} ({part}), case {number + 1}: {words}"
            line = (one_line(words, times, values),)
            yield Picture(f"fig_{figure}{part}", title, "t s", f"{words} {unit}", line)


def one_line(name: str, x: FloatArray, y: FloatArray) -> Series:
    """Build a line of a picture."""
    return Series(name, tuple(map(shown, x.tolist())), tuple(map(shown, y.tolist())))
