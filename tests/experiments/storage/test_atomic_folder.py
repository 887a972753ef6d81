"""Run folders exist complete or not at all."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.errors import ResultsError
from experiments.storage.atomic_folder import (
    _ASIDE,
    atomic_folder,
    make_folder,
    remove_unfinished,
    require_there,
)

ROOT = Path(__file__).parents[3]


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


def test_complete_or_not_at_all(tmp_path):
    target = tmp_path / "runs" / "one"
    with atomic_folder(target) as folder:
        (folder / "a").write_text("1")
        assert not target.exists()
        assert folder.parent == target.parent, "rename must not cross file systems"
    assert (target / "a").read_text() == "1"
    assert names(tmp_path / "runs") == ["one"]


def test_replaced_as_a_whole(tmp_path):
    target = tmp_path / "one"
    for name in ("old", "new"):
        with atomic_folder(target) as folder:
            (folder / name).touch()
    assert names(target) == ["new"]
    assert names(tmp_path) == ["one"]


@pytest.mark.parametrize(
    "error", [RuntimeError("x"), KeyboardInterrupt(), OSError(28, "x")]
)
def test_failure_leaves_the_old_and_nothing_new(tmp_path, error):
    target = tmp_path / "one"
    with atomic_folder(target) as folder:
        (folder / "old").touch()
    kinds = (type(error), ResultsError)
    with pytest.raises(kinds), atomic_folder(target) as folder:  # noqa: PT012
        (folder / "new").touch()
        raise error
    assert names(target) == ["old"]
    assert names(tmp_path) == ["one"]


def test_failed_rename_brings_the_old_back(tmp_path, monkeypatch):
    target = tmp_path / "one"
    with atomic_folder(target) as folder:
        (folder / "old").touch()
    rename = Path.rename

    def failing(self, other):
        if Path(other) == target and self.name != "old":
            raise OSError(28, "No space left on device")
        return rename(self, other)

    monkeypatch.setattr(Path, "rename", failing)
    with (
        pytest.raises(ResultsError, match="No space left"),
        atomic_folder(target) as new,
    ):
        (new / "new").touch()
    assert names(target) == ["old"]
    assert names(tmp_path) == ["one"]


def test_no_place(tmp_path):
    (tmp_path / "file").touch()
    with (
        pytest.raises(ResultsError, match="file"),
        atomic_folder(tmp_path / "file" / "a"),
    ):
        pytest.fail("must not come here")


def test_what_a_dead_process_left_is_removed(tmp_path):
    dead = tmp_path / f"{_ASIDE}123-abc"
    alive = tmp_path / f"{_ASIDE}1234-abc"
    for folder in (dead, alive):
        folder.mkdir()
    remove_unfinished(tmp_path, 123)
    assert [path.name for path in tmp_path.iterdir()] == [alive.name]


def test_what_was_killed_is_removed_by_the_next_that_fills_a_folder_there(tmp_path):
    code = (
        "import os, sys; from pathlib import Path;"
        "from experiments.storage.atomic_folder import atomic_folder\n"
        f"with atomic_folder(Path({str(tmp_path / 'one')!r})) as folder:\n"
        "    (folder / 'half').touch(); os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False)
    assert done.returncode == -9
    (left,) = tmp_path.iterdir()
    assert (left / "half").exists()
    own = tmp_path / left.name.replace(left.name.split("-")[-2], str(os.getpid()))
    elsewhere = tmp_path / ".unfinished-another.machine-1-abc"
    for folder in (own, elsewhere):
        folder.mkdir()
    with atomic_folder(tmp_path / "two") as folder:
        assert folder.exists()
    assert set(names(tmp_path)) == {own.name, elsewhere.name, "two"}


def test_full_disk(tiny_disk):
    with (
        pytest.raises(ResultsError, match="No space left on device"),
        atomic_folder(tiny_disk / "run") as folder,
    ):
        (folder / "big").write_bytes(bytes(200_000))
    assert names(tiny_disk) == []


@pytest.mark.parametrize("inner", ["one", "deeper/one"])
def test_a_file_in_the_place_of_the_parent_is_named(tmp_path, inner):
    file = tmp_path / "README.md"
    file.write_text("kept")
    words = r"README\.md: is a file; allowed: a folder$"
    with pytest.raises(ResultsError, match=words), atomic_folder(file / inner):
        pass
    assert file.read_text() == "kept"


def test_a_missing_folder_hints_at_one_like_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sweeps" / "smoke").mkdir(parents=True)
    (tmp_path / "study_2").mkdir()
    for missing, hint in (
        ("smoke", "did you mean sweeps/smoke?"),
        ("study2", "did you mean study_2?"),
        (str(tmp_path / "study-2"), f"did you mean {tmp_path}/study_2?"),
    ):
        with pytest.raises(ResultsError) as refusal:
            require_there(Path(missing))
        assert str(refusal.value) == f"{missing}: there is no such folder; {hint}"
    with pytest.raises(ResultsError, match=r"there is no such folder$"):
        require_there(tmp_path / "x" / "y")


def test_a_link_to_nowhere_is_no_folder(tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "nowhere")
    words = r"link: is a link to nowhere; allowed: a folder$"
    with pytest.raises(ResultsError, match=words):
        make_folder(link / "inner")
