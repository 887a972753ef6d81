"""What the sections of a search file may say."""

import re

import pytest
from pydantic import ValidationError

from experiments.config.search import Search, SearchObjective, SearchRange

SEARCH = {
    "name": "own",
    "scenario": "straight",
    "planner": "cruise",
    "space": {"simulation.seed": {"range": (0, 9)}},
    "budget": 10,
    "seed": 1,
}


def refused(make, words):
    with pytest.raises(ValidationError) as caught:
        make()
    (only,) = caught.value.errors()
    place = ".".join(map(str, only["loc"]))
    assert re.search(re.escape(words), f"{place}{only['ctx']['key']}: {only['msg']}")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "range: is one of two; allowed: range or choice"),
        ({"range": (0, 1), "choice": (1, 2)}, "range: is one of two"),
        ({"range": (1, 1)}, "range: is [1, 1]; allowed: [least, most], rising"),
        ({"range": (0.0, 1.0), "log": True}, "allowed with log: above 0"),
        ({"range": (0, 1), "mild": "a"}, "mild: is a; allowed: a number of the range"),
        ({"range": (0, 1), "mild": True}, "mild: is True; allowed: a number"),
        ({"range": (0, 1), "mild": 2}, "mild: is 2; allowed: from 0 to 1"),
        ({"choice": (1, 1)}, "choice: has a value twice; allowed: once"),
        ({"choice": (1, 2), "log": True}, "log: is of a range; allowed with choice"),
        ({"choice": (1, 2), "mild": 3}, "mild: is 3; allowed: "),
    ],
)
def test_what_is_no_range_is_named(keys, words):
    refused(lambda: SearchRange(**keys), words)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"metric": "near_miss", "margin_m": 1.0}, "margin_m: is of clearance"),
        ({"blame": "ego"}, "blame: is of near_miss; allowed with clearance: anyone"),
        (
            {"direction": "minimise"},
            "direction: is of a column; allowed with clearance",
        ),
        ({"fails_beyond": 1.0}, "fails_beyond: is of a column; allowed with clearance"),
    ],
)
def test_keys_of_another_objective_are_named(keys, words):
    refused(lambda: SearchObjective(**keys), words)


@pytest.mark.parametrize(
    ("keys", "has"),
    [
        ({}, True),
        ({"metric": "near_miss"}, True),
        ({"metric": "min_ttc_s"}, False),
        ({"metric": "min_ttc_s", "fails_beyond": 1.0}, True),
    ],
)
def test_objectives_that_say_what_a_failure_is(keys, has):
    assert SearchObjective(**keys).has_threshold is has


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            {"method": "random", "against": "random"},
            "against: is random as the method is; allowed: another method",
        ),
        (
            {"set": {"simulation.seed": 3}},
            "set: simulation.seed: is in space too; allowed: one",
        ),
        (
            {"planner": {"name": "cruise", "axes": {"grid": {"margin": (0.1, 0.2)}}}},
            "planner.axes: make several; allowed: one planner",
        ),
        (
            {"method": "subset", "objective": {"metric": "min_ttc_s"}},
            "objective.fails_beyond: is missing; allowed with method subset",
        ),
        (
            {"method": "subset", "stop_after_failures": 3},
            "stop_after_failures: would end an estimate early",
        ),
        (
            {"method": "subset", "level_trials": 40},
            "budget: is 10; allowed: at least level_trials, 40",
        ),
    ],
)
def test_keys_that_do_not_go_together_are_named(keys, words):
    refused(lambda: Search(**{**SEARCH, **keys}), words)


def test_a_comparison_doubles_the_runs():
    more = {**SEARCH, "method": "sobol"}
    one, both = Search(**more), Search(**more, against="random")
    assert both.most_runs - one.most_runs == 10
