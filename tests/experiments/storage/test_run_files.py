"""JSON files of run folders."""

import json

import pytest

from experiments.errors import ResultsError
from experiments.storage.json_files import read_json
from experiments.storage.run_files import (
    MANIFEST,
    read_manifest,
    replace_json,
    write_json,
)

CONTENT = {
    "scenario": "a",
    "planner": "b",
    "status": "c",
    "seed": 3,
    "point": {"a.b": [1, None]},
    "reason": "0.5 m³",
}


@pytest.mark.parametrize("write", [write_json, replace_json])
def test_what_is_written_reads_back(tmp_path, write):
    write(tmp_path / MANIFEST, CONTENT)
    assert read_manifest(tmp_path) == CONTENT
    assert [path.name for path in tmp_path.iterdir()] == [MANIFEST]


def test_a_file_is_replaced_or_stays_as_it_was(tmp_path):
    file = tmp_path / "progress.json"
    replace_json(file, {"done": 1})
    with pytest.raises(TypeError):
        replace_json(file, {"done": object()})
    assert json.loads(file.read_text()) == {"done": 1}
    replace_json(file, {"done": 2})
    assert read_json(file) == {"done": 2}


def test_a_folder_that_is_gone_is_one_line(tmp_path):
    with pytest.raises(ResultsError, match=r"x\.json: cannot be written: No such"):
        replace_json(tmp_path / "gone" / "x.json", {})


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (None, "cannot be read: "),
        ("{", "cannot be read: "),
        ("[1]", "is damaged: not a JSON object"),
    ],
)
def test_damaged_files_are_one_line(tmp_path, text, problem):
    file = tmp_path / MANIFEST
    if text is not None:
        file.write_text(text)
    with pytest.raises(ResultsError) as refusal:
        read_manifest(tmp_path)
    assert str(refusal.value).startswith(f"{file}: {problem}")
    assert "\n" not in str(refusal.value)
