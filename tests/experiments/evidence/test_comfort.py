"""The document about comfort counts what the rows say."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.comfort import document, main
from experiments.metrics.row import row_without_episode


def run(road, seed, label="cruise", **measured):
    return {
        **row_without_episode(road, label, seed, "arrived"),
        "label": label,
        "traffic.density": "light" if label == "cruise" else None,
        "arrived": True,
        "collisions": 0,
        "lateral_discomfort_share": 0.0,
        "braking_discomfort_share": 0.0,
        "max_abs_lateral_acceleration_mps2": 2.0,
        "max_lateral_jerk_mps3": 1.0,
        "max_tangential_jerk_mps3": 1.0,
        "emergency_cycles": 0,
        **measured,
    }


def cells(text, *begin):
    (line,) = (x for x in text.splitlines() if x.startswith("| " + " | ".join(begin)))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_shares_are_those_of_the_rows():
    found = [run("straight", seed) for seed in range(4)]
    found += [
        run("curved", 0, lateral_discomfort_share=0.02, emergency_cycles=3),
        run("curved", 1, max_abs_lateral_acceleration_mps2=3.5),
        run("curved", 2, lateral_discomfort_share=0.02, max_lateral_jerk_mps3=5.5),
        run("curved", 3, max_tangential_jerk_mps3=5.0005, collisions=1),
    ]
    text = document(found)
    assert "8 runs, seeds 0 to 3." in text
    assert "development seeds, 0 to 999, on which planners are tuned" in text
    road = cells(text, "`curved`", "light")
    assert road[2:6] == ["4", "4", "4", "1"]
    assert road[6] == "99.0 % [97.2, 100.0]"  # 1 %, deviation 1.15 %, t of 3
    assert road[7] == "100.0 % [100.0, 100.0]"
    assert [cell.split(" [")[0] for cell in road[8:]] == [
        "75.0 %",
        "75.0 %",
        "100.0 %",
        "75.0 %",
    ]
    assert cells(text, "all", "")[2:6] == ["8", "8", "8", "1"]
    straight = cells(text, "`straight`", "light")
    assert straight[-1] == "100.0 % [51.0, 100.0]"  # Wilson, four of four


def test_planners_have_tables_of_their_own_and_missing_values_count_nowhere():
    alone = run("dense", 5000, "dense", max_lateral_jerk_mps3=None)
    text = document([run("straight", 5000), alone])
    assert text.index("## `cruise`") < text.index("## `dense`")
    assert "development seeds" not in text
    assert cells(text, "`dense`", "-")[6:10] == [
        "100.00 %",
        "100.00 %",
        "100.0 % [20.7, 100.0]",
        "-",
    ]


def test_nothing_to_write_is_one_line(tmp_path, capsys):
    with pytest.raises(ConfigError, match="there are no runs"):
        document([])
    assert main([str(tmp_path), "-o", str(tmp_path / "comfort.md")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_an_ego_that_never_drove_has_no_part_in_the_shares():
    waits = run(
        "curved",
        1,
        arrived=False,
        max_abs_lateral_acceleration_mps2=None,
        lateral_discomfort_share=None,
    )
    road = cells(document([run("curved", 0, emergency_cycles=1), waits]), "`curved`")
    assert road[2:5] == ["2", "1", "1"]
    assert road[-1].startswith("0.0 %")
