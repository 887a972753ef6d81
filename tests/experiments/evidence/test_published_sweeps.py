"""Which sweeps are published, whole and reduced."""

import pytest

from experiments.errors import ConfigError
from experiments.evidence.published_sweeps import (
    Reduction,
    published_names,
    published_sweeps,
)


def test_whole_sweeps_are_those_of_their_files():
    found = published_sweeps((), Reduction())
    assert [one.sweep.name for one in found] == published_names()
    for one in found:
        assert one.sweep.count == one.asked_runs
        assert len(one.sweep.all_seeds) == one.asked_seeds >= 100


def test_reduced_sweeps_keep_the_first_seeds_and_all_planners():
    only = ("traffic.density=dense", "scenario=lane_change_three")
    (whole,) = published_sweeps(["lane_change_paired"], Reduction())
    (one,) = published_sweeps(["lane_change_paired"], Reduction(8, only))
    assert list(one.sweep.all_seeds) == list(whole.sweep.all_seeds)[:8]
    assert one.sweep.planners == whole.sweep.planners
    assert one.sweep.axes.grid["traffic.density"] == ("dense",)
    assert one.sweep.scenarios == ("lane_change_three",)
    assert (one.asked_runs, one.asked_seeds) == (whole.sweep.count, 100)


def test_quick_is_little():
    for one in published_sweeps((), Reduction(quick=True)):
        assert one.sweep.count == len(one.sweep.planners)


@pytest.mark.parametrize(
    ("names", "reduction", "message"),
    [
        (["roads"], Reduction(), "roads: no such published sweep"),
        ([], Reduction(seeds=101), "--seeds 101: lane_change_ablation has 100"),
        (["lane_change_paired"], Reduction(only=("density=dense",)), "no such axis"),
        (["lane_change_paired"], Reduction(only=("scenario=x",)), "no such value"),
    ],
)
def test_what_is_not_there_is_refused(names, reduction, message):
    with pytest.raises(ConfigError, match=message):
        published_sweeps(names, reduction)
