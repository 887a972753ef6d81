"""Sweep files and the runs that they make."""

import json
import re
import shutil
from pathlib import Path

import jsonschema
import pytest
import yaml

from experiments.config.axes import Axes, axis_points
from experiments.config.scenario_file import SCENARIO_FOLDER, load_scenario, schema_text
from experiments.config.sweep import Sweep
from experiments.config.sweep_file import (
    SCHEMA_FILE,
    SWEEP_FOLDER,
    load_sweep,
    sweep_names,
    sweep_schema,
)
from experiments.episode.identity import run_hashes
from experiments.errors import ConfigError
from experiments.sweep.plan import Plan

REFERENCE = Path(__file__).parents[3] / "docs/reference/sweep_files.md"
SWEEP = """\
name: small
scenarios: [thesis_straight]
planners: [cruise]
seeds: [0, 1]
"""


def write(folder: Path, text: str) -> str:
    path = folder / "small.yaml"
    path.write_text(text)
    return str(path)


def plan_of(folder: Path, text: str) -> list:
    return list(Plan(*load_sweep(write(folder, text))))


def points(**sections) -> list[dict]:
    return list(axis_points(Axes.model_validate(sections)))


def test_grid_is_every_combination():
    found = points(grid={"a.b": (1, 2), "c": ("x", "y", "z")})
    assert len(found) == 6
    assert {(p["a.b"], p["c"]) for p in found} == {
        (a, c) for a in (1, 2) for c in ("x", "y", "z")
    }


def test_zip_goes_in_step():
    found = points(zip={"a": (1, 2), "b": (3, 4)}, grid={"c": (5, 6)})
    assert [(p["a"], p["b"], p["c"]) for p in found] == [
        (1, 3, 5),
        (2, 4, 5),
        (1, 3, 6),
        (2, 4, 6),
    ]


def test_no_axes_are_one_point():
    assert points() == [{}]


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_sample_fills_its_ranges_evenly(method):
    ranges = {"real": (-1.0, 3.0), "whole": (1, 4)}
    section = {"method": method, "count": 16, "ranges": ranges}
    found = points(sample=section)
    real = sorted(p["real"] for p in found)
    # one in each of 16 equal parts: what makes the two methods what they are
    assert [int((x + 1.0) / 4.0 * 16) for x in real] == list(range(16))
    whole = [p["whole"] for p in found]
    assert {whole.count(k) for k in (1, 2, 3, 4)} == {4}
    assert all(isinstance(k, int) for k in whole)
    assert points(sample=section) == found
    assert points(sample={**section, "seed": 1}) != found


def test_runs_are_counted_before_they_are_made(tmp_path):
    text = SWEEP.replace("[cruise]", "[cruise, cruise_conventional]") + (
        "axes:\n  grid: {ego.goal_m: [100, 120]}\n"
        "  sample: {count: 4, ranges: {ego.target_speed_mps: [10.0, 12.0]}}\n"
    )
    sweep, document = load_sweep(write(tmp_path, text))
    runs = list(Plan(sweep, document))
    assert sweep.count == len(runs) == 2 * 2 * 4 * 2
    assert len({run.run_id for run in runs}) == len(runs)
    assert [run.scenario.simulation.seed for run in runs] == [0] * 16 + [1] * 16
    assert [run.label for run in runs[:2]] == ["cruise", "cruise_conventional"]
    assert runs[0].scenario.ego.goal_m == 100
    assert 10.0 <= runs[0].scenario.ego.target_speed_mps < 12.0


def test_planners_of_users_follow_each_other(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from experiments.planners.registry import make_planner\n\n\n"
        "def make():\n    return make_planner('cruise', {})\n"
    )
    text = SWEEP.replace("[cruise]", "[cruise, 'mine:make', cruise_conventional]")
    labels = [run.label for run in plan_of(tmp_path, text)]
    assert labels == ["cruise", "cruise_conventional"] * 2 + ["mine:make"] * 2


def test_run_is_the_one_of_the_command_line(tmp_path):
    """The same identity as `rearview run` gives to the same scenario."""
    text = (
        SWEEP
        + "set: {planner.settings.margin: 0.5}\naxes: {grid: {ego.goal_m: [99]}}\n"
    )
    run = plan_of(tmp_path, text)[1]
    alone = load_scenario(
        "thesis_straight",
        planner="cruise",
        seed=1,
        overrides=["planner.settings.margin=0.5", "ego.goal_m=99"],
    )
    assert run.scenario.resolved() == alone.resolved()
    assert run.hashes == run_hashes(alone, None)


def test_planner_settings_and_labels(tmp_path):
    planners = (
        "[{name: cruise, label: wide, settings: {margin: 0.6}}, "
        "{name: cruise, label: narrow, settings: {margin: 0.2}}]"
    )
    runs = plan_of(tmp_path, SWEEP.replace("[cruise]", planners))
    assert [run.label for run in runs] == ["wide", "narrow", "wide", "narrow"]
    margins = [run.scenario.planner.settings["margin"] for run in runs]
    assert margins == [0.6, 0.2, 0.6, 0.2]


def test_scenario_files_are_relative_to_the_sweep(tmp_path):
    shutil.copy(SCENARIO_FOLDER / "thesis_straight.yaml", tmp_path / "own.yaml")
    runs = plan_of(tmp_path, SWEEP.replace("thesis_straight", "own.yaml"))
    assert runs[0].scenario.name == "thesis_straight"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("axes: {grid: {ego.goal: [1]}}", "ego.goal: unknown key; did you mean goal_m"),
        ("axes: {grid: {ego.goal_m: []}}", "allowed: a list, at least 1"),
        ("axes: {grid: {ego.goal_m: [many]}}", "ego.goal_m: is the text 'many'"),
        ("axes: {grid: {simulation.seed: [1]}}", "is not for axes; allowed: seeds"),
        ("axes: {grid: {planner.name: [sumo]}}", "is not for axes; allowed: seeds"),
        ("axes: {grid: {'a..b': [1]}}", "is not a key; allowed: key.path"),
        (
            "axes: {grid: {planner.settings.margn: [1.0]}}",
            "planner.settings.margn: unknown key; did you mean margin",
        ),
        (
            "axes: {zip: {planner.settings.margin: [0.5, wide]}}",
            "planner.settings.margin: is 'wide'",
        ),
        (
            "set: {planner.settings.weights.jrk: 1.0}",
            "planner.settings.weights.jrk: unknown key; did you mean jerk",
        ),
        (
            "axes: {zip: {ego.goal_m: [1, 2], ego.start_m: [1]}}",
            "ego.goal_m has 2, ego.start_m has 1 values; allowed: lists of the same",
        ),
        (
            "axes: {grid: {ego.goal_m: [1]}, zip: {ego.goal_m: [1]}}",
            "is on two axes",
        ),
        (
            "axes: {sample: {count: 12, ranges: {ego.goal_m: [90, 99]}}}",
            "is 12; allowed for sobol: a power of 2: 8, 16",
        ),
        (
            "axes: {sample: {count: 8, ranges: {ego.goal_m: [99, 90]}}}",
            "allowed: [least, most], rising",
        ),
        ("axes: {grids: {ego.goal_m: [1]}}", "unknown key; did you mean grid"),
        ("axes: {grid: {ego.goal_m: [90, 90]}}", "a run is there twice"),
        ("timeout_s: 0", "allowed: a number > 0"),
        ("keep_traces: some", "allowed: all, failures, none"),
    ],
)
def test_bad_sweeps_are_one_line(tmp_path, change, message):
    with pytest.raises(ConfigError) as refusal:
        plan_of(tmp_path, SWEEP + change + "\n")
    assert message in str(refusal.value)
    assert "small.yaml" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no keys"),
        (
            SWEEP.replace("thesis_straight", "thesis_strait"),
            "small.yaml:2: scenarios[0]: thesis_strait: no such scenario; did you mean",
        ),
        (SWEEP.replace("[cruise]", "[]"), "planners: is a list of 0"),
        (SWEEP.replace("[cruise]", "[cruise, cruise]"), "is the second cruise"),
        (
            SWEEP.replace("[cruise]", "['nowhere:make']"),
            "not beside the file; allowed: ",
        ),
        (
            SWEEP.replace("[cruise]", "[{name: cruise, settings: {margn: 1.0}}]"),
            "small.yaml:3: planner.settings.margn: unknown key",
        ),
        (SWEEP.replace("seeds: [0, 1]", "seeds: []"), "seeds"),
        (SWEEP.replace("seeds: [0, 1]\n", ""), "seeds: is missing"),
    ],
)
def test_bad_parts_are_one_line(tmp_path, text, message):
    with pytest.raises(ConfigError) as refusal:
        plan_of(tmp_path, text)
    assert message in str(refusal.value)


@pytest.mark.parametrize("name", sweep_names())
def test_shipped_sweeps_make_runs(name):
    sweep, document = load_sweep(name)
    assert sweep.name == name
    assert sweep.purpose
    runs = Plan(sweep, document)
    first = next(iter(runs))
    assert first.scenario.simulation.seed == sweep.all_seeds[0]
    assert isinstance(sweep, Sweep)


def test_example_of_the_reference_makes_runs(tmp_path):
    text = REFERENCE.read_text(encoding="utf-8")
    (example,) = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    file = write(tmp_path, example.replace("my_road.yaml", "lane_change_three"))
    sweep, document = load_sweep(file)
    assert sweep.count == 2 * 4 * 2 * 2 * 16 * 20
    runs = iter(Plan(sweep, document))
    labels = {run.label for run, _ in zip(runs, range(4), strict=False)}
    assert labels == {
        "sumo",
        "lane_change",
        "careful, front_headway 1",
        "careful, front_headway 1.2",
    }


def test_table_of_shipped_sweeps_counts_their_runs():
    text = REFERENCE.read_text(encoding="utf-8")
    found = dict(re.findall(r"^\| `(\w+)` \| (\d+) \|", text, re.MULTILINE))
    assert found == {name: str(load_sweep(name)[0].count) for name in sweep_names()}


@pytest.mark.slow
@pytest.mark.parametrize("name", sweep_names())
def test_all_runs_of_shipped_sweeps_are_valid(name):
    """Of the first and last seed: a seed does not decide whether a run is valid."""
    sweep, document = load_sweep(name)
    seeds = sweep.all_seeds
    few = sweep.model_copy(update={"seeds": tuple({seeds[0], seeds[-1]})})
    assert few.count * len(seeds) == sweep.count * len(few.all_seeds)
    assert sum(1 for _ in Plan(few, document)) == few.count


@pytest.mark.parametrize("name", sweep_names())
def test_json_schema_accepts_what_is_shipped(name):
    data = yaml.safe_load((SWEEP_FOLDER / f"{name}.yaml").read_text())
    jsonschema.validate(data, json.loads(SCHEMA_FILE.read_text()))


def test_json_schema_is_up_to_date():
    written = SCHEMA_FILE.read_text(encoding="utf-8")
    assert written == schema_text(sweep_schema()), "run make schema"


OWN_AXES = """\
planners:
  - cruise_conventional
  - name: cruise
    settings: {margin: 0.5}
    axes: {grid: {margin: [0.2, 0.4], weights.jerk: [1.0, 2.0]}}
"""


def test_a_planner_has_axes_of_its_own(tmp_path):
    runs = plan_of(tmp_path, SWEEP.replace("planners: [cruise]\n", OWN_AXES))
    labels = list(dict.fromkeys(run.label for run in runs))
    assert labels == [
        "cruise_conventional",
        "cruise, margin 0.2, jerk 1",
        "cruise, margin 0.2, jerk 2",
        "cruise, margin 0.4, jerk 1",
        "cruise, margin 0.4, jerk 2",
    ]
    assert len(runs) == 10
    last = runs[-1].scenario.planner.settings
    assert (last["margin"], last["weights"]["jerk"]) == (0.4, 2.0)
    assert runs[-1].point == {}, "planners are compared on the same points"
    assert "weights" not in runs[0].scenario.planner.settings


def test_labels_are_made_of_what_differs(tmp_path):
    planners = (
        "[cruise, {name: cruise, settings: {margin: 0.2, weights: {jerk: 3.0}}}, "
        "{name: cruise, settings: {margin: 0.2, weights: {jerk: 1.5}}}]"
    )
    runs = plan_of(tmp_path, SWEEP.replace("[cruise]", planners))
    assert list(dict.fromkeys(run.label for run in runs)) == [
        "cruise",
        "cruise, margin 0.2, jerk 3",
        "cruise, margin 0.2, jerk 1.5",
    ]


@pytest.mark.parametrize(
    ("planner", "message"),
    [
        ("{name: cruise, axes: {grid: {margn: [1.0]}}}", "margn: unknown key"),
        (
            "{name: cruise, settings: {margin: 1.0}, axes: {grid: {margin.a: [1]}}}",
            "margin.a: is not a setting",
        ),
        (
            "{name: cruise, axes: {sample: {count: 512, ranges: {margin: [0.1, 1]}}}}",
            "makes 512 planners; allowed: 256",
        ),
        ("{name: cruise, axes: {grid: {margin: [1.0, 1.0]}}}", "is the second"),
        ("cruise, cruise", "is the second cruise"),
    ],
)
def test_bad_axes_of_a_planner_are_one_line(tmp_path, planner, message):
    with pytest.raises(ConfigError) as refusal:
        plan_of(tmp_path, SWEEP.replace("[cruise]", f"[{planner}]"))
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)
