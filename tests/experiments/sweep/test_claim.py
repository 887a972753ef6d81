"""The claim of a sweep: what it names has to be there, before anything runs."""

import pytest

from experiments.config.sweep import DEVELOPMENT_SEEDS, PUBLISHED_SEEDS
from experiments.config.sweep_file import load_sweep, sweep_names
from experiments.errors import ConfigError
from experiments.evidence.published_sweeps import published_names
from experiments.sweep.plan import Plan

SWEEP = """\
name: small
scenarios: [thesis_straight]
planners:
- cruise
- {name: cruise_conventional, label: old, set: {ego.target_speed_mps: 9.0}}
claim: {baseline: old, primary: [travel_time_s, collided], published: true}
seeds: {first: 100000, count: 2}
"""


def runs_of(folder, text):
    path = folder / "small.yaml"
    path.write_text(text)
    return list(Plan(*load_sweep(str(path))))


def test_keys_of_a_planner_are_its_own(tmp_path):
    runs = runs_of(tmp_path, SWEEP)
    speeds = {(run.label, run.scenario.ego.target_speed_mps) for run in runs}
    assert ("old", 9.0) in speeds
    assert not any(speed == 9.0 for label, speed in speeds if label == "cruise")
    assert all(run.point == {} for run in runs)  # they are pairs


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "first: 100000",
            "first: 998",
            "small.yaml:7: seeds: has 998, of the development range 0-999 that "
            "planners are tuned on; allowed in a published sweep: others, such as "
            "100000-199999",
        ),
        ("{first: 100000, count: 2}", "[5000, 7]", "seeds: has 7, of the development"),
        ("primary: [travel_time_s, collided]", "primary: []", "claim.primary"),
        (
            "collided]",
            "colided]",
            "small.yaml:6: claim.primary: colided: no such metric; did you mean col",
        ),
        ("collided]", "seed]", "claim.primary: seed: no such metric"),
        ("collided]", "travel_time_s]", "travel_time_s is there twice"),
        (
            "published: true",
            "by: [scenario, ego.target], published: true",
            "small.yaml:6: claim.by: ego.target: no such axis; allowed: scenario",
        ),
        ("collided]", "planning_ms_p50]", "planning_ms_p50 measures the machine"),
        (
            "baseline: old",
            "baseline: odl",
            "claim.baseline: is odl; allowed: cruise, old",
        ),
        (
            "claim:",
            "axes: {grid: {ego.target_speed_mps: [8.0, 9.0]}}\nclaim:",
            "ego.target_speed_mps: is on an axis too",
        ),
        ("ego.target_speed_mps: 9.0", "ego.targt: 9.0", "small.yaml:5: ego.targt"),
    ],
)
def test_bad_claims_are_one_line(tmp_path, old, new, message):
    assert old in SWEEP
    with pytest.raises(ConfigError) as refusal:
        runs_of(tmp_path, SWEEP.replace(old, new))
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_unpublished_claims_may_use_development_seeds(tmp_path):
    text = SWEEP.replace("100000", "5").replace("published: true", "published: false")
    assert len(runs_of(tmp_path, text)) == 4


def test_shipped_sweeps_tune_and_publish_on_different_seeds():
    assert {"lane_change_paired", "lane_change_ablation"} <= set(published_names())
    for name in sweep_names():
        seeds = load_sweep(name)[0].all_seeds
        allowed = PUBLISHED_SEEDS if name in published_names() else DEVELOPMENT_SEEDS
        assert all(seed in allowed for seed in seeds), name
