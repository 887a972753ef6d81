"""Figures of chapter 5 show made-up results."""

import numpy as np

from experiments.thesis.dense.figures import (
    example_picture,
    path_pictures,
    sampling_pictures,
    waypoints_picture,
)
from planner.dense.frenet_path import FrenetPath
from tests.experiments.thesis.dense.test_claims import GROUPS, PICKED, measured


def test_medians_of_waypoints_and_paths_are_lines_over_obstacles():
    waypoints, paths = sampling_pictures(GROUPS)
    lines = {series.name: series.y for series in waypoints.series}
    assert lines == {"uniform": (45.0,) * 4, "adaptive": (41.0, 45.0, 49.0, 53.0)}
    assert {series.y for series in paths.series} == {(100.0,) * 4}


def test_waypoints_lie_within_the_road():
    picture = waypoints_picture()
    assert len(picture.points) > 20
    assert len(picture.discs) == 4
    assert max(abs(l) for _, l in picture.points) <= 5.0


def test_paths_that_there_are_become_lines():
    s = np.linspace(0.0, 10.0, 5)
    path = FrenetPath(s, *(np.full(5, value) for value in (0.5, 0.0, 0.0)))
    methods = {
        "uniform": (measured("uniform", solved=False), None),
        "adaptive": (PICKED["5.3"]["adaptive"], path),
    }
    (picture,) = path_pictures({"5.3": methods})
    (series,) = picture.series
    assert (picture.id, series.name) == ("fig_5.9", "adaptive")
    assert set(series.y) == {0.5}


def test_the_example_is_the_first_layout_whose_sides_change():
    (picture,) = example_picture(GROUPS)
    assert "random layout 1:" in picture.title
    assert len(picture.discs) == 4
    assert len(picture.series) == 2
    unchanged = {key: group[:1] for key, group in GROUPS.items()}
    assert list(example_picture(unchanged)) == []
