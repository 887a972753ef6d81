"""The film of a run: how many pictures, what is on them, and what can be missing."""

import shutil
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image, ImageSequence

from experiments.cli.app import app
from experiments.errors import ResultsError
from experiments.report.figures import palette
from experiments.report.figures import video as film
from tests.experiments.report.run_folders import driven_trace, write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "one", driven_trace(9))


def refusal(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        app(("video", *map(str, arguments)))
    out, err = capsys.readouterr()
    assert left.value.code == 2
    assert out == ""
    assert err.count("\n") == 1
    return err


def test_gif_has_a_picture_a_step_and_the_ego_on_each(run, tmp_path):
    file = film.save_film(run, tmp_path / "a.gif")
    with Image.open(file) as picture:
        frames = [
            np.asarray(frame.convert("RGB")).astype(int)
            for frame in ImageSequence.Iterator(picture)
        ]
        assert picture.info["duration"] == 100  # of a frame [ms]: the step
    assert len(frames) == 9
    blue = np.array([int(palette.MOMENTS[0][k : k + 2], 16) for k in (1, 3, 5)])
    for frame in frames:
        rows, columns = np.nonzero(np.abs(frame - blue).max(axis=2) < 30)
        assert rows.size > 200
        # in the middle of the axes, which are 0.06 to 0.99 and 0.09 to 0.92 of it
        assert columns.mean() == pytest.approx(0.525 * 960, abs=4)
        assert rows.mean() == pytest.approx((1 - 0.505) * 540, abs=4)
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def test_mp4_plays_as_long_as_asked(run, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    file = film.save_film(run, tmp_path / "a.mp4", speed=2.0)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(file))
    assert frames == 9
    assert seconds == pytest.approx(9 * 0.1 / 2.0, abs=0.06)


def test_fast_films_leave_steps_out(run):
    record = film.read_run(run)
    assert film._frame_rate(record, 1.0) == (pytest.approx(10.0), 1)
    assert film._frame_rate(record, 8.0) == (pytest.approx(20.0), 4)


def test_mistakes_are_one_line(run, tmp_path, capsys, monkeypatch):
    assert "allowed: .mp4, .gif" in refusal(capsys, run, "-o", tmp_path / "a.avi")
    bad_speed = refusal(capsys, run, "-o", tmp_path / "a.gif", "--speed", "0")
    assert "--speed: is 0; allowed: above 0" in bad_speed
    assert "is not a run folder" in refusal(capsys, tmp_path, "-o", tmp_path / "a.gif")
    nowhere = tmp_path / "nowhere" / "a.gif"
    assert "cannot be written" in refusal(capsys, run, "-o", nowhere)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    line = refusal(capsys, run, "-o", tmp_path / "a.mp4")
    assert "an .mp4 needs ffmpeg" in line
    assert "pip install imageio-ffmpeg" in line
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ResultsError, match="rearview video needs matplotlib"):
        film.save_film(run, tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_sigterm_leaves_no_unfinished_film(tmp_path):
    """A run so long that its film takes a while."""
    folder = write_run(tmp_path / "one", driven_trace(2000))
    films = tmp_path / "films"
    films.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-m", "experiments", "video", folder, "-o", films / "a.gif"]
    )
    deadline = time.monotonic() + 120.0
    while not list(films.glob(".unfinished-*")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.terminate()
    assert process.wait(timeout=60) == 143
    assert list(films.iterdir()) == []


def test_a_span_is_filmed(run, tmp_path, capsys):
    file = film.save_film(run, tmp_path / "part.gif", span=(0.2, 0.5))
    with Image.open(file) as picture:
        assert picture.n_frames == 4
    err = refusal(capsys, run, "-o", tmp_path / "none.gif", "--from", "5", "--to", "6")
    assert "allowed: within 0 to 0.8" in err
