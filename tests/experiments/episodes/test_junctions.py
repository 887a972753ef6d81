"""Driving over junctions by the rules, among traffic that reacts.

`make test-slow ARGS="tests/experiments/episodes/test_junctions.py --seeds 50 -s"` runs
more seeds and prints a line for each junction.
"""

from concurrent.futures import ProcessPoolExecutor

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode

pytestmark = [pytest.mark.sumo, pytest.mark.slow]

JUNCTIONS = [
    "t_junction",
    "stop_sign",
    "all_way_stop",
    "right_before_left",
    "unprotected_left",
    "roundabout",
]


def episode(job):
    name, seed, out = job
    return run_episode(load_scenario(name, seed=seed), out=out).row


def test_every_junction_is_crossed_by_its_rules(tmp_path, pytestconfig):
    seeds = range(max(pytestconfig.getoption("--seeds") // 2, 1))
    jobs = [(name, seed, tmp_path) for name in JUNCTIONS for seed in seeds]
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(episode, jobs))
    for name in JUNCTIONS:
        own = [row for row in rows if row["scenario"] == name]
        arrived = sum(row["arrived"] for row in own)
        print(  # noqa: T201 - the table that this test is run for
            f"{name}: {arrived} of {len(own)} arrived, "
            f"{sum(row['line_violations'] for row in own)} closed lines passed, "
            f"{sum(row['encroachments'] or 0 for row in own)} hindered, "
            f"waited {sum(row['gave_way_s'] or 0.0 for row in own) / len(own):.1f} s"
        )
    assert not [row["seed"] for row in rows if row["status"] == "collision"]
    assert sum(row["line_violations"] for row in rows) == 0
    assert sum(row["arrived"] for row in rows) >= 0.99 * len(rows)


@pytest.mark.parametrize(
    ("name", "seed"), [("unprotected_left", 8), ("right_before_left", 6)]
)
def test_nobody_with_the_right_of_way_has_to_brake(name, seed, tmp_path):
    """The ego stood in the way of others: crept on inside, or crawled across."""
    scenario = load_scenario(name, planner="route", seed=seed)
    row = run_episode(scenario, out=tmp_path).row
    assert row["arrived"]
    assert row["encroachments"] == 0
