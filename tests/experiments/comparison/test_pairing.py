import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.comparison.pairing import (
    MOST_VALUES,
    REPETITION,
    arrivals,
    cells,
    paired,
    seed_means,
    splitting_columns,
)
from experiments.comparison.results import LABEL
from experiments.errors import ConfigError
from experiments.metrics import columns

DENSITY = "traffic.density"
NUMBER = "ego.start_m"


def row(label, seed, value, **more):
    told = {
        columns.SCENARIO: "curved",
        columns.PLANNER: "cruise",
        columns.SEED: seed,
        columns.ARRIVED: value is not None,
        LABEL: label,
        columns.TRAVEL_TIME: value,
        DENSITY: "light",
        REPETITION: 0,
    }
    return {**told, **more}


def time_of(one):
    return one[columns.TRAVEL_TIME]


def groups(rows):
    (cell,) = cells(rows, [])
    return cell.groups


runs = st.lists(
    st.tuples(
        st.sampled_from("ab"),
        st.integers(0, 4),
        st.integers(0, 2),
        st.one_of(st.none(), st.floats(0, 100)),
    ),
    min_size=1,
    max_size=40,
    unique_by=lambda run: run[:3],
)


@given(runs)
def test_a_seed_counts_once_with_the_mean_of_its_runs(drawn):
    rows = [row(a, s, value, **{REPETITION: k}) for a, s, k, value in drawn]
    for label, of_seeds in groups(rows).items():
        expected = {}
        for a, seed, _, value in drawn:
            if a == label and value is not None:
                expected.setdefault(seed, []).append(value)
        means = [sum(found) / len(found) for found in expected.values()]
        found = seed_means(of_seeds, time_of)
        assert sorted(found.values.tolist()) == pytest.approx(sorted(means))
        assert found.count == len(means)


@given(runs)
def test_pairs_are_of_runs_that_both_planners_drove(drawn):
    rows = [row(a, s, value, **{REPETITION: k}) for a, s, k, value in drawn]
    of = groups(rows)
    one, other = of.get("a", {}), of.get("b", {})
    values = {run[:3]: run[3] for run in drawn}
    expected = {}
    common = []
    for (label, seed, k), value in values.items():
        if label == "b" and ("a", seed, k) in values:
            first = values["a", seed, k]
            common.append((first, value))
            if first is not None and value is not None:
                expected.setdefault(seed, []).append((first, value))
    firsts, seconds = paired(one, other, time_of)
    assert firsts.count == seconds.count == len(expected)
    difference = sum(
        sum(b - a for a, b in found) / len(found) for found in expected.values()
    )
    assert (seconds.values - firsts.values).sum() == pytest.approx(difference)
    assert arrivals(one, other) == (
        sum(a is not None for a, _ in common),
        sum(b is not None for _, b in common),
        len(common),
    )


def test_yes_or_no_is_a_flag_only_with_one_run_a_seed():
    once = groups([row("a", seed, 1.0) for seed in range(3)])["a"]
    assert seed_means(once, lambda one: one[columns.ARRIVED]).flags
    assert not seed_means(once, time_of).flags
    twice = groups([row("a", 0, 1.0, **{REPETITION: k}) for k in range(2)])["a"]
    assert not seed_means(twice, lambda one: one[columns.ARRIVED]).flags
    assert not seed_means({}, time_of).flags


def test_runs_split_by_scenario_and_axes_but_not_by_repetitions_and_samples():
    rows = [
        row("a", 0, 1.0, **{DENSITY: density, REPETITION: k, NUMBER: float(n)})
        for density in ("light", "dense")
        for k in range(2)
        for n in range(MOST_VALUES + 1)
    ]
    assert splitting_columns(rows) == [DENSITY]
    assert [cell.name for cell in cells(rows)] == ["density dense", "density light"]
    few = [one for one in rows if one[NUMBER] < 3]
    assert [cell.name for cell in cells(few, [NUMBER])] == [
        "start_m 0",
        "start_m 1",
        "start_m 2",
    ]
    assert sum(len(cell.groups["a"]["0"]) for cell in cells(few)) == len(few)


def test_without_a_label_the_planner_is_the_group():
    assert set(groups([row(None, 0, 1.0), row("b", 0, 1.0)])) == {"cruise", "b"}


def test_cells_by_what_is_no_axis_are_refused():
    with pytest.raises(ConfigError, match="--by speed: no such axis"):
        cells([row("a", 0, 1.0)], ["speed"])
