"""The document about planners of others counts what the rows say."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.peers import document, main
from experiments.metrics.row import row_without_episode


def run(road, label, seed, status="arrived", density="light", travel=20.0):
    return {
        **row_without_episode(road, label, seed, status),
        "label": label,
        "traffic.density": density,
        "arrived": status == "arrived",
        "travel_time_s": travel if status == "arrived" else None,
        "min_clearance_m": 1.0,
    }


def test_counts_and_differences_are_those_of_the_rows():
    found = [
        run(road, label, seed, status, travel=20.0 + seed + (label == "fop"))
        for road in ("straight", "curved")
        for label in ("route", "fop")
        for seed in range(4)
        for status in [
            "collision"
            if (road, label, seed) in {("curved", "route", 2), ("straight", "fop", 0)}
            else "arrived"
        ]
    ]
    text = document(found)
    assert "16 of the 9180 runs of the sweep, seeds 0, 1, 2, 3, density light." in text
    assert "development seeds, 0 to 999, on which planners are tuned" in text
    assert "Left out" not in text
    assert "| `route` | 8 | 7 | 1 |" in text
    assert "- `curved`: 3 of 4 arrive, of `fop` 4" in text
    assert "- `curved`: 1 of 4 collide, of `fop` 0" in text
    assert "- `straight`" not in text
    row = next(x for x in text.splitlines() if x.startswith("| `straight` | `route`"))
    assert "| 4 of 4 | 0 |" in row
    rows = [x for x in text.splitlines() if "`fop`" in x and "| +1.00" in x]
    assert len(rows) == 2


def test_a_planner_with_another_number_of_runs_is_named_as_left_out():
    found = [run("straight", "route", seed) for seed in (5000, 5001)]
    text = document([*found, run("straight", "fop", 5000)])
    assert "- `straight`: `fop` 1 runs, `route` 2" in text
    assert "development seeds" not in text


def test_nothing_to_compare_is_one_line(tmp_path, capsys):
    with pytest.raises(ConfigError, match="there are no runs"):
        document([])
    with pytest.raises(ConfigError, match="no run is of route"):
        document([run("straight", "fop", 0)])
    assert main([str(tmp_path), "-o", str(tmp_path / "peers.md")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
