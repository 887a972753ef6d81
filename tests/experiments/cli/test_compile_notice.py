"""The notice comes once, when loops of ours are compiled, not when they are loaded."""

import numba
import pytest

from experiments.cli.compile_notice import NOTICE, compilation_announced


def made(module: str):
    def twice(x):
        return x + x

    twice.__module__ = module
    return numba.njit(twice)


def test_the_first_compilation_is_announced_once(capsys):
    ours, other = (
        made("planner.dense.field"),
        made("experiments.cosim.collision_monitor"),
    )
    with compilation_announced():
        assert capsys.readouterr().err == ""
        ours(1)
        assert capsys.readouterr().err == NOTICE
        other(1)
        ours(1.0)
    assert capsys.readouterr().err == ""


def test_what_is_compiled_already_and_what_is_not_ours_is_not(capsys):
    ours = made("planner.dense.field")
    ours(1)
    with compilation_announced():
        ours(1)
        made("my_planner")(1)
    ours(1.0)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("module", ["planner_of_mine", "mine.planner"])
def test_a_similar_name_is_not_ours(capsys, module):
    with compilation_announced():
        made(module)(1)
    assert capsys.readouterr().err == ""
