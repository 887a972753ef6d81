"""Courses of dense obstacles in SUMO, with a way through and without.

`make test-slow ARGS="tests/experiments/episodes/test_dense_driving.py --seeds 100 -s"`
runs the full set and prints a line for each.
"""

import math
from concurrent.futures import ProcessPoolExecutor

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from planner.shapes.rectangles import Rectangle, distance

LEFT = 1.0  # before what blocks the road [m]


def episode(job):
    scenario, seed, overrides, out = job
    checked = load_scenario(scenario, seed=seed, overrides=overrides)
    outcome = run_episode(checked, out=out)
    return outcome.row, outcome.ending.reason, room_left(outcome.trace)


def room_left(trace):
    """Give the distance from what the last plan says is in the way, None if nothing."""
    blocker = trace.steps["blocker"][-2]  # the last step has no plan
    fixed = trace.obstacles
    if blocker not in fixed["id"].tolist():
        return None
    i = fixed["id"].tolist().index(blocker)
    body = ("x_m", "y_m", "heading_rad", "length_m", "width_m", "radius_m")
    length, rear = trace.fact("length_m"), trace.fact("rear_overhang_m")
    x, y, heading = (float(trace.steps[name][-1]) for name in body[:3])
    forward = 0.5 * length - rear
    ego = Rectangle(
        x + forward * math.cos(heading),
        y + forward * math.sin(heading),
        heading,
        length,
        trace.fact("width_m"),
    )
    return distance(ego, Rectangle(*(float(fixed[name][i]) for name in body)))


def episodes(scenario, overrides, n_seeds, out):
    jobs = [(scenario, seed, overrides, out) for seed in range(n_seeds)]
    with ProcessPoolExecutor(2) as pool:
        done = list(pool.map(episode, jobs))
    rows = [row for row, _, _ in done]
    least = min(row["min_clearance_m"] for row in rows)
    print(  # noqa: T201 - the table that this test is run for
        f"\n{scenario} {overrides}: arrived {sum(r['arrived'] for r in rows)} of "
        f"{len(rows)}, blocked {sum(r['status'] == 'blocked' for r in rows)}, "
        f"collisions {sum(r['collisions'] for r in rows)}, off road "
        f"{sum(r['off_road_steps'] for r in rows)} steps, least clearance {least:.2f} "
        f"m, fallback cycles {sum(r['fallback_cycles'] for r in rows)}"
    )
    assert sum(row["collisions"] + row["off_road_steps"] for row in rows) == 0
    return done


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("scenario", ["dense", "dense_curved"])
def test_every_course_with_a_way_is_driven_through(scenario, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    done = episodes(scenario, [], n_seeds, tmp_path)
    assert [row["status"] for row, _, _ in done] == ["arrived"] * n_seeds


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("scenario", ["dense", "dense_curved"])
def test_every_closed_course_ends_in_a_stop(scenario, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    closed = ["obstacles.field.passable=false"]
    done = episodes(scenario, closed, n_seeds, tmp_path)
    rooms = [left for _, _, left in done if left is not None]
    print(f"room left: {min(rooms):.2f} m at least, of {len(rooms)}")  # noqa: T201
    for row, reason, left in done:
        assert row["status"] == "blocked"
        assert "found no passage beyond s = " in reason
        assert "is in the way" in reason
        assert left is not None
        assert left >= LEFT
