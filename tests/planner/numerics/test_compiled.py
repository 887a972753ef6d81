"""Compiled functions are kept by what they are made of, and nothing stale is loaded."""

import importlib
import logging
import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from planner.numerics import kernel_cache
from planner.numerics.compiled import compiled, inlined
from planner.numerics.kernel_cache import SUFFIX

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="nothing is compiled with NUMBA_DISABLE_JIT"
)

# A package of two modules: an entry, a function that it calls, a constant of another
# module, a record, and a function that neither reaches.
CALLEE = """
from typing import NamedTuple
from planner.numerics.compiled import inlined
import {name}.numbers as numbers
from {name}.numbers import SHIFT

class Pair(NamedTuple):
    left: float
    right: float

@inlined
def scaled(x):
    return FACTOR * x + SHIFT + numbers.OTHER

FACTOR = 2.0
"""
CALLER = """
import numpy as np
from planner.numerics.compiled import compiled
from {name}.callee import Pair, scaled

@compiled
def total(values):
    sum = 0.0
    for i in range(values.size):
        sum += scaled(values[i])
    return sum

@compiled
def left(pair):
    return pair.left

@compiled
def alone(x):
    return x + 1.0
"""
NUMBERS = "SHIFT = 0.5\nOTHER = 0.0\n"
RUN = """
import sys
sys.path[:0] = [{folder!r}, {root!r}]
from numba.core import event
compiled = []
class Listener(event.Listener):
    def on_start(self, e):
        compiled.append(e.data["dispatcher"].py_func.__name__)
    def on_end(self, e):
        pass
event.register("numba:compile", Listener())
import numpy as np
from {name}.caller import alone, left, total
from {name}.callee import Pair
print(total(np.ones(3)), left(Pair(1.0, 2.0)), alone(1.0))
print(" ".join(sorted(compiled)))
"""


def make_package(folder: Path, name: str = "sample") -> Path:
    package = folder / name
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    for file, text in (("callee", CALLEE), ("caller", CALLER), ("numbers", NUMBERS)):
        (package / f"{file}.py").write_text(text.format(name=name))
    return package


def run(folder: Path, cache: Path, name: str = "sample") -> tuple[str, set[str], str]:
    """Run the package; return its results, what was compiled, and its complaints."""
    code = RUN.format(folder=str(folder), root=str(ROOT), name=name)
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )
    results, names = done.stdout.split("\n")[:2]
    return results, set(names.split()), done.stderr


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


EVERYTHING = {"alone", "left", "scaled", "total"}


@pytest.mark.slow
def test_a_changed_line_compiles_what_depends_on_it_and_nothing_else(tmp_path):
    package, cache = make_package(tmp_path), tmp_path / "cache"
    assert run(tmp_path, cache)[:2] == ("7.5 1.0 2.0", EVERYTHING)
    assert run(tmp_path, cache)[:2] == ("7.5 1.0 2.0", set())

    callee = package / "callee.py"
    change(callee, "FACTOR * x", "FACTOR * x * x")  # the same result, another code
    assert run(tmp_path, cache)[:2] == ("7.5 1.0 2.0", {"scaled", "total"})
    change(callee, "FACTOR = 2.0", "FACTOR = 3.0")  # a constant that a callee uses
    assert run(tmp_path, cache)[:2] == ("10.5 1.0 2.0", {"scaled", "total"})
    change(package / "numbers.py", "SHIFT = 0.5", "SHIFT = 1.5")  # of another module
    assert run(tmp_path, cache)[:2] == ("13.5 1.0 2.0", {"scaled", "total"})
    change(package / "numbers.py", "OTHER = 0.0", "OTHER = 1.0")  # by attribute
    assert run(tmp_path, cache)[:2] == ("16.5 1.0 2.0", {"scaled", "total"})
    change(callee, "left: float\n    right", "right: float\n    left")  # an argument
    assert run(tmp_path, cache)[:2] == ("16.5 2.0 2.0", {"left"})
    change(callee, "@inlined\n", "# a comment\n@inlined\n")  # and what is no code
    assert run(tmp_path, cache)[:2] == ("16.5 2.0 2.0", set())


@pytest.mark.slow
def test_a_moved_copy_compiles_nothing(tmp_path):
    make_package(tmp_path / "here")
    run(tmp_path / "here", tmp_path / "cache")
    (tmp_path / "here").rename(tmp_path / "there")
    for file in (tmp_path / "there").rglob("*.py"):
        os.utime(file, (0, 0))
    assert run(tmp_path / "there", tmp_path / "cache")[1] == set()


@pytest.mark.slow
def test_damaged_files_are_compiled_again_and_replaced(tmp_path):
    make_package(tmp_path)
    cache = tmp_path / "cache"
    run(tmp_path, cache)
    files = sorted(cache.glob(f"*{SUFFIX}"))
    assert len(files) == 3
    files[0].write_bytes(files[0].read_bytes()[:-100])  # cut off
    files[1].write_bytes(b"")
    middle = bytearray(files[2].read_bytes())
    middle[len(middle) // 2] ^= 1  # one bit
    files[2].write_bytes(middle)
    results, again, said = run(tmp_path, cache)
    assert (results, again) == ("7.5 1.0 2.0", EVERYTHING)
    assert said.count("\n") == 1
    assert "damaged" in said
    assert run(tmp_path, cache) == (results, set(), "")


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_is_said_in_one_line(tmp_path):
    make_package(tmp_path)
    (tmp_path / "file").touch()
    results, again, said = run(tmp_path, tmp_path / "file" / "cache")
    assert (results, again) == ("7.5 1.0 2.0", EVERYTHING)
    assert said.count("\n") == 1
    assert "cannot be kept" in said


@pytest.mark.slow
def test_two_processes_that_compile_at_once_fill_one_cache(tmp_path):
    make_package(tmp_path)
    cache = tmp_path / "cache"
    code = RUN.format(folder=str(tmp_path), root=str(ROOT), name="sample")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    both = [
        subprocess.Popen(
            [sys.executable, "-B", "-c", code],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        for _ in range(2)
    ]
    for each in both:
        assert each.communicate()[0].startswith("7.5 1.0 2.0\n")
    assert len(list(cache.iterdir())) == 3  # no partial file is left
    assert run(tmp_path, cache)[1] == set()


def test_a_full_disk_is_said_once_and_leaves_no_partial_file(
    tmp_path, monkeypatch, caplog
):
    def full(self: Path, _data: bytes) -> int:
        self.touch()
        raise OSError(28, "No space left on device")

    # numba reads the environment anew where another test has changed it
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(Path, "write_bytes", full)
    kernel_cache._say_once.cache_clear()

    @compiled
    def doubled(x: float) -> float:
        return 2.0 * x

    @compiled
    def tripled(x: float) -> float:
        return 3.0 * x

    with caplog.at_level(logging.WARNING):
        assert (doubled(2.0), tripled(2.0)) == (4.0, 6.0)
    assert [record.getMessage() for record in caplog.records] == [
        f"compiled loops cannot be kept in {tmp_path} (No space left on device): "
        "each run compiles"
    ]
    assert list(tmp_path.iterdir()) == []


def test_another_processor_has_files_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @compiled
    def halved(x: float) -> float:
        return 0.5 * x

    kind = (numba.float64,)
    here = halved._cache.file_name(kind)
    monkeypatch.setattr(kernel_cache, "_compiler", lambda: ("another processor",))
    assert halved._cache.file_name(kind) != here
    assert not halved._cache.is_filled(kind)


def test_what_is_not_known_is_not_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    foreign = numba.njit(lambda x: x + 1.0)  # not compiled by us: not followed

    @compiled
    def following(x: float) -> float:
        return foreign(x)

    assert following(1.0) == 2.0
    assert list(tmp_path.iterdir()) == []


def test_a_part_raises_from_the_machine_code_that_is_loaded(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @inlined
    def checked(x: float) -> float:
        if x < 0.0:
            raise ValueError("below zero")
        return x

    @compiled
    def root(x: float) -> float:
        return np.sqrt(checked(x))

    assert root(4.0) == 2.0
    with pytest.raises(ValueError, match="below zero"):
        root(-1.0)
    assert checked(3.0) == 3.0  # as an entry of its own
    assert len(list(tmp_path.iterdir())) == 2


def test_a_part_is_compiled_once_for_a_number_and_a_constant(tmp_path, monkeypatch):
    # What an earlier run of the tests left in the cache has no parts to count.
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @inlined
    def plus(x: float, n: int) -> float:
        return x + n

    @compiled
    def summed(x: float, n: int) -> float:
        return plus(x, 1) + plus(x, n)

    assert summed(1.0, 2) == 5.0
    assert len(plus._parts) == 1


def test_the_shipped_kernels_can_all_be_kept():
    for module in ("planner.cruise.evaluation", "planner.dense.lattice.search"):
        for value in vars(importlib.import_module(module)).values():
            if hasattr(value, "_parts"):
                assert value._cache.file_name((numba.float64,)) is not None
