"""Scenarios, sweeps and searches that are given to the command of another kind."""

import pytest

from experiments.config.scenario_file import load_scenario, scenario_names
from experiments.config.search_file import load_search
from experiments.config.sweep_file import load_sweep, sweep_names
from experiments.errors import ConfigError

SWEEP = "name: mine\nscenarios: [curved]\nplanners: [cruise]\nseeds: [1]\n"
SEARCH = "name: mine\nscenario: cut_in\nplanner: cruise\nspace: {a: [1, 2]}\n"
SCENARIO = "name: mine\nnetwork: curved\nego: {goal_m: 200}\n"


@pytest.mark.parametrize(
    ("load", "given", "content", "hint"),
    [
        (load_scenario, "smoke", "", "is a sweep; did you mean rearview sweep smoke?"),
        (load_scenario, "FILE", SWEEP, "is a sweep; did you mean rearview sweep FILE?"),
        (load_sweep, "curved", "", "is a scenario; did you mean rearview run curved?"),
        (
            load_scenario,
            "cut_in_search",
            "",
            "is a search; did you mean rearview search",
        ),
        (load_scenario, "FILE", SEARCH, "is a search; did you mean rearview search FI"),
        (load_sweep, "cut_in_search", "", "is a search; did you mean rearview search "),
        (load_sweep, "FILE", SEARCH, "is a search; did you mean rearview search FILE?"),
        (load_search, "smoke", "", "is a sweep; did you mean rearview sweep smoke?"),
        (load_search, "FILE", SCENARIO, "is a scenario; did you mean rearview run FI"),
        (load_sweep, "FILE", SCENARIO, "is a scenario; did you mean rearview run FILE"),
    ],
)
def test_the_other_command_is_named(tmp_path, load, given, content, hint):
    file = tmp_path / "mine.yaml"
    file.write_text(content)
    name = given.replace("FILE", str(file))
    with pytest.raises(ConfigError) as refusal:
        load(name)
    found = str(refusal.value).replace(str(file), "FILE")
    assert found.startswith(f"{given}: {hint}")


def test_shipped_names_that_both_have_are_what_was_asked_for():
    both = set(scenario_names()) & set(sweep_names())
    assert "dense" in both
    for name in both:
        assert load_scenario(name).name == load_sweep(name)[0].name == name


def test_a_folder_of_the_name_hides_no_shipped_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("dense", "smoke"):
        (tmp_path / name).mkdir()
    assert load_scenario("dense").name == "dense"
    assert load_sweep("smoke")[0].name == "smoke"
    (tmp_path / "mine").mkdir()
    with pytest.raises(ConfigError, match="mine: is a folder"):
        load_scenario("mine")


def test_a_file_that_is_neither_is_checked_as_asked(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("name: mine\nspeed: 3\n")
    with pytest.raises(ConfigError, match="speed: unknown key; allowed: name, "):
        load_scenario(str(file))
    with pytest.raises(ConfigError, match="is missing; allowed: "):
        load_sweep(str(file))
    file.write_text("name: mine\n")
    with pytest.raises(ConfigError, match="ego: is missing; allowed: a section with"):
        load_scenario(str(file))
