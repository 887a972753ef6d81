"""The newest run is the one that ended last, whatever was written into others since."""

import json
import os

import pytest

from experiments.episode.newest_run import newest_run
from experiments.errors import ConfigError


def write_manifest(folder, ended=None, file_time=0.0):
    folder.mkdir(parents=True)
    about = {} if ended is None else {"ended_at": ended}
    (folder / "manifest.json").write_text(json.dumps(about))
    os.utime(folder / "manifest.json", (file_time, file_time))


def test_a_page_written_later_makes_no_run_newer(tmp_path):
    write_manifest(tmp_path / "b", "2026-01-02T10:00:00+00:00")
    write_manifest(tmp_path / "a", "2026-01-02T12:30:00+02:00", file_time=9e8)
    write_manifest(tmp_path / "c", "2026-01-02T09:59:59.5+00:00", file_time=1e9)
    assert newest_run(tmp_path).name == "a"
    (tmp_path / "b" / "report.html").write_text("later")
    assert newest_run(tmp_path).name == "a"


def test_manifests_without_the_time_count_by_their_file(tmp_path):
    write_manifest(tmp_path / "old", file_time=1.0e9)  # 2001
    write_manifest(tmp_path / "older", file_time=0.9e9)
    (tmp_path / "older" / "report.html").write_text("later")
    assert newest_run(tmp_path).name == "old"
    (tmp_path / "older" / "manifest.json").write_text("{")
    os.utime(tmp_path / "older" / "manifest.json", (1.1e9, 1.1e9))
    assert newest_run(tmp_path).name == "older"
    write_manifest(tmp_path / "new", "2026-01-02T10:00:00+00:00")
    assert newest_run(tmp_path).name == "new"


def test_no_run_is_one_line(tmp_path):
    (tmp_path / "thesis").mkdir()
    with pytest.raises(ConfigError, match="there is no run yet; allowed: the folder"):
        newest_run(tmp_path)
    with pytest.raises(ConfigError, match="there is no run yet"):
        newest_run(tmp_path / "nowhere")
