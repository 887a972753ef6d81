import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from experiments.cli.app import app
from experiments.comparison.event_rates import (
    effective_size,
    event_rates,
    poisson_rate,
    weighted_rate,
)
from experiments.errors import ConfigError
from tests.experiments.report.run_folders import write_sweep

REPETITIONS = 2000


def covered(intervals, truth):
    return np.mean([one.low <= truth <= one.high for one in intervals])


@pytest.mark.parametrize(("probability", "runs"), [(1e-2, 2000), (1e-3, 3000)])
def test_intervals_of_rates_per_exposure_cover(probability, runs):
    rng = np.random.default_rng(1)
    counts = rng.binomial(runs, probability, REPETITIONS)
    found = {int(k): poisson_rate(int(k), runs) for k in set(counts.tolist())}
    assert covered([found[k] for k in counts.tolist()], probability) >= 0.945


@pytest.mark.parametrize("probability", [1e-2, 1e-3, 1e-4, 1e-5])
def test_importance_sampling_finds_a_known_probability(probability):
    # P(x > limit) of a normal variable, sampled around the limit
    limit = stats.norm.isf(probability)
    rng = np.random.default_rng(2)
    intervals = []
    for _ in range(400):
        x = rng.normal(limit, 1.0, 1000)
        weights = np.exp(-limit * x + limit**2 / 2.0)
        intervals.append(weighted_rate(weights, x > limit))
    mean = np.mean([one.value for one in intervals])
    assert mean == pytest.approx(probability, rel=0.02)
    assert covered(intervals, probability) >= 0.93
    # a plain sample of the same size knows nothing of such a probability
    widths = [one.high - one.low for one in intervals]
    assert np.median(widths) < 0.5 * probability


def test_without_weights_it_is_the_exact_interval_of_a_count():
    hits = [True] * 7 + [False] * 993
    weighted = weighted_rate(np.ones(1000), hits)
    exact = poisson_rate(7, 1000.0)
    assert weighted.value == pytest.approx(exact.value)
    assert weighted.low == pytest.approx(exact.low)
    assert weighted.high == pytest.approx(exact.high)


def test_no_event_leaves_about_three_in_n():
    assert poisson_rate(0, 10_000.0).low == 0.0
    assert poisson_rate(0, 10_000.0).high == pytest.approx(3.69e-4, rel=1e-2)
    assert weighted_rate(np.ones(10_000), [False] * 10_000).high == pytest.approx(
        3.69e-4, rel=1e-2
    )


@given(
    st.lists(
        st.tuples(st.just(0.0) | st.floats(1e-9, 50.0), st.booleans()),
        min_size=1,
        max_size=60,
    )
)
def test_an_interval_holds_its_estimate(samples):
    weights = np.array([weight for weight, _ in samples])
    found = weighted_rate(weights, [hit for _, hit in samples])
    assert 0.0 <= found.low <= found.value * (1 + 1e-9)
    assert found.value <= found.high * (1 + 1e-9)
    assert 0.0 <= effective_size(weights) <= len(samples) * (1 + 1e-9)


def test_a_sweep_is_counted_by_planner(tmp_path):
    sweep = write_sweep(tmp_path / "sweep")
    everything = event_rates(sweep, "true")
    assert all(one.events == one.runs - one.lost for one in everything)
    nothing = event_rates(sweep, "min_clearance_m < -1")
    assert [one.events for one in nothing] == [0] * len(everything)
    doubled = event_rates(sweep, "true", "2.0")
    assert all(math.isclose(one.share.value, 2.0) for one in doubled)
    for event, weight in (("colisions > 0", None), ("true", "'heavy'")):
        with pytest.raises(ConfigError, match=r"^--(event|weight): "):
            event_rates(sweep, event, weight)


def test_runs_that_a_failure_has_ended_are_told(tmp_path, capsys):
    sweep = write_sweep(tmp_path / "sweep")
    file = next(iter(sorted(sweep.glob("runs/*/*/metrics.json"))))
    row = json.loads(file.read_text(encoding="utf-8"))
    file.write_text(json.dumps({**row, "status": "planner_failed"}))
    assert sum(one.broken for one in event_rates(sweep)) == 1
    with pytest.raises(SystemExit):
        app(["rate", str(sweep)])
    assert "in 1 of the runs planner or simulator failed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--weight", "0"), "--weight: is 0 in all runs of cruise; allowed: 0 or more"),
        (("--weight", "-1"), "--weight: is -1 in a run; allowed: 0 or more"),
        (("--weight", "'nan'"), "--weight: is not a number in some runs; allowed: 0"),
        (("--weight", ""), "--weight: is empty; allowed: a number"),
        (("--event", "status"), "--event: status is neither true nor false; allowed: "),
        (("--event", "collisions"), "allowed: a condition, such as collisions > 0"),
        (("--event", ""), "--event: is empty; allowed: a condition, such as coll"),
        (("--event", "colisions > 0"), "--event: there is no column colisions"),
    ],
)
def test_mistakes_name_the_option_and_what_is_allowed(tmp_path, capsys, options, words):
    with pytest.raises(SystemExit) as end:
        app(("rate", str(write_sweep(tmp_path / "sweep")), *options))
    assert end.value.code == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


@pytest.mark.parametrize("command", ["rate", "results"])
def test_a_folder_of_single_runs_is_no_sweep(tmp_path, capsys, command):
    (tmp_path / "runs" / "curved-cruise-0").mkdir(parents=True)
    with pytest.raises(SystemExit) as end:
        app((command, str(tmp_path)))
    assert end.value.code == 2
    assert "is not the folder of a sweep; allowed: " in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["runs"]


def test_runs_that_carry_a_weight_are_weighted_without_being_asked(tmp_path):
    sweep = write_sweep(tmp_path / "sweep")
    for file in sweep.glob("runs/*/*/metrics.json"):
        row = json.loads(file.read_text(encoding="utf-8"))
        file.write_text(json.dumps({**row, "importance_weight": 0.5}))
    found = event_rates(sweep, "true")
    assert all(math.isclose(one.share.value, 0.5) for one in found)
    assert all(one.per_1000_km is None for one in found)
