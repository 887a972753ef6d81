"""The claims of chapter 4, each on the picked and on the random layouts."""

from collections.abc import Iterator, Sequence

from experiments.thesis.claims import Claim, Share, decline, numbers, printed
from experiments.thesis.cruise.claims_over_time import BACK, RoadDrives
from experiments.thesis.cruise.drives import (
    CONVENTIONAL,
    JERK_AND_SAFETY,
    ONLY_JERK,
    PROPOSED,
    Driven,
)
from experiments.thesis.published import published

JERK_REASON = (
    "the offset term asks for more steering than the conventional cost, which drifts "
    "aside once and stays there; each term is divided by its maximum in the cycle"
)


def comparison_claims(drives: RoadDrives) -> Iterator[Claim]:
    """Check one road of Table 4.2."""
    table = published().tables["4.2"]
    for name, reason in (
        ("offset", "now and then both go the same way round everything"),
        ("jerk", JERK_REASON),
    ):
        column = f"J_{name}"
        field = f"mean_{name}"
        ours, theirs = (
            getattr(drives.picked[method], field) for method in (PROPOSED, CONVENTIONAL)
        )
        rows = f"{drives.road} {PROPOSED}", f"{drives.road} {CONVENTIONAL}"
        better = [getattr(a, field) < getattr(b, field) for a, b in drives.pairs()]
        yield Claim(
            f"4.2_{drives.road}_{name}",
            table.place,
            f"{drives.road}: the proposed method has the lower mean {column}",
            printed(
                proposed=table.value(rows[0], column),
                conventional=table.value(rows[1], column),
                decline_percent=table.value(rows[0], f"{column} decline %"),
            ),
            numbers(
                proposed=ours,
                conventional=theirs,
                decline_percent=decline(theirs, ours),
            ),
            ours < theirs,
            Share.count(
                better, f"random layouts on road {drives.road} that both drive"
            ),
            reason,
        )


def influence_claims(roads: Sequence[RoadDrives]) -> Iterator[Claim]:
    """Check 4.7.1: what each term of the cost does."""
    straight = [road for road in roads if road.road in ("straight", "curved")]
    for name, first, second, field, words, reason in (
        (
            "safety",
            ONLY_JERK,
            JERK_AND_SAFETY,
            "clearance",
            "with jerk alone the vehicle comes closer to obstacles than with safety",
            "the kernel reaches one or two lateral samples: often both pass at the "
            "same offset",
        ),
        (
            "offset",
            PROPOSED,
            JERK_AND_SAFETY,
            "mean_offset",
            "with the offset term the vehicle stays nearer to the centre line",
            "where the way round is the same there is nothing to come back from",
        ),
    ):
        picked = [
            (getattr(r.picked[first], field), getattr(r.picked[second], field))
            for r in straight
        ]
        pairs = [pair for road in roads for pair in road.pairs(first, second)]
        yield Claim(
            f"4.7.1_{name}",
            "4.7.1, Figure 4.3",
            words,
            {},
            {
                f"{road.road}, {method}": value
                for road, pair in zip(straight, picked, strict=True)
                for method, one in zip((first, second), pair, strict=True)
                for value in numbers(x=one).values()
            },
            all(a < b for a, b in picked),
            Share.count(
                (getattr(a, field) < getattr(b, field) for a, b in pairs),
                "random layouts on four roads",
            ),
            reason,
            "picked layouts of the straight and the curved road",
        )


def size_claim(
    radii: Sequence[float], as_printed: Sequence[Driven], own: Sequence[Driven]
) -> Claim:
    """Check that the distance kept grows with the obstacle."""
    kept = [one.clearance for one in as_printed]
    ours = [one.clearance for one in own]
    return Claim(
        "4.7.1_size",
        "4.6.2, 4.7.1, 4.7.2",
        "the distance kept is commensurate with the size of the obstacle",
        {},
        numbers(
            radius_from_m=radii[0],
            radius_to_m=radii[-1],
            clearance_from_m=kept[0],
            clearance_to_m=kept[-1],
            this_project_from_m=ours[0],
            this_project_to_m=ours[-1],
        ),
        kept[-1] - kept[0] > BACK,
        None,
        "the radius only scales a term that is divided by its maximum again: as "
        "printed, size moves the choice by less than one lateral sample",
        "one obstacle that grows",
    )
