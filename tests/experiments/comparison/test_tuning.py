import json

import pytest

from experiments.comparison.tuning import candidates, document
from experiments.errors import ConfigError
from experiments.world_setup.tuned_driver import SUBLANE_FILE, TUNED_FILE, tuned_driver

KEY = "planner.settings.strategic"


def row(value, seed, travel=50.0, collisions=0, braking=1.0):
    return {
        KEY: value,
        "seed": seed,
        "arrived": travel is not None,
        "travel_time_s": travel,
        "collisions": collisions,
        "rear_max_deceleration_mps2": braking,
    }


def test_collisions_count_more_than_arrivals_and_those_more_than_time():
    table = [
        *(row(1, seed, 60.0) for seed in range(3)),
        *(row(2, seed, 50.0, collisions=seed == 0) for seed in range(3)),
        *(row(3, seed, None if seed == 0 else 40.0) for seed in range(3)),
        *(row(4, seed, 55.0, braking=None) for seed in range(3)),
    ]
    found = candidates(table)
    assert [one.settings["strategic"] for one in found] == [4, 1, 3, 2]
    assert found[2].travel_time == pytest.approx((180.0 + 40.0 + 40.0) / 3.0)
    assert found[0].braking_behind is None
    content = document(found, [0, 1, 2])
    assert content["settings"] == {"strategic": 4}
    assert len(content["candidates"]) == 4


def test_only_development_seeds_may_choose():
    with pytest.raises(ConfigError, match="seed 1000; allowed: development seeds"):
        candidates([row(1, 1000)])


def test_a_sweep_without_settings_is_refused():
    with pytest.raises(ConfigError, match="varies no settings"):
        candidates([{"seed": 1}])


@pytest.mark.parametrize("file", [TUNED_FILE, SUBLANE_FILE])
def test_the_files_hold_the_best_of_their_candidates(file):
    content = json.loads(file.read_text())
    best = min(
        content["candidates"],
        key=lambda one: (one["collided"], -one["arrived"], one["travel_time_s"]),
    )
    assert best["settings"] == content["settings"]
    chosen = tuned_driver(file)
    for name, value in content["settings"].items():
        assert getattr(chosen, name) == value
    assert (chosen.lateral_resolution > 0.0) == (file == SUBLANE_FILE)
    assert content["seeds"][1] < 1000
