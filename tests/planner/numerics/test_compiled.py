"""The cache of compiled code on disks that do not take it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROGRAM = """
from planner.numerics.compiled import compiled

@compiled
def twice(x):
    return 2.0 * x

print(twice(1.5))
"""


def run(program: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def program(tmp_path: Path) -> str:
    """numba caches functions of files only."""
    (tmp_path / "doubling.py").write_text(PROGRAM)
    return f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import doubling"


def test_a_cache_that_can_be_written_is_used(tmp_path, program):
    done = run(program, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert (done.stdout, done.stderr) == ("3.0\n", "")
    assert list((tmp_path / "cache").rglob("*.nbc"))


@pytest.mark.parametrize("place", ["/proc/cache", "/dev/null/cache"])
def test_a_folder_that_cannot_be_made_is_named(program, place):
    done = run(program, NUMBA_CACHE_DIR=place)
    assert done.stdout == "3.0\n"
    assert done.stderr.startswith(f"rearview: {place}: ")
    assert done.stderr.endswith("not kept there, every start compiles again\n")
    assert done.stderr.count("\n") == 1


def test_a_disk_that_fills_up_later(tmp_path, program):
    fills_up = (
        "import errno; from numba.core import caching\n"
        "def save(*_): raise OSError(errno.ENOSPC, 'No space left on device')\n"
        "caching.IndexDataCacheFile.save = save\n"
    )
    done = run(fills_up + program, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert done.stdout == "3.0\n"
    assert done.stderr.count("\n") == 1
    assert f"rearview: {tmp_path}/cache" in done.stderr
    assert "No space left on device; compiled code is not kept" in done.stderr


def test_a_cache_that_was_cut_short(tmp_path, program):
    cache = tmp_path / "cache"
    run(program, NUMBA_CACHE_DIR=str(cache))
    for file in cache.rglob("*.nb?"):
        file.write_bytes(file.read_bytes()[:40])
    done = run(program, NUMBA_CACHE_DIR=str(cache))
    assert done.stdout == "3.0\n"
    assert "Traceback" not in done.stderr
