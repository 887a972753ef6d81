"""The list of compiled functions: it can be read, and what is driven stands in it."""

import json
import os
import subprocess
import sys
from enum import Enum

import numba
import numpy as np
import pytest
from numba.core import types

from experiments.cli import kernel_list
from experiments.cli.app import app
from experiments.cli.compile_notice import compilation_announced
from experiments.cli.kernel_list import DRIVES, family_of, missing
from experiments.planners.registry import PLANNERS

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="nothing is compiled with NUMBA_DISABLE_JIT"
)


def test_every_listed_function_is_there_and_its_arguments_can_be_read():
    listed = kernel_list.kernel_list()
    assert set(listed) == set(DRIVES)
    for family, signatures in listed.items():
        assert len(signatures) > 10, family
        for signature in signatures:
            kernel, arguments = kernel_list._kernel(signature)
            assert kernel is not None, signature[0]
            words = [kernel_list._words(each) for each in arguments]
            assert words == signature[1:], signature[0]


def test_every_planner_that_compiles_has_a_family():
    without = {name for name in PLANNERS if family_of(name) is None}
    assert without.isdisjoint(
        name for name in PLANNERS if name.startswith(("cruise", "dense", "lane_change"))
    )
    assert family_of("my_planner:make") is None


def test_types_of_arguments_are_read_as_written():
    frozen = np.zeros(3)
    frozen.setflags(write=False)
    for value in (1.0, 2, True, frozen, np.zeros((2, 2)), (), (1.0, frozen), (1, 2)):
        kind = numba.typeof(value)
        assert (
            kernel_list._type(json.loads(json.dumps(kernel_list._words(kind)))) == kind
        )
    omitted = types.misc.Omitted(0.5)
    assert kernel_list._type(kernel_list._words(omitted)) == omitted


def test_a_type_without_words_is_refused():
    class Colour(Enum):
        RED = 1

    with pytest.raises(TypeError, match="Colour"):
        kernel_list._words(numba.typeof(Colour.RED))


def test_nothing_is_compiled_ahead_where_it_cannot_be_kept(
    tmp_path, monkeypatch, capsys
):
    (tmp_path / "file").touch()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "file" / "cache"))
    with compilation_announced(["cruise"]):
        pass
    assert capsys.readouterr().err == ""


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("family", list(DRIVES))
def test_what_is_driven_is_listed(family):
    driven = subprocess.run(
        [sys.executable, "-m", "experiments.cli.kernel_list", family],
        capture_output=True,
        text=True,
        check=True,
    )
    called = json.loads(driven.stdout.splitlines()[-1])
    assert called == kernel_list.kernel_list()[family]


@pytest.mark.slow
def test_the_command_fills_the_cache_so_that_nothing_is_missing(tmp_path, monkeypatch):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "experiments", "compile", "cruise"]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env=environment
    )
    assert done.stderr == ""
    n = len(kernel_list.kernel_list()["cruise"])
    assert done.stdout == f"compiled {n} functions into {tmp_path}\n"
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert missing(["cruise"]) == []
    again = subprocess.run(
        command, capture_output=True, text=True, check=True, env=environment
    )
    assert again.stdout == f"compiled 0 functions into {tmp_path}\n"


def test_the_command_refuses_what_is_no_family(capsys):
    with pytest.raises(SystemExit) as left:
        app(["compile", "cruse"])
    out, err = capsys.readouterr()
    assert (left.value.code, out) == (2, "")
    assert "did you mean cruise?" in err
    assert err.count("\n") == 1
