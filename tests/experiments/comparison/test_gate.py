"""Conditions of --fail-if: a small language, safe and with errors of one line."""

import operator
import statistics
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.comparison.gate import Condition, judge
from experiments.comparison.junit import junit_xml
from experiments.comparison.results import FAILURE, LABEL
from experiments.errors import ConfigError
from experiments.metrics.catalogue import ALL_COLUMNS


def row(**known):
    base = dict.fromkeys(ALL_COLUMNS)
    base |= {"run_id": "ab", LABEL: "mine", FAILURE: None, "reason": "r", "wall_s": 1.5}
    base |= {"scenario": "curved", "seed": 0, "status": "arrived", "arrived": True}
    return {**base, "collisions": 0, **known}


TWO = [row(min_ttc_s=1.0), row(seed=1, arrived=False, min_ttc_s=4.0, status="timeout")]


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("collisions > 0", False),
        ("arrived < 0.95", True),
        ("collisions > 0 or arrived < 0.95", True),
        ("collisions > 0 and arrived < 0.95", False),
        ("not collisions > 0", True),
        ("min(min_ttc_s) == 1", True),
        ("max(min_ttc_s) - min(min_ttc_s) > 3.5", False),
        ("0 < arrived < 1", True),
        ("runs != 2 or lost > 0", False),
        ('planner == "mine" and scenario == "curved"', True),
        ("count(min_pet_s) > 0 and min(min_pet_s) < 1", False),
        ("sum(min_ttc_s) / runs >= 2.5", True),
        ("-collisions < 0", False),
    ],
)
def test_conditions(text, met):
    (verdict,) = judge(TWO, [Condition.read(text)])
    assert verdict.met is met


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "cannot be understood"),
        ("collisions >", "cannot be understood"),
        ("collisions = 0", "cannot be understood"),
        ("(" * 400, "cannot be understood"),
        ("collisions > 0 or " * 40, "is too long"),
        ("collisions", "is no condition"),
        ("1 + 1", "is no condition"),
        ("collisons > 0", "did you mean collisions?"),
        ("men(min_ttc_s) > 0", "did you mean mean?"),
        ("min(min_tct_s) > 0", "did you mean min_ttc_s?"),
        ("min(1) > 0", "is not allowed"),
        ("__import__('os') > 0", "is not allowed"),
        ("(lambda: 1)() > 0", "is not allowed"),
        ("scenario.__class__ == 'a'", "is not allowed"),
        ("[x for x in 'a'] == 'a'", "is not allowed"),
        ("arrived ** 9 > 1", "is not allowed"),
        ("True", "is not allowed"),
        ("collisions or arrived < 1", "allowed here: a condition"),
        ("not collisions", "allowed here: a condition"),
        ("scenario + 1 > 2", "allowed here: a number"),
        ("collisions > " + "9" * 400, "holds a number that is too large"),
        ("scenario < 'b'", "compares what cannot be compared"),
        ("scenario == 1", "compares what cannot be compared"),
        ("collisions in 'a'", "compares what cannot be compared"),
        ("(arrived > 0) == 1", "compares what cannot be compared"),
        ("seed > 0", "no such metric"),
    ],
)
def test_mistakes_are_one_line(text, words):
    with pytest.raises(ConfigError) as caught:
        Condition.read(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 900


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "min(min_pet_s) < 1",
            "applies to no run of curved, mine; allowed: ask",
        ),
        ("runs / collisions > 1", "divides by zero for curved, mine"),
    ],
)
def test_what_cannot_be_decided_is_said(text, words):
    with pytest.raises(ConfigError, match=words):
        judge(TWO, [Condition.read(text)])
    with pytest.raises(ConfigError, match="no runs"):
        judge([], [Condition.read("runs > 0")])


@given(st.text(max_size=60))
def test_no_text_does_anything_but_read_or_refuse(text):
    problem = ""
    try:
        Condition.read(text)
    except ConfigError as error:
        problem = str(error)
    assert "\n" not in problem


FUNCTIONS = {
    "mean": statistics.fmean,
    "median": statistics.median,
    "min": min,
    "max": max,
    "sum": sum,
    "p95": lambda values: np.quantile(values, 0.95),
}
SIGNS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


@given(
    st.lists(st.one_of(st.none(), st.integers(-50, 50)), min_size=1, max_size=9),
    st.sampled_from(sorted(FUNCTIONS)),
    st.sampled_from(sorted(SIGNS)),
    st.integers(-50, 50),
)
def test_figures_are_those_of_the_runs_that_have_a_value(values, name, sign, limit):
    rows = [row(seed=k, mean_speed_mps=value) for k, value in enumerate(values)]
    known = [value for value in values if value is not None]
    condition = Condition.read(f"{name}(mean_speed_mps) {sign} {limit}")
    if not known:
        with pytest.raises(ConfigError, match="applies to no run"):
            judge(rows, [condition])
        return
    expected = float(FUNCTIONS[name](known))
    (verdict,) = judge(rows, [condition])
    assert verdict.values[
        "mean_speed_mps" if name == "mean" else f"{name}(mean_speed_mps)"
    ] == pytest.approx(expected)
    if abs(expected - limit) > 1e-9:
        assert verdict.met is SIGNS[sign](expected, limit)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            'planner == "mien" and arrived < 2',
            "no run is of planner 'mien'; did you mean mine? allowed: mine, other",
        ),
        (
            'not "town" != scenario',
            "no run is of scenario 'town'; allowed: curved, straight",
        ),
    ],
)
def test_names_that_no_run_is_of_are_refused(text, words):
    rows = [*TWO, row(scenario="straight", **{LABEL: "other"})]
    with pytest.raises(ConfigError) as caught:
        judge(rows, [Condition.read(text)])
    assert str(caught.value) == f"--fail-if {text}: {words}"


def test_every_scenario_and_planner_is_judged_by_itself():
    rows = [*TWO, row(**{LABEL: "theirs"}), row(scenario="straight", collisions=2)]
    verdicts = judge(rows, [Condition.read("collisions > 0 or arrived < 0.95")])
    found = {(v.scenario, v.planner): v.met for v in verdicts}
    assert found == {
        ("curved", "mine"): True,
        ("curved", "theirs"): False,
        ("straight", "mine"): True,
    }
    assert "arrived = 0.5" in str(verdicts[0])


def test_junit_without_conditions_fails_runs_that_do_not_arrive():
    lost = row(seed=2, arrived=False, status="crashed", **{FAILURE: "memory"})
    odd = row(seed=3, reason='a\x00b <&"')
    root = ET.fromstring(junit_xml("s", [*TWO, lost, odd]))
    (suite,) = root
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == (
        "4",
        "1",
        "1",
    )
    assert root.get("time") == "6.000"
    assert [case.get("name") for case in suite][:2] == ["seed 0", "seed 1"]
    assert suite[1].find("failure").get("type") == "timeout"
    assert suite[2].find("error").get("type") == "memory"
    assert 'a?b <&"' in suite[3].find("system-out").text


def test_junit_with_conditions_fails_by_them_alone():
    verdicts = judge(TWO, [Condition.read(t) for t in ("arrived < 1", "lost > 0")])
    (suite,) = ET.fromstring(junit_xml("s", TWO, verdicts))
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["not arrived < 1"]
    assert suite.get("tests") == "4"


def test_a_group_whose_runs_are_all_lost_fails():
    """Nothing is known of it: that is no mistake in the condition."""
    lost = [
        row(seed=k, status="died", **{FAILURE: "died"}) | {"collisions": None}
        for k in range(2)
    ]
    condition = Condition.read("collisions > 0")
    (verdict,) = judge(lost, [condition])
    assert verdict.met
    assert str(verdict) == "curved, mine: collisions > 0 (lost = 2)"
    asked = Condition.read('planner != "mine" and collisions > 0')
    assert not asked.judge(lost, "curved", "mine").met
    assert Condition.read("lost == 2").judge(lost, "curved", "mine").met
    with pytest.raises(ConfigError, match="applies to no run"):
        judge([*lost, row(seed=2, collisions=None)], [condition])
    text = junit_xml("s", lost, [verdict])
    assert ET.fromstring(text.partition("\n")[2]).get("failures") == "1"
