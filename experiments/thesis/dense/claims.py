"""The claims of chapter 5, each on the picked and on the random layouts."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from experiments.thesis.claims import (
    Claim,
    Number,
    Share,
    decline,
    numbers,
    printed,
    shown,
)
from experiments.thesis.dense.methods import Measured
from experiments.thesis.dense.study import FEWER, MORE, Studied
from experiments.thesis.published import published

COUNTS = (1, 2, 3, 4)
Groups = Mapping[tuple[int, bool], Sequence[Studied]]
Picked = Mapping[str, Mapping[str, Measured]]
RANDOM = "random layouts"
MEDIANS = "medians of random layouts, one size"
ALL_PATHS = 1365  # 15 + 6 · 15², the paths of all conventional rows of Table 5.2


def sensitivity_claims(groups: Groups) -> Iterator[Claim]:
    """Check 5.1: how much one waypoint more changes."""
    found = [one for group in groups.values() for one in group if one.layout.n > 1]
    for name, words in (
        ("uniform", "uniform sampling goes another way with one waypoint more a layer"),
        ("adaptive", "the adaptive sampling is not sensitive to the same number"),
    ):
        changed = [one.changed[name] for one in found]
        there = [c for c in changed if c is not None]
        wanted = name == "uniform"
        yield Claim(
            f"5.1_sensitivity_{name}",
            "5.1, Figure 5.1",
            words,
            printed(waypoints=FEWER, against=MORE),
            {"layouts with both paths": len(there), "other sides": sum(there)},
            None,
            Share.count((c is wanted for c in there), f"{RANDOM} of 2 to 4 obstacles"),
            "most layouts leave one way that is clearly the cheapest; the published "
            "figure shows one in which two are close",
            "random layouts",
        )


def sampling_claims(groups: Groups) -> Iterator[Claim]:
    """Check 5.4.3 and 5.7.1: numbers of waypoints and paths."""
    everything = [one for group in groups.values() for one in group]
    yield Claim(
        "5.5_occupied",
        "5.4.3, Figure 5.5",
        "no waypoints are sampled within regions that obstacles occupy",
        {},
        {
            "waypoints": sum(one.waypoints["adaptive"] for one in everything),
            "of these where the discs touch": sum(one.occupied for one in everything),
        },
        None,
        Share.count((one.occupied == 0 for one in everything), RANDOM),
        "an even layer between obstacles does not know how far a large one reaches, "
        "and merged obstacles are beside their layer",
        "random layouts",
    )
    yield Claim(
        "5.2_paths",
        "Table 5.2, Figure 5.8",
        "the conventional number of paths does not change",
        {"paths": ALL_PATHS},
        {"paths": max(one.methods["uniform"].edges for one in everything)},
        None,
        Share.count(
            (one.methods["uniform"].edges == ALL_PATHS for one in everything), RANDOM
        ),
        "see the layouts",
        "random layouts",
    )
    yield from _counting_claims(groups)


def _counting_claims(groups: Groups) -> Iterator[Claim]:
    """Check Figures 5.7 and 5.8."""
    text = published().text
    for key, field, fewer, n in (
        ("fewer_waypoints_below", "waypoints", True, 2),
        ("more_waypoints_with", "waypoints", False, 4),
        ("more_paths_from", "paths", False, 2),
    ):
        group = groups[n, True]
        pairs = [_counts(one, field) for one in group]
        outcomes = [(a < b) is fewer and a != b for a, b in pairs]
        yield Claim(
            f"5.7.1_{key}",
            text[key].place,
            f"with {n} obstacles the adaptive method has "
            f"{'fewer' if fewer else 'more'} {field}",
            {},
            numbers(
                adaptive=float(np.median([a for a, _ in pairs])),
                conventional=float(np.median([b for _, b in pairs])),
            ),
            None,
            Share.count(outcomes, f"{RANDOM} of {_obstacles(n)}, one size"),
            "m, U and the rounding are not given; with m = 20 and U = 4 the number "
            "depends on how much of the road is closed",
            MEDIANS,
        )


def _counts(one: Studied, field: str) -> tuple[int, int]:
    """Count waypoints or paths: (adaptive, conventional)."""
    if field == "waypoints":
        return one.waypoints["adaptive"], one.waypoints["uniform"]
    return one.methods["adaptive"].edges, one.methods["uniform"].edges


def effectiveness_claims(groups: Groups) -> Iterator[Claim]:
    """Check Table 5.2, a row of each number of obstacles."""
    table = published().tables["5.2"]
    for n in COUNTS:
        group = groups[n, True]
        ours = [100.0 * one.methods["adaptive"].effectiveness for one in group]
        theirs = [100.0 * one.methods["uniform"].effectiveness for one in group]
        told = table.value(f"{n} adaptive", "effectiveness %")
        told_theirs = table.value(f"{n} conventional", "effectiveness %")
        medians = numbers(
            adaptive=float(np.median(ours)), conventional=float(np.median(theirs))
        )
        means = numbers(
            adaptive_mean=float(np.mean(ours)), conventional_mean=float(np.mean(theirs))
        )
        trials = f"{RANDOM} of {_obstacles(n)}, one size"
        yield Claim(
            f"5.2_{n}_higher",
            table.place,
            f"{_obstacles(n)}: the adaptive sampling is the more effective one",
            printed(adaptive=told, conventional=told_theirs),
            {**medians, **means},
            None,
            Share.count((a > b for a, b in zip(ours, theirs, strict=True)), trials),
            "in some layouts the obstacles are in nobody's way",
            MEDIANS,
        )
        yield Claim(
            f"5.2_{n}_as_high",
            table.place,
            f"{_obstacles(n)}: the effectiveness of the adaptive method is as high as "
            "published",
            printed(adaptive=told),
            numbers(adaptive=float(np.median(ours)), mean=float(np.mean(ours))),
            None,
            Share.count((shown(a) >= told for a in ours), trials),
            "not every layout is as easy as the published one seems to have been: the "
            "mean is lower than the median",
            MEDIANS,
        )
    yield _declining(groups)


def _obstacles(n: int) -> str:
    """Count in words."""
    return "1 obstacle" if n == 1 else f"{n} obstacles"


def _declining(groups: Groups) -> Claim:
    """Check that the conventional method gets worse with every obstacle."""
    table = published().tables["5.2"]
    medians = [
        float(
            np.median([one.methods["uniform"].effectiveness for one in groups[n, True]])
        )
        for n in COUNTS
    ]
    falls = all(a > b for a, b in pairwise(medians))
    return Claim(
        "5.2_conventional_declines",
        "5.7.1, Table 5.2",
        "the effectiveness of the conventional method falls with every obstacle",
        {
            f"{_obstacles(n)} %": table.value(f"{n} conventional", "effectiveness %")
            for n in COUNTS
        },
        {
            f"{_obstacles(n)} %": shown(100.0 * median)
            for n, median in zip(COUNTS, medians, strict=True)
        },
        falls,
        None,
        "" if falls else "too few layouts to tell",
        MEDIANS,
    )


def comparison_claims(picked: Picked, groups: Groups) -> Iterator[Claim]:
    """Check Tables 5.3 and 5.5: length and largest heading."""
    for number, same in (("5.3", True), ("5.5", False)):
        table = published().tables[number]
        rows = picked[number]
        ours, theirs = rows["adaptive"], rows["uniform"]
        pairs = [
            (one.methods["adaptive"], one.methods["uniform"])
            for one in groups[4, same]
            if one.methods["adaptive"].solved and one.methods["uniform"].solved
        ]
        fields = (
            ("length", "length m", "length decline %", "path is shorter"),
            ("max_heading", "heading rad", "heading decline %", "heading is lower"),
        )
        for field, column, rate, words in fields:
            a, b = getattr(ours, field), getattr(theirs, field)
            yield Claim(
                f"{number}_{field}",
                table.place,
                f"{'one size' if same else 'different sizes'}: the adaptive {words}",
                printed(
                    adaptive=table.value("adaptive", column),
                    conventional=table.value("conventional", column),
                    decline_percent=_corrected(
                        number, table.value("conventional", rate)
                    ),
                ),
                numbers(
                    adaptive=a,
                    conventional=b,
                    sides=getattr(rows["sides"], field),
                    decline_percent=decline(b, a),
                    median_decline_on_random_layouts_percent=float(
                        np.median(
                            [
                                decline(getattr(y, field), getattr(x, field))
                                for x, y in pairs
                            ]
                            or [0.0]
                        )
                    ),
                ),
                a < b,
                Share.count(
                    (getattr(x, field) < getattr(y, field) for x, y in pairs),
                    f"{RANDOM} of 4 obstacles that both solve",
                ),
                "the smoothing starts from a coarse path of seven layers in one and of "
                "the obstacles' own layers in the other; neither minimises this",
            )


def _corrected(table: str, rate: float) -> Number:
    """Return the decline that follows from the table if the printed one is a slip."""
    for slip in published().slips:
        if f"Table {table}" in slip.place and slip.printed == rate:
            return slip.right
    return rate


def time_claims(picked: Picked) -> tuple[Claim, ...]:
    """Check the run times of Tables 5.3 and 5.5."""
    claims = []
    for number in ("5.3", "5.5"):
        table = published().tables[number]
        ours, theirs = (picked[number][n].run_time for n in ("adaptive", "uniform"))
        claims.append(
            Claim(
                f"{number}_time",
                table.place,
                "the adaptive method takes a little longer",
                printed(
                    adaptive_ms=table.value("adaptive", "time ms"),
                    conventional_ms=table.value("conventional", "time ms"),
                    rise_percent=-table.value("conventional", "time decline %"),
                ),
                numbers(
                    adaptive_ms=ours,
                    conventional_ms=theirs,
                    rise_percent=-decline(theirs, ours),
                ),
                ours > theirs,
                None,
                "in compiled code the number of edges decides, and here the adaptive "
                "method has fewer of them or they are cheaper to check",
            )
        )
    return tuple(claims)
