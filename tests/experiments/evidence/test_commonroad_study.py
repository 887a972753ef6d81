"""The table of driven CommonRoad scenarios counts what came of each."""

import json

import pytest

from experiments.evidence.commonroad_study import _kept, main, table


def result(group, file, status, accepted=None, wrong=()):
    found = {"group": group, "file": file, "status": status, "reason": "because"}
    if accepted is not None:
        found |= {"accepted": accepted, "wrong": list(wrong), "cost": 1.0}
    return found


def test_rows_count_solved_collided_and_accepted_and_failures_are_named():
    rows, words, failures = table(
        [
            result("shipped", "a.xml", "arrived", accepted=True),
            result("curved", "b.xml", "arrived", accepted=True),
            result("curved", "c.xml", "arrived", accepted=False, wrong=["road: hit"]),
            result("curved", "d.xml", "collision"),
            result("curved", "e.xml", "refused"),
        ]
    )
    assert "| `shipped` | 1 of 1 | 1 | 0 | 1 of 1 |" in rows
    assert "| `curved` | 3 of 4 | 2 | 1 | 1 of 2 |" in rows
    assert rows.endswith("| all exported | 3 of 4 | 2 | 1 | 1 of 2 |")
    assert "not solved" in words
    assert failures.splitlines() == [
        "- `d.xml`: collision: because",
        "- `e.xml`: refused: because",
        "- `c.xml`: not accepted: road: hit",
    ]


def test_what_cannot_be_read_is_a_row_and_results_are_kept(tmp_path):
    file = tmp_path / "bad.xml"
    file.write_text("<commonRoad commonRoadVersion='1999'/>")
    kept = tmp_path / "bad.json"
    found = _kept(kept, "curved", file, tmp_path, tmp_path)
    assert found["status"] == "refused"
    assert "1999" in found["reason"]
    assert json.loads(kept.read_text()) == found
    file.touch()  # the same content
    kept.write_text(json.dumps({**found, "reason": "kept"}))
    assert _kept(kept, "curved", file, tmp_path, tmp_path)["reason"] == "kept"


@pytest.mark.parametrize("changed", ["code", "file", "recorded"])
def test_a_result_of_other_code_or_another_file_is_computed_anew(changed, tmp_path):
    file, kept = tmp_path / "bad.xml", tmp_path / "bad.json"
    file.write_text("<commonRoad commonRoadVersion='1999'/>")
    found = _kept(kept, "curved", file, tmp_path, tmp_path, recorded="run")
    old = {**found["made_of"], changed: "another"}
    kept.write_text(json.dumps({**found, "reason": "kept", "made_of": old}))
    again = _kept(kept, "curved", file, tmp_path, tmp_path, recorded="run")
    assert again == found


def test_without_the_checker_nothing_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("REARVIEW_COMMONROAD_PYTHON", raising=False)
    assert main(["-o", "x.md", "--out", str(tmp_path / "out")]) == 2
    assert "first make commonroad-checker" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
