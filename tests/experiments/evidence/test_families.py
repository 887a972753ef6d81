"""The document about one driver and three families counts what the rows say."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.families import document
from experiments.metrics.row import row_without_episode


def run(road, seed, label, time):
    return {
        **row_without_episode(road, label, seed, "arrived" if time else "blocked"),
        "label": label,
        "reason": "",
        "arrived": time is not None,
        "travel_time_s": time,
        "collisions": 0 if time else 1,
    }


def rows():
    own = [run("dense", 5000 + k, "dense", 50.0 + k) for k in range(4)]
    return own + [
        run("dense", 5000 + k, "route", None if k == 3 else 52.0 + k * k)
        for k in range(4)
    ]


def test_each_planner_has_its_line_and_each_road_its_difference():
    text = document(rows())
    assert "8 runs, seeds 5000 to 5003." in text
    assert "| `dense` | `dense` | 4 | 100.0 % [51.0, 100.0] | 0 | 0 | 51.5 |" in text
    assert "| `dense` | `route` | 4 | 75.0 % [30.1, 95.4] | 1 | 0 | 53.7 |" in text
    (line,) = (x for x in text.splitlines() if "travel time [s] | 3 |" in x)
    assert "+2.67" in line  # the mean of 2, 2 and 4


def test_a_road_with_one_planner_or_three_is_refused():
    with pytest.raises(ConfigError, match="dense: has runs of dense; allowed"):
        document(rows()[:4])
    with pytest.raises(ConfigError, match="cruise, dense, route"):
        document([*rows(), run("dense", 5000, "cruise", 50.0)])
    with pytest.raises(ConfigError, match="no runs"):
        document([])
