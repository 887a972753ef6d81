"""The parts of a search by themselves: space, objective, methods, groups, reduction."""

import json
import sys

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from experiments.config.scenario_file import schema_text
from experiments.config.search import Search, SearchObjective, SearchRange
from experiments.config.search_file import (
    SEARCH_FOLDER,
    SEARCH_SCHEMA_FILE,
    load_search,
    search_names,
    search_schema,
)
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.row import row_without_episode
from experiments.sweep.search.clusters import cluster_failures
from experiments.sweep.search.coverage import space_coverage
from experiments.sweep.search.exploration import Tried
from experiments.sweep.search.exploration import explore as explore_with
from experiments.sweep.search.objective import TrialJudgement, judge
from experiments.sweep.search.proposals import make_proposer
from experiments.sweep.search.reduction import reduce_failures
from experiments.sweep.search.space import SearchSpace, share_of, value_at

FLOAT = SearchRange(range=(1.0, 9.0))
WHOLE = SearchRange(range=(1, 4))
LOG = SearchRange(range=(0.01, 100.0), log=True)
WHOLE_LOG = SearchRange(range=(1, 1000), log=True)
CHOICE = SearchRange(choice=("left", "right", "both"))
METHODS = ("random", "sobol", "directed", "tpe", "cma_es", "subset")


def search_of(space, **keys):
    return Search(
        name="s", scenario="cut_in", planner={"name": "cruise"}, space=space, **keys
    )


def explore(search, space, run):
    """Run the trials of a search whose mild point is where all coordinates are 0."""
    proposer = make_proposer(search, space, np.zeros(len(space.keys)))
    return explore_with(search, space, run, proposer)


def fails_near(corner, radius, kind="contact"):
    """Return what runs points: those near a corner fail, worse the nearer they are."""

    def run(points):
        found = []
        for point in points:
            apart = [point[key] - corner[key] for key in corner]
            away = np.linalg.norm(apart) - radius
            failed = kind if away < 0.0 else ""
            found.append(Tried(json.dumps(point), TrialJudgement(float(away), failed)))
        return found

    return run


@pytest.mark.parametrize("one", [FLOAT, WHOLE, LOG, WHOLE_LOG, CHOICE])
@given(share=st.floats(0.0, 1.0))
def test_a_value_is_at_its_own_coordinate(one, share):
    value = value_at(one, share)
    assert value_at(one, share_of(one, value)) == value
    if one.range is not None:
        assert one.range[0] <= value <= one.range[1]
    assert 0.0 <= share_of(one, value) <= 1.0


def test_a_log_range_is_spread_over_its_logarithm():
    assert value_at(LOG, 0.5) == pytest.approx(1.0)
    assert value_at(WHOLE, 0.0) == 1
    assert value_at(WHOLE, 1.0) == 4
    assert isinstance(value_at(WHOLE, 0.6), int)


def test_mild_values_are_the_scenarios_own_or_given():
    ranges = {
        "a.b": FLOAT,
        "a.c": WHOLE,
        "d[0]": SearchRange(range=(0.0, 1.0), mild=1.0),
    }
    space = SearchSpace(ranges)
    scenario = {"a": {"b": 20.0}, "d": [0.5]}
    assert space.mild_point(scenario) == {"a.b": 9.0, "a.c": 3, "d[0]": 1.0}


def row(**values):
    return {
        **row_without_episode("s", "p", 0, "arrived"),
        columns.COLLISIONS: 0,
        **values,
    }


def test_clearance_goes_on_below_zero_as_impact_speed():
    objective = SearchObjective(margin_m=0.5)
    near = judge(objective, row(min_clearance_m=0.3))
    assert near.robustness == pytest.approx(-0.2)
    assert near.kind == "too close"
    assert not judge(objective, row(min_clearance_m=0.6)).failed
    crash = row(
        status="collision",
        collisions=1,
        first_collision_with="car.12",
        impact_speed_mps=7.0,
        verdict="other at fault",
    )
    found = judge(objective, crash)
    assert found.robustness == pytest.approx(-7.5)
    assert found.kind == "contact with car, other at fault"


def test_a_column_has_a_direction_and_maybe_a_threshold():
    least = SearchObjective(metric="min_ttc_s", direction="minimise", fails_beyond=1.0)
    assert judge(least, row(min_ttc_s=0.8)).failed
    assert not judge(least, row(min_ttc_s=1.2)).failed
    assert judge(least, row(min_ttc_s=None)).robustness is None
    most = SearchObjective(metric="max_drac_mps2", direction="maximise")
    assert judge(most, row(max_drac_mps2=9.0)).robustness == -9.0
    assert not judge(most, row(max_drac_mps2=9.0)).failed


def test_a_run_that_could_not_be_made_is_no_failure():
    lost = judge(SearchObjective(), row(status="crashed"), "invalid_configuration")
    assert lost == TrialJudgement(None)
    assert judge(SearchObjective(), row(status="crashed"), "process_died").failed


@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_gives_the_same_trials(method):
    search = search_of(
        {"x": FLOAT, "y": FLOAT}, method=method, budget=30, batch=7, level_trials=20
    )
    space = SearchSpace(search.space)
    run = fails_near({"x": 9.0, "y": 9.0}, 1.0)
    one, other = explore(search, space, run), explore(search, space, run)
    assert [trial.point for trial in one] == [trial.point for trial in other]
    assert len(one) == 30
    assert [trial.number for trial in one] == list(range(1, 31))


@pytest.mark.parametrize("method", METHODS)
def test_choices_and_whole_numbers_can_be_searched(method):
    search = search_of(
        {"x": WHOLE, "side": CHOICE}, method=method, budget=20, level_trials=20
    )
    space = SearchSpace(search.space)

    def run(points):
        return [
            Tried("r", TrialJudgement(None if p["side"] == "both" else float(p["x"])))
            for p in points
        ]

    seen = {trial.point["side"] for trial in explore(search, space, run)}
    assert seen == {"left", "right", "both"}


@pytest.mark.parametrize("method", ["directed", "tpe", "cma_es"])
def test_a_method_that_learns_finds_a_rare_failure_sooner(method):
    space = SearchSpace({"x": FLOAT, "y": FLOAT, "z": FLOAT})
    run = fails_near({"x": 8.0, "y": 2.0, "z": 5.0}, 0.5)
    needed = {}
    for name in ("random", method):
        counts = []
        for seed in range(3):
            search = search_of(
                space.ranges, method=name, seed=seed, budget=400, stop_after_failures=1
            )
            counts.append(len(explore(search, space, run)))
        needed[name] = np.median(counts)
    assert needed[method] <= 0.5 * needed["random"]  # a ball of 0.1 % of the space


@pytest.mark.slow
@pytest.mark.parametrize("method", ["directed", "tpe", "cma_es"])
def test_a_method_that_learns_leaves_a_valley_without_failures(method):
    """A wide valley at small x holds no failure; a narrow one at large x does."""
    space = SearchSpace({"x": FLOAT, "y": FLOAT})
    failure = fails_near({"x": 8.6, "y": 5.0}, 0.15)

    def run(points):
        found = []
        for point, one in zip(points, failure(points), strict=True):
            valley = abs(point["x"] - 2.0) + 0.1
            value = min(one.judgement.robustness, valley)
            kind = "contact" if one.judgement.robustness < 0.0 else ""
            found.append(Tried("r", TrialJudgement(value, kind)))
        return found

    needed = []
    for seed in range(3):
        keys = {"method": method, "seed": seed, "stop_after_failures": 1}
        search = search_of(space.ranges, budget=2000, **keys)
        needed.append(len(explore(search, space, run)))
    assert np.median(needed) < 0.5 * 64.0 / (np.pi * 0.15**2)  # of chance


@pytest.mark.parametrize(
    ("method", "package"), [("tpe", "optuna"), ("cma_es", "cmaes")]
)
def test_a_missing_package_is_named(method, package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ConfigError, match=f"method: {method} needs {package}: pip"):
        explore(search_of({"x": FLOAT}, method=method), SearchSpace({"x": FLOAT}), None)


def test_a_near_miss_slopes_where_clearance_does_not():
    objective = SearchObjective(metric="near_miss")
    calm = {"min_clearance_m": 4.0, "min_ttc_s": 4.0, "max_drac_mps2": 2.0}
    late = {**calm, "min_ttc_s": 3.0}
    hard = {**late, "max_drac_mps2": 6.0}
    values = [judge(objective, row(**one)).robustness for one in (calm, late, hard)]
    assert values[0] > values[1] > values[2] > 0.0
    assert judge(objective, row()).robustness is None
    crash = row(status="collision", collisions=1, impact_speed_mps=7.0)
    assert judge(objective, crash).robustness == -7.0


def test_contacts_that_are_not_the_egos_fault_can_be_left_out():
    objective = SearchObjective(metric="near_miss", blame="ego")
    crash = {"status": "collision", "collisions": 1, "impact_speed_mps": 7.0}
    faults = {"ego at fault": True, "shared": True, "other at fault": False}
    for verdict, fails in faults.items():
        found = judge(objective, row(**crash, verdict=verdict))
        assert found.failed is fails
        assert (found.robustness < 0.0) is fails


def test_a_directed_search_begins_at_the_end_farthest_from_the_mild_values():
    ranges = {"x": FLOAT, "y": FLOAT, "z": FLOAT, "side": CHOICE}
    space = SearchSpace(ranges)
    search = search_of(ranges, method="directed", budget=16)
    proposer = make_proposer(search, space, np.array([0.0, 1.0, 0.0, 0.5]))
    asked = [space.point(at) for at in proposer.ask(8)]
    assert [asked[0][key] for key in "xyz"] == [9.0, 1.0, 9.0]
    ends = {tuple(point[key] for key in "xyz") for point in asked}
    assert len(ends) == 8  # every three keys have all combinations
    assert {point["side"] for point in asked} == {"left", "right", "both"}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"objective": {"metric": "min_ttc_s", "direction": "minimise"}},
            "with method subset: a number",
        ),
        ({"stop_after_failures": 2}, "would end an estimate early"),
        ({"budget": 30}, "at least level_trials, 200"),
    ],
)
def test_what_makes_no_estimate_is_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        search_of({"x": FLOAT}, method="subset", **{"budget": 200, **keys})


def test_failures_are_grouped_by_kind_and_place():
    space = SearchSpace({"x": FLOAT, "side": CHOICE})
    search = search_of(space.ranges, budget=64, method="sobol")

    def run(points):
        return [
            Tried("r", TrialJudgement(-1.0, "contact"))
            if p["x"] < 2.0 or p["x"] > 8.0
            else Tried("r", TrialJudgement(1.0))
            for p in points
        ]

    groups = cluster_failures(space, explore(search, space, run))
    assert len(groups) == 6  # two ends, three sides
    assert len({trial.number for one in groups for trial in one.trials}) == sum(
        len(one.trials) for one in groups
    )
    for one in groups:
        assert len({trial.point["side"] for trial in one.trials}) == 1


def test_a_failure_is_reduced_to_the_edge_of_what_fails():
    space = SearchSpace({"x": FLOAT, "y": FLOAT, "side": CHOICE})
    mild = {"x": 1.0, "y": 1.0, "side": "left"}
    asked = []

    def run(points):
        asked.extend(points)
        return [
            Tried("r", TrialJudgement(5.0 - p["x"], "contact" if p["x"] > 5.0 else ""))
            for p in points
        ]

    search = search_of(space.ranges, budget=40)
    worst = [one.worst for one in cluster_failures(space, explore(search, space, run))]
    asked.clear()
    (found,) = reduce_failures(worst[:1], mild, space, run, 24)
    assert found.point["y"] == 1.0
    assert found.point["side"] == "left"
    assert 5.0 < found.point["x"] < 5.5
    assert found.runs == len(asked) <= 24


def test_reduction_stops_at_its_number_of_runs():
    space = SearchSpace({"x": FLOAT, "y": FLOAT})
    run = fails_near({"x": 9.0, "y": 9.0}, 4.0)
    trials = explore(search_of(space.ranges, budget=40), space, run)
    worst = [one.worst for one in cluster_failures(space, trials)]
    (found,) = reduce_failures(worst, {"x": 1.0, "y": 1.0}, space, run, 3)
    assert found.runs == 3


def test_coverage_counts_the_cells_of_two_keys():
    space = SearchSpace({"x": FLOAT, "n": WHOLE})
    half = [
        np.array([x, n]) for x in np.linspace(0, 0.49, 8) for n in np.linspace(0, 1, 8)
    ]
    found = space_coverage(space, half)
    assert found.cells == 32
    assert found.pairs == 0.5


def test_shipped_searches_fit_the_committed_schema():
    text = SEARCH_SCHEMA_FILE.read_text(encoding="utf-8")
    assert text == schema_text(search_schema()), "run make schema"
    for name in search_names():
        load_search(name)
        data = yaml.safe_load((SEARCH_FOLDER / f"{name}.yaml").read_text())
        jsonschema.validate(data, json.loads(text))


BAD = {
    "sapce: {}": "unknown key; did you mean space? allowed: name, purpose, scenario",
    "space: {conflict.gap_m: [5.0, 5.0]}": "[5.0, 5.0]; allowed: [least, most]",
    "space: {conflict.gap_m: {range: [-1.0, 5.0], log: true}}": "with log: above 0",
    "space: {conflict.gap_m: [-5.0, 5.0]}": "search.yaml:4: conflict.gap_m",
    "space: {conflict.gpa_m: [1.0, 5.0]}": "search.yaml:4: conflict.gpa_m: unknown key",
    "space: {conflict.gap_m: {choice: [5.0, 5.0]}}": "has a value twice",
    "objective: min_ttc_s": "objective.direction: is missing; allowed",
    "objective: nearmiss": "nearmiss: no such metric; did you mean near_miss?",
    "objective: {metric: min_tcc_s, direction: minimise}": "did you mean min_ttc_s",
    "objective: {metric: status, direction: minimise}": "status: no such metric",
    "objective: {metric: clearance, blame: ego}": "allowed with clearance: anyone",
    "method: anneal": "allowed: random, sobol, directed, tpe",
    "against: random": "against: is random as the method is",
    "set: {conflict.gap_m: 3.0}": "conflict.gap_m: is in space too",
    "scenario: cut_out_": "search.yaml:2: scenario: cut_out_: no such scenario; did yo",
    "space: {simulation.duration_s: [0.0, 5.0]}": "search.yaml:4: simulation.duration",
    "space: {traffic.drivers.cooperation: [0.0, 1.0]}": (
        "search.yaml:4: traffic.drivers.cooperation: 0.0: "
    ),
    "space: {conflict.profile: {choice: [linear]}}": "conflict.profile.choice",
    "method: {subset: 1}": "method",
    "budget: 0": "budget: is 0; allowed",
}


@pytest.mark.parametrize("line", BAD)
def test_a_mistake_is_one_line_with_file_key_and_what_is_allowed(
    line, tmp_path, capsys
):
    from experiments.cli.app import app

    keys = {
        "name": "name: s",
        "scenario": "scenario: cut_in",
        "planner": "planner: cruise",
        "space": "space: {conflict.gap_m: [10.0, 20.0]}",
    }
    keys[line.partition(":")[0]] = line
    path = tmp_path / "search.yaml"
    path.write_text("\n".join(keys.values()))
    with pytest.raises(SystemExit) as stop:
        app(["search", str(path), "--dry-run"])
    message = capsys.readouterr().err
    assert stop.value.code == 2
    assert message.count("\n") == 1
    assert BAD[line] in message
