"""The order of planners over populations, and the traffic of one by itself."""

import numpy as np
import pytest

from experiments.evidence.populations.ranking import (
    POPULATION,
    RELAXATION,
    flips,
    rankings,
)
from experiments.evidence.populations.traffic import sample_traffic, summary

TIME = "travel_time_s"


def rows(means, seeds=12):
    """Return rows of planners whose travel times scatter about their means."""
    rng = np.random.default_rng(0)
    return [
        {
            POPULATION: population,
            RELAXATION: 0.0,
            "label": planner,
            "planner": planner,
            "seed": seed,
            TIME: value + float(rng.normal(0.0, 1.0)),
        }
        for population, planners in means.items()
        for planner, value in planners.items()
        for seed in range(seeds)
    ]


def test_planners_that_change_places_are_found():
    found = rows({"calm": {"a": 50.0, "b": 60.0}, "urban": {"a": 60.0, "b": 50.0}})
    orders = {cell.population: cell.order for cell in rankings(found, TIME)}
    assert orders == {"calm": ("a", "b"), "urban": ("b", "a")}
    (flip,) = flips(found, TIME)
    assert (flip.first, flip.second) == ("a", "b")
    assert (flip.better, flip.worse) == ("calm", "urban")


def test_chance_alone_is_no_change_of_places():
    found = rows({"calm": {"a": 50.0, "b": 50.2}, "urban": {"a": 50.2, "b": 50.0}})
    assert flips(found, TIME) == []


def test_who_gives_up_where_it_is_slow_is_not_the_faster_one():
    found = rows({"calm": {"a": 50.0, "b": 52.0}})
    for row in found:
        if row["label"] == "a" and row["seed"] < 4:
            row[TIME] = None
    (cell,) = rankings(found, TIME)
    assert cell.seeds == 12
    assert cell.order == ("b", "a")
    longest = max(row[TIME] for row in found if row[TIME] is not None)
    kept = [row[TIME] for row in found if row["label"] == "a" and row[TIME] is not None]
    assert cell.means[1].value == pytest.approx((4 * 2 * longest + sum(kept)) / 12)


def test_many_pairs_do_not_change_places_by_chance():
    # of 45 pairs in 12 populations; one has, uncorrected, intervals on both sides of 0
    means = {f"p{k}": {f"x{n}": 50.0 for n in range(10)} for k in range(12)}
    assert flips(rows(means), TIME) == []


def test_planners_are_ranked_on_the_seeds_that_all_of_them_have():
    found = rows({"calm": {"a": 50.0, "b": 60.0}})
    found = [row for row in found if row["label"] == "a" or row["seed"] < 4]
    (cell,) = rankings(found, TIME)
    assert cell.seeds == 4


@pytest.mark.sumo
def test_aggressive_drivers_follow_closer_than_calm_ones():
    gaps = {
        name: summary([sample_traffic(name, 1, "dense")])
        for name in ("calm", "aggressive")
    }
    assert gaps["aggressive"]["median"] < 0.8 * gaps["calm"]["median"]
    assert gaps["aggressive"]["speed"] > gaps["calm"]["speed"]
    assert gaps["calm"]["distance"] > 10.0
