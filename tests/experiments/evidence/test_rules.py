"""The document about rules counts what the rows say."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.rules import document
from experiments.metrics.row import row_without_episode


def run(road, seed, label, status="arrived", **measured):
    return {
        **row_without_episode(road, label, seed, status),
        "label": label,
        "reason": "arrived, but over the edge"
        if status == "off_road"
        else f"{status} somewhere",
        "arrived": status == "arrived",
        "travel_time_s": 40.0 + seed if status == "arrived" else None,
        **measured,
    }


FOUND = [
    run("stop_sign", 5000, "route", gave_way_s=4.0, line_violations=0),
    run("stop_sign", 5001, "route", gave_way_s=1.0, line_violations=2),
    run("stop_sign", 5002, "route", "collision", collisions=1, verdict="shared"),
    run("stop_sign", 5000, "sumo", "off_road", off_road_steps=4),
    run("town", 5000, "route", "blocked", junction_pet_s=2.5),
]


def cells(text, road, label):
    begin = f"| `{road}` | `{label}` |"
    (line,) = (x for x in text.splitlines() if x.startswith(begin))
    return [cell.strip() for cell in line.strip("|").split("|")][2:]


def test_each_network_and_driver_has_its_line():
    text = document(FOUND)
    assert "5 runs, seeds 5000 to 5002." in text
    assert "first look" not in text
    share = "66.7 % [20.8, 93.9]"
    mine = ["3", share, "1", "-", "1", "-", "2.5", "-", "5040.5"]
    assert cells(text, "stop_sign", "route") == mine
    theirs = cells(text, "stop_sign", "sumo")
    assert theirs[1].startswith("100.0 %")
    assert theirs[3] == "1"  # off the road, though it arrived
    assert cells(text, "town", "route")[-2:] == ["2.5", "-"]


def test_failures_of_ours_are_named():
    text = document(FOUND)
    assert (
        "- `stop_sign`, seed 5002, `route`: collision: collision somewhere; shared"
        in text
    )
    assert "- `town`, seed 5000, `route`: blocked: blocked somewhere" in text
    assert "`sumo`: off_road" not in text
    assert "did not arrive" not in document(FOUND[:2])


def test_no_runs_are_refused():
    with pytest.raises(ConfigError, match="there are no runs"):
        document([])
