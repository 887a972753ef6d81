import io
import math
from itertools import pairwise

import pytest
from rich.console import Console

from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.thesis.cruise.random_layouts import (
    RADII,
    RANDOM,
    ROADS,
    RandomDrive,
    drive,
    growing,
    growing_table,
    largest_drop,
    layouts_table,
)
from experiments.world_setup.layout import make_layout
from experiments.world_setup.obstacles import listed_obstacles


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("seed", [0, 7])
def test_layouts_are_drawn_as_the_published_ones_look(road, seed):
    scenario = load_scenario(f"thesis_{road}", seed=seed, overrides=[RANDOM])
    obstacles = listed_obstacles(scenario, make_layout(scenario))
    places = [obstacle.s_m for obstacle in obstacles]
    gaps = [b - a for a, b in pairwise(places)]
    assert len(obstacles) >= 3
    assert all(28.0 <= gap <= 45.0 for gap in gaps)
    assert all(abs(obstacle.l_m) <= 3.0 for obstacle in obstacles)
    assert all(0.3 <= obstacle.radius_m <= 1.5 for obstacle in obstacles)


def test_one_layout_is_driven_to_the_goal_with_room_to_spare():
    done = drive("straight", "cruise", 3, RANDOM)
    assert done.status is EpisodeStatus.ARRIVED
    assert 0.2 <= done.clearance < math.inf
    assert done.off_road == 0


def test_the_growing_obstacle_is_alone_and_as_large_as_said():
    scenario = load_scenario("thesis_straight", overrides=[growing(RADII[-1])])
    (obstacle,) = listed_obstacles(scenario, make_layout(scenario))
    assert obstacle.radius_m == 2.0
    assert RADII[0] == 0.3
    small = drive("straight", "cruise", 0, growing(RADII[0]))
    assert small.status is EpisodeStatus.ARRIVED


def test_the_largest_drop_is_seen_from_the_highest_before():
    assert largest_drop([1.0, 1.4, 1.2, 1.5, 0.9, 1.3]) == pytest.approx(0.6)
    assert largest_drop([1.0, 1.1, 1.1]) == 0.0


def test_the_tables_count_what_happened():
    drives = [
        RandomDrive(EpisodeStatus.ARRIVED, 0.8, 0, 0),
        RandomDrive(EpisodeStatus.COLLISION, 0.0, 3, 2),
        RandomDrive(EpisodeStatus.BLOCKED, 0.5, 1, 0),
    ]
    console = Console(width=120, record=True, file=io.StringIO())
    console.print(layouts_table("cruise", [("curved", drives)]))
    console.print(growing_table("cruise", drives[:1] * len(RADII)))
    text = console.export_text()
    row = next(line for line in text.splitlines() if "curved" in line)
    assert [cell.strip() for cell in row.strip("│ ").split("│")] == [
        "curved",
        "3",
        "1",
        "1",
        "2",
        "4",
        "2",
        "0.00",
    ]
    assert text.count("arrived") == 1 + len(RADII)
