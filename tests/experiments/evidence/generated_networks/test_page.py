"""The page counts what the rows say."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.generated_networks.page import document, main
from experiments.metrics.row import row_without_episode


def run(net, seed, label, status="arrived", **measured):
    return {
        **row_without_episode(net, label, seed, status),
        "label": label,
        "reason": f"{'arrived' if status == 'off_road' else status} somewhere",
        "arrived": status == "arrived",
        **measured,
    }


FOUND = [
    run("net_00", 0, "sumo"),
    run("net_00", 1, "sumo", "off_road", off_road_steps=3),  # arrives, all the same
    run("net_01", 0, "sumo"),
    run("net_01", 1, "sumo", "blocked"),
    run("net_00", 0, "route"),
    run("net_00", 1, "route", line_violations=1),
    run("net_01", 0, "route", "collision", collisions=1, verdict="other at fault"),
    run("net_01", 1, "route"),
]


def test_shares_are_of_the_routes_that_sumos_driver_drives():
    text = document(FOUND)
    assert "4 routes on 2 networks; SUMO's driver arrives on 3." in text
    (line,) = (x for x in text.splitlines() if "| `route`" in x)
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells == [
        "netgenerate",
        "`route`",
        "2 of 3",
        "66.7 % [20.8, 93.9]",  # Wilson 1927
        "1 of 1",
        "1",
        "0",
        "1",
        "0",
    ]
    failure = "- `net_01`, seed 0: collision: collision somewhere; other at fault"
    assert text.count("- `net") == 1
    assert failure in text


@pytest.mark.parametrize(
    ("found", "message"),
    [([], "there are no runs"), (FOUND[4:], "no run is by planner sumo")],
)
def test_runs_that_tell_nothing_are_refused(found, message):
    with pytest.raises(ConfigError, match=message):
        document(found)


def test_a_folder_that_is_not_there_is_one_line(tmp_path, capsys):
    page = tmp_path / "page.md"
    assert main([str(tmp_path / "nothing"), "-o", str(page)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not page.exists()
