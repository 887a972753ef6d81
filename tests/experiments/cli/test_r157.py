import pytest

from experiments.cli.app import main


def run(arguments, monkeypatch):
    """Return the exit status of `rearview r157`."""
    monkeypatch.setattr("sys.argv", ["rearview", "r157", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return stop.value.code or 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--planner", "careful"], "no such planner"),
        (["--planner", "nowhere:make"], "cannot import nowhere"),
        (["--kind", "cut_up"], "cut_up"),
        (["--plant", "steam"], "steam"),
    ],
)
def test_bad_input_is_one_line(arguments, words, monkeypatch, capsys, tmp_path):
    status = run([*arguments, "--out", str(tmp_path / "out")], monkeypatch)
    err = capsys.readouterr().err
    assert status == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_reference_drivers_alone(monkeypatch, capsys, tmp_path):
    arguments = ["--kind", "braking", "--planner", "none", "--out", str(tmp_path)]
    assert run(arguments, monkeypatch) == 0
    assert "report: " in capsys.readouterr().out
    assert "| braking leader | 150 |" in (tmp_path / "r157.md").read_text("utf-8")
    assert not list(tmp_path.rglob("*.parquet"))


@pytest.mark.slow
def test_study_resumes_with_the_same_bytes(monkeypatch, capsys, tmp_path):
    arguments = ["--kind", "braking", "--planner", "careful_human"]
    arguments += ["--out", str(tmp_path)]
    assert run(arguments, monkeypatch) == 0
    names = ("report.html", "r157.md", "r157.json", "r157_braking_careful_human.png")
    first = {name: (tmp_path / name).read_bytes() for name in names}
    (panel,) = tmp_path.rglob("*.parquet")
    made = panel.stat().st_mtime_ns
    out = capsys.readouterr().out
    assert "braking: careful_human: 0 collisions that the careful human prevents" in out
    assert run(arguments, monkeypatch) == 0
    assert panel.stat().st_mtime_ns == made
    assert {name: (tmp_path / name).read_bytes() for name in names} == first
