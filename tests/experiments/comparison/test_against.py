"""Results against earlier ones of the same sweep."""

import duckdb
import pytest

from experiments.comparison.against import (
    RegressionRule,
    compare_with_earlier,
    read_results,
    regressions,
)
from experiments.comparison.results import LABEL
from experiments.errors import ConfigError, ResultsError
from experiments.metrics.catalogue import ALL_COLUMNS

BOTH = (RegressionRule.SIGNIFICANT, RegressionRule.WORSE)


def results(n=20, label="mine", scenario="curved", **change):
    rows = []
    for seed in range(n):
        known = dict.fromkeys(ALL_COLUMNS)
        known |= {"scenario": scenario, "planner": "p", "seed": seed, LABEL: label}
        known |= {"arrived": True, "status": "arrived", "collisions": 0}
        known |= {"travel_time_s": 20.0 + seed % 5, "min_clearance_m": 1.0 + seed % 3}
        for name, value in change.items():
            known[name] = value(seed, known[name])
        rows.append({"ego.goal_m": 100.0, **known})
    return rows


def found(now, before, rule, metrics=None):
    lines = compare_with_earlier(now, before, metrics)
    return {(x.line.where, x.line.metric) for x in regressions(lines, rule)}


@pytest.mark.parametrize("rule", BOTH)
def test_the_same_results_are_no_regression(rule):
    assert found(results(), results(), rule) == set()


@pytest.mark.parametrize("rule", BOTH)
def test_what_is_worse_is_found_and_what_is_better_is_not(rule):
    slower = {"travel_time_s": lambda seed, value: value + 1.0 + 0.1 * (seed % 2)}
    closer = {"min_clearance_m": lambda seed, value: value + 0.5 + 0.1 * (seed % 2)}
    now, before = results(**slower, **closer), results()
    here = found(now, before, rule)
    assert {metric for _, metric in here} == {"travel_time_s"}
    assert "curved" in next(iter(here))[0]
    assert {metric for _, metric in found(before, now, rule)} == {"min_clearance_m"}


def test_one_collision_more_is_worse_but_may_be_chance():
    hit = {"collisions": lambda seed, value: int(seed == 3)}
    now = results(**hit)
    assert found(now, results(), RegressionRule.SIGNIFICANT) == set()
    worse = found(now, results(), RegressionRule.WORSE)
    assert {metric for _, metric in worse} == {"collided"}


def test_each_planner_is_compared_with_itself():
    slower = {"travel_time_s": lambda seed, value: value + 5.0 + 0.1 * (seed % 2)}
    before = results() + results(label="theirs")
    now = results() + results(label="theirs", **slower)
    here = found(now, before, RegressionRule.SIGNIFICANT, ["travel_time_s"])
    assert len(here) == 1
    assert "theirs" in next(iter(here))[0]


def test_runs_that_are_gone_are_no_pass():
    before = results() + results(scenario="straight")
    with pytest.raises(ConfigError, match=r"straight, mine.*: was not run; allowed"):
        compare_with_earlier(results(), before)
    other = [{**row, "seed": row["seed"] + 100} for row in results()]
    with pytest.raises(ConfigError, match="has no seed in common"):
        compare_with_earlier(other, results())


def test_earlier_results_without_a_column_of_today_are_read():
    before = [{k: v for k, v in row.items() if k != "min_pet_s"} for row in results()]
    assert found(results(), before, RegressionRule.WORSE) == set()


def test_files_that_are_no_results_are_refused(tmp_path):
    with pytest.raises(ResultsError, match="No such file"):
        read_results(tmp_path / "none.parquet")
    (tmp_path / "text.parquet").write_text("text")
    with pytest.raises(ResultsError, match="cannot be read"):
        read_results(tmp_path / "text.parquet")
    with duckdb.connect() as database:
        database.execute(f"COPY (SELECT 1 AS a) TO '{tmp_path}/a.parquet'")
    with pytest.raises(ResultsError, match=r"lacks .*; allowed: a copy"):
        read_results(tmp_path / "a.parquet")
