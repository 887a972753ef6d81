"""The tables of a sweep over plants, made of hand-written run folders."""

import json
from pathlib import Path

import pytest

from experiments.cli.app import app
from experiments.comparison.inference import tango
from experiments.comparison.robustness import (
    HEAD,
    IN_ALL,
    MEASURES,
    degradation_curves,
    robustness_page,
)
from experiments.errors import ConfigError
from experiments.metrics.row import row_without_episode
from experiments.sweep.folder import run_folder


def run(folder, number, point, **values):
    row = row_without_episode("road", "p", number, "arrived") | values
    about = {"scenario": "road", "planner": "p", "seed": number, "status": "arrived"}
    about |= {"trace_hash": str(number), "attempts": 1, "wall_s": 0.5}
    about |= {"sweep": {"name": "s", "label": "p", "point": point}}
    place = run_folder(folder, f"r{number:02d}")
    place.mkdir(parents=True)
    (folder / "sweep.yaml").touch()  # the folder is that of a sweep
    (place / "manifest.json").write_text(json.dumps(about))
    (place / "metrics.json").write_text(json.dumps(row))


def test_rows_are_counted_by_point(tmp_path):
    perfect = {"ego.plant": "perfect", "ego.actuators": None}
    slow = {"ego.plant": "dynamic", "ego.actuators": "autoware"}
    for n in range(4):
        run(tmp_path, n, perfect, arrived=True, collisions=0, min_clearance_m=1.0 + n)
        run(
            tmp_path,
            10 + n,
            slow,
            arrived=n > 0,
            collisions=int(n == 0),
            min_clearance_m=0.5 * n,
            tracking_lateral_max_m=0.1 * n,
            plans_anew=1,
            verdict="shared" if n == 0 else None,
        )
    page = robustness_page([tmp_path])
    assert "## road, p" in page
    assert "| plant | actuators | runs | arrived [%] |" in page
    assert "| perfect | - | 4 | 100 | 0 | 0 | 1.00 | - | - | - |" in page
    assert "| dynamic | autoware | 4 | 75 | 25 | 1 | 0.00 | - | 0.30 | 4 |" in page


def test_points_are_compared_with_perfect_ones_on_common_seeds(tmp_path):
    perfect, slow = {"ego.plant": "perfect"}, {"ego.plant": "dynamic"}
    for n in range(40):
        run(tmp_path, n, perfect, arrived=n > 0, collisions=0, seed=n)
        bad = n in (1, 2)
        verdict = {1: "ego at fault", 2: "unavoidable"}.get(n)
        values = {"arrived": n > 2, "collisions": int(bad), "verdict": verdict}
        run(tmp_path, 100 + n, slow, **values, seed=n)
    page = robustness_page([tmp_path])
    low, high = tango(0, 2, 40).low, tango(0, 2, 40).high
    assert "| perfect | 40 | 39 (97.5 %) | - | 0 | 0 |" in page
    words = f"-5.0 [{100 * low:.1f}, {100 * high:.1f}]"
    assert f"| dynamic | 40 | 37 (92.5 %) | {words} | 2 | 1 |" in page


def test_other_axes_tell_runs_apart_and_numbers_are_numbers(tmp_path):
    number = 0
    for plant in ("perfect", "dynamic"):
        for duration in (4, 60):
            for delay in (0, 1):
                point = {"ego.plant": plant, "simulation.duration_s": duration}
                point |= {"simulation.planning_delay_s": delay}
                arrived = duration == 60
                run(tmp_path, number, point, arrived=arrived, collisions=0, seed=1)
                number += 1
    page = robustness_page([tmp_path])
    assert "| perfect | 0 | 2 | 1 (50.0 %) | - | 0 | 0 |" in page
    assert "| dynamic | 1 | 2 | 1 (50.0 %) | +0.0 [" in page


LATENCY, NOISE = "ego.perception.latency_s", "ego.perception.position_noise_m"


def test_curves_vary_one_axis_about_the_common_point(tmp_path, capsys):
    points = [(0.0, 0.1), (0.1, 0.1), (0.5, 0.1), (0.1, 0.0), (0.1, 0.5)]
    for number, (latency, noise) in enumerate(points):
        for seed in range(2):
            run(
                tmp_path,
                10 * number + seed,
                {LATENCY: latency, NOISE: noise},
                arrived=seed == 0 or latency < 0.5,
                collisions=0,
                min_clearance_m=1.0 - noise,
            )
    over_latency, over_noise = degradation_curves(tmp_path)
    assert over_latency.values == (0.0, 0.1, 0.5)
    assert [row[1] for row in over_latency.measures] == [100.0, 100.0, 50.0]
    assert over_noise.values == (0.0, 0.1, 0.5)
    assert [row[4] for row in over_noise.measures] == [1.0, 0.9, 0.5]
    assert "| 0.5 | 2 | 50 |" in robustness_page([tmp_path])
    picture = tmp_path / "curves.svg"
    with pytest.raises(SystemExit):
        app(("robustness", str(tmp_path), "--figure", str(picture)))
    assert "position noise" in picture.read_text(encoding="utf-8")
    assert "## One axis at a time: road, p" in capsys.readouterr().out


def test_a_sweep_over_something_else_is_refused(tmp_path):
    run(tmp_path, 0, {"ego.goal_m": 100.0}, arrived=True, collisions=0)
    with pytest.raises(ConfigError, match="no axis of vehicle or perception"):
        robustness_page([tmp_path])


def test_the_page_of_the_documentation_is_of_this_generator():
    page = (Path(__file__).parents[3] / "docs" / "robustness.md").read_text("utf-8")
    assert page.startswith(HEAD)
    heads = {line for line in page.splitlines() if line.startswith("| plant")}
    columns = {head.rpartition(" perception | ")[2] for head in heads}
    assert columns == {f"{' | '.join(names)} |" for names in (IN_ALL, MEASURES)}
