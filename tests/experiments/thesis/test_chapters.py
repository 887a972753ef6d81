import base64
import json
import re

import pytest
from typer.testing import CliRunner

from experiments.cli.app import app
from experiments.thesis import chapters
from experiments.thesis.chapters import chapter_data, inputs_hash, kept_chapter
from experiments.thesis.claims import Chapter
from experiments.thesis.effort import FULL, QUICK

NO_WORK = None  # the made-up chapter computes nothing


@pytest.fixture
def calls(monkeypatch):
    """A chapter that is quick to compute, and how often it was."""
    made = []

    def compute(effort, work):
        made.append(effort)
        return Chapter("dense", 5, "Dense", {"layouts": 1}, (), (), ())

    monkeypatch.setattr(chapters, "CHAPTERS", {"dense": compute})
    return made


def test_a_finished_chapter_is_not_computed_again(tmp_path, calls):
    first, new = chapter_data("dense", QUICK, NO_WORK, tmp_path)
    assert new
    again, new = chapter_data("dense", QUICK, NO_WORK, tmp_path)
    assert not new
    assert again == first
    assert len(calls) == 1


@pytest.mark.parametrize("what", ["code_hash", "layouts", "effort", "damaged"])
def test_a_chapter_of_something_else_is_computed_anew(
    tmp_path, calls, monkeypatch, what
):
    chapter_data("dense", QUICK, NO_WORK, tmp_path)
    effort = QUICK
    if what == "code_hash":
        monkeypatch.setattr(chapters, "code_hash", lambda: "other")
    elif what == "layouts":
        monkeypatch.setattr(chapters, "inputs_hash", lambda root: "other")
    elif what == "effort":
        effort = FULL
    else:
        file = tmp_path / chapters.FOLDER / "dense.json"
        file.write_text(file.read_text()[:-20])
    assert kept_chapter("dense", effort, tmp_path) is None
    _, new = chapter_data("dense", effort, NO_WORK, tmp_path)
    assert new
    assert len(calls) == 2


def test_a_changed_layout_changes_the_hash(tmp_path):
    folder = tmp_path / "experiments" / "scenarios"
    folder.mkdir(parents=True)
    (folder / "thesis_curved.yaml").write_text("l_m: -0.5\n")
    (folder / "notes.txt").write_text("not a layout\n")
    before = inputs_hash(tmp_path)
    (folder / "notes.txt").write_text("still none\n")
    assert inputs_hash(tmp_path) == before
    (folder / "thesis_curved.yaml").write_text("l_m: -0.6\n")
    assert inputs_hash(tmp_path) != before


def test_what_is_interrupted_leaves_no_half_chapter(tmp_path, monkeypatch):
    def interrupted(effort, work):
        raise KeyboardInterrupt

    monkeypatch.setattr(chapters, "CHAPTERS", {"dense": interrupted})
    with pytest.raises(KeyboardInterrupt):
        chapter_data("dense", QUICK, NO_WORK, tmp_path)
    assert kept_chapter("dense", QUICK, tmp_path) is None
    assert list(tmp_path.rglob("*.json")) == []


def test_an_unknown_chapter_is_refused():
    result = CliRunner().invoke(app, ["thesis", "cruse"])
    assert result.exit_code == 2
    assert "cruise" in result.output


def without_times(folder):
    numbers = json.loads((folder / "thesis.json").read_text(encoding="utf-8"))
    assert numbers.pop("timing")["chapters"]
    return numbers


@pytest.mark.slow
def test_quick_gives_page_numbers_and_document_and_the_same_ones_again(tmp_path):
    for name, workers in (("one", "2"), ("two", "1")):
        out = ["--out", str(tmp_path / name), "--workers", workers]
        result = CliRunner().invoke(app, ["thesis", "--quick", *out])
        assert result.exit_code == 0, result.output
    assert without_times(tmp_path / "one") == without_times(tmp_path / "two")
    page = (tmp_path / "one" / "report.html").read_text(encoding="utf-8")
    drawn = re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", page)
    assert sum(base64.b64decode(one).count(b"<path") for one in drawn) > 60
    assert "SUMO with traffic: left out by --quick" in page
