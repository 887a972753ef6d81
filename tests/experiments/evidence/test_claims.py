"""The numbers of a published sweep are those of the runs that were asked for."""

import json

import pytest
import yaml

from experiments.comparison.results import rebuild
from experiments.config.sweep import SeedRange
from experiments.errors import ResultsError
from experiments.evidence.claims import better, claim_data
from experiments.evidence.numbers import keep_claim, kept_claims
from experiments.evidence.published_sweeps import PublishedSweep
from experiments.metrics.metric import Better
from experiments.sweep.folder import load_sweep_copy
from tests.experiments.report.run_folders import write_sweep

SEEDS = 8


@pytest.fixture
def folder(tmp_path):
    """Return a sweep with a claim, in which `old` jerks more on every seed."""
    made = write_sweep(tmp_path / "made", seeds=SEEDS)
    content = yaml.safe_load((made / "sweep.yaml").read_text())
    content["claim"] = {"baseline": "cruise", "primary": ["rms_jerk_mps3"]}
    (made / "sweep.yaml").write_text(yaml.safe_dump(content))
    for file in made.rglob("metrics.json"):
        row = json.loads(file.read_text())
        manifest = json.loads(file.with_name("manifest.json").read_text())
        seed, old = row["seed"], manifest["sweep"]["label"] == "old"
        jerk = 1.0 + 0.01 * seed + old * (0.5 + 0.1 * (-1) ** seed)
        file.write_text(json.dumps({**row, "rms_jerk_mps3": jerk}))
    (made / "code.json").write_text(json.dumps({"sweep": "0", "code": {}}))
    rebuild(made)
    return made


def published(folder, seeds=SEEDS):
    sweep = load_sweep_copy(folder)
    asked = sweep.model_copy(update={"seeds": SeedRange(first=0, count=seeds)})
    return PublishedSweep(asked, None, 100, 800)


def test_what_was_asked_for_is_counted_and_compared(folder):
    data = claim_data(published(folder), folder)
    assert data["runs"] == 8 * SEEDS
    assert data["seeds"] == {"first": 0, "last": SEEDS - 1, "count": SEEDS}
    assert data["statuses"]["collision"] == 6
    (finding,) = (x for x in data["findings"] if x["metric"] == "rms_jerk_mps3")
    # two roads and two speeds; less jerk is better
    assert finding["planner"] == "old"
    assert (finding["better"], finding["worse"], finding["tested"]) == (0, 4, 4)
    titles = [table["title"] for table in data["tables"]]
    assert titles[0] == "RMS jerk [m/s³]"
    assert "metric" not in data["tables"][0]["header"]
    json.dumps(data, allow_nan=False)  # an end without bounds is null


def test_runs_of_other_seeds_are_left_out(folder):
    assert claim_data(published(folder, seeds=3), folder)["runs"] == 24


def test_a_folder_without_such_runs_is_refused(folder):
    other = published(folder)
    moved = other.sweep.model_copy(update={"seeds": SeedRange(first=900, count=1)})
    with pytest.raises(ResultsError, match="has no run of the sweep made"):
        claim_data(PublishedSweep(moved, None, 1, 1), folder)


def test_numbers_are_kept_for_calls_that_do_not_ask_for_them(folder, tmp_path):
    data = claim_data(published(folder), folder)
    keep_claim(data, tmp_path)
    assert kept_claims(["other", "made"], tmp_path) == [json.loads(json.dumps(data))]
    assert kept_claims(["other"], tmp_path) == []


@pytest.mark.parametrize(
    ("metric", "expected"),
    [
        ("rms_jerk_mps3", Better.LOWER),
        ("arrived", Better.HIGHER),
        ("collided", Better.LOWER),
        ("travel_time_s, penalised", Better.LOWER),
    ],
)
def test_rates_and_columns_have_a_better_direction(metric, expected):
    assert better(metric) is expected
