"""The roads with their default traffic: nobody is touched, nearly everyone arrives.

`make test-slow ARGS="tests/experiments/episodes/test_acceptance.py --seeds 20 -s"`
runs the full set and prints a line for each road.
"""

from concurrent.futures import ProcessPoolExecutor

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode

ROADS = ("straight", "curved", "intersection", "u_shaped")


def episode(job):
    road, seed, overrides, out = job
    scenario = load_scenario(road, seed=seed, overrides=overrides)
    return run_episode(scenario, out=out).row


def episodes(road, n_seeds, overrides, out):
    jobs = [(road, seed, overrides, out) for seed in range(n_seeds)]
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(episode, jobs))
    known = [row["min_ttc_s"] for row in rows if row["min_ttc_s"] is not None]
    print(  # noqa: T201 - the table that this test is run for
        f"\n{road} {' '.join(overrides)}: arrived {sum(r['arrived'] for r in rows)} "
        f"of {len(rows)}, collisions {sum(r['collisions'] for r in rows)}, off road "
        f"{sum(r['off_road_steps'] for r in rows)} steps, least clearance "
        f"{min(r['min_clearance_m'] for r in rows):.2f} m, least TTC "
        f"{min(known, default=float('inf')):.2f} s, fallback cycles "
        f"{sum(r['fallback_cycles'] for r in rows)} "
        f"(at most {max(r['fallback_cycles'] for r in rows)})"
    )
    return rows


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("road", ROADS)
def test_default_traffic(road, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    rows = episodes(road, n_seeds, [], tmp_path)
    assert sum(row["collisions"] for row in rows) == 0
    assert sum(row["off_road_steps"] for row in rows) == 0
    assert sum(row["arrived"] for row in rows) >= 0.95 * n_seeds


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("road", ROADS)
def test_without_traffic(road, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    rows = episodes(road, n_seeds, ["traffic=none"], tmp_path)
    assert all(row["arrived"] for row in rows)
    assert min(row["min_clearance_m"] for row in rows) >= 0.2
    assert sum(row["collisions"] + row["off_road_steps"] for row in rows) == 0
