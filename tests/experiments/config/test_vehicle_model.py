import os

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.identity import run_hashes
from experiments.errors import ConfigError
from experiments.world_setup.vehicle_model import (
    make_plant,
    perception_settings,
    plan_timing,
    planned_body,
    plant_settings,
    tube_of,
)

PLANT = ("ego.plant=dynamic",)


def load(*overrides, planner=None):
    return load_scenario("straight", overrides=overrides, planner=planner)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (("ego.plant=dynamc",), "allowed: perfect, kinematic, dynamic"),
        (("ego.plant.friction=0.5",), "ego.plant.model: is missing"),
        ((*PLANT, "ego.vehicle.wheelbase_m=0"), "wheelbase_m: is 0; allowed"),
        ((*PLANT, "ego.actuators.steering_lag_s=-1"), "is -1; allowed: a number >= 0"),
        (
            (*PLANT, "ego.actuators.steering_dead_time_s=6"),
            "is 6; allowed: less than 3, the horizon",
        ),
        (
            (*PLANT, "ego.actuators.drive_dead_time_s=1", "simulation.horizon_s=0.9"),
            "is 1; allowed: less than 0.9",
        ),
        (
            (*PLANT, "ego.controller.period_s=0.03"),
            "simulation.step_s = 0.1 or a whole",
        ),
        (("ego.actuators=autoware",), "needs a plant; allowed: ego.plant"),
        (("ego.tube=none",), "needs a plant"),
        (("simulation.planning_period_s=0.25",), "a multiple of step_s = 0.1"),
        (("simulation.planning_delay_s=9",), "<= 5"),
        (("simulation.planning_period_s=5",), "less than the horizon"),
        (("ego.perception.missed=2",), "ego.perception.missed: is 2; allowed"),
        (("ego.perception.buildings=[[[0, 0], [1, 1]]]",), "at least 3"),
    ],
)
def test_what_cannot_be_is_one_line(overrides, message):
    with pytest.raises(ConfigError) as found:
        load(*overrides)
    assert message in str(found.value)
    assert "\n" not in str(found.value)


def test_sumos_own_driver_has_no_plant():
    with pytest.raises(ConfigError, match=r"ego\.plant: is not for planner sumo"):
        plant_settings(load(*PLANT, planner="sumo"))


def test_a_tube_file_is_looked_for_where_it_was_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenario = load(*PLANT, "ego.tube=tube.json")
    with pytest.raises(ConfigError, match=r"ego\.tube: .*tube\.json cannot be read"):
        tube_of(scenario)
    (tmp_path / "tube.json").write_text(tube_of(load(*PLANT)).to_json())
    assert tube_of(scenario).upto(10.0).lateral > 0.0
    with pytest.raises(ConfigError, match="of another plant"):
        tube_of(load(*PLANT, "ego.actuators=nuplan", "ego.tube=tube.json"))


def test_the_content_of_a_tube_file_is_part_of_the_run(tmp_path):
    file = tmp_path / "tube.json"
    scenario = load(*PLANT, f"ego.tube={file}")
    found = set()
    for content in ("one", "other"):
        file.write_text(content)
        os.utime(file, ns=(len(found), len(found)))
        found.add(run_hashes(scenario, None)["run_hash"])
    assert len(found) == 2


def test_numbers_override_presets():
    scenario = load(
        *PLANT,
        "ego.actuators=autoware",
        "ego.actuators.steering_lag_s=0.1",
        "ego.perception=poor",
        "ego.perception.range_m=90",
        "ego.plan_start=measured",
        "simulation.planning_delay_s=measured",
    )
    settings = plant_settings(scenario)
    assert settings.actuators.steering.lag == 0.1
    assert settings.actuators.steering.dead_time == 0.24
    assert settings.wheelbase == pytest.approx(2.8)
    seen = perception_settings(scenario.ego.perception)
    assert (seen.reach, seen.latency) == (90.0, 0.3)
    timing = plan_timing(scenario)
    assert (timing.rule, timing.delay) == ("measured", None)


def test_the_body_grows_unless_it_is_told_not_to():
    scenario = load(*PLANT, "ego.actuators=autoware")
    own = scenario.ego.vehicle.to_planner()
    assert planned_body(load()) is None
    assert planned_body(scenario).width > own.width + 0.1
    kept = planned_body(load(*PLANT, "ego.actuators=autoware", "ego.tube=none"))
    assert (kept.width, kept.length) == (own.width, own.length)


def test_a_resolved_scenario_reads_back(tmp_path):
    from experiments.config.scenario_file import config_text

    scenario = load(*PLANT, "ego.actuators=nuplan", "ego.perception=good")
    file = tmp_path / "again.yaml"
    file.write_text(config_text(scenario.resolved()), encoding="utf-8")
    assert load_scenario(str(file)).resolved() == scenario.resolved()
    assert make_plant(load()).__class__.__name__ == "PerfectTracking"
    for key in ("plant", "perception", "actuators"):
        assert key not in load().resolved()["ego"]
