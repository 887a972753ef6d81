"""Which modules a file may name as its planner."""

import sys

import pytest

from experiments.config.planner_modules import require_allowed
from experiments.config.scenario_file import load_scenario
from experiments.config.sweep_file import load_sweep, planner_folders
from experiments.errors import ConfigError

SCENARIO = """\
name: empty_road
world: kinematic
road: {{segments: [[line, 300]]}}
ego: {{goal_m: 60}}
planner: {{name: "{}", settings: {{command: "echo gotcha"}}}}
"""
SWEEP = "name: s\nscenarios: [straight]\nplanners: ['{}']\nseeds: [1]\n"


@pytest.fixture(autouse=True)
def search_path(monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))


def write(folder, planner: str, text: str = SCENARIO) -> str:
    file = folder / "file.yaml"
    file.write_text(text.format(planner))
    return str(file)


STRANGERS = ["os:system", "subprocess:run", "mine:make", "numpy:save", "a.b:make"]


@pytest.mark.parametrize("name", STRANGERS)
def test_a_module_that_is_not_beside_the_file_is_refused(tmp_path, name):
    module = name.partition(":")[0]
    words = rf"planner: {name}: a file may not name .* --allow-planner {module}$"
    with pytest.raises(ConfigError, match=rf"file.yaml:5: {words}"):
        load_scenario(write(tmp_path, name))
    with pytest.raises(ConfigError, match=rf"file.yaml:3: {words}"):
        load_sweep(write(tmp_path, name, SWEEP))


@pytest.mark.parametrize("module", ["os", "numpy", "planner", "yaml"])
def test_a_file_beside_does_not_lend_its_name_to_another_module(tmp_path, module):
    """Python has loaded the other one: a planner `os:system` would run it."""
    (tmp_path / f"{module}.py").touch()
    with pytest.raises(ConfigError, match="a file may not name the module"):
        load_scenario(write(tmp_path, f"{module}:make"))


def test_a_module_beside_the_file_is_allowed_and_found(tmp_path):
    (tmp_path / "mine.py").touch()
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "inner.py").touch()
    for name in ("mine:make", "pack.inner:make"):
        assert load_scenario(write(tmp_path, name)).planner.name == name
    sweep, document = load_sweep(write(tmp_path, "mine:make", SWEEP))
    assert sys.path[0] == str(tmp_path)
    assert planner_folders(sweep, document) == (str(tmp_path),)
    assert planner_folders(*load_sweep("smoke")) == ()


@pytest.mark.parametrize("allowed", ["a", "a.b"])
def test_modules_may_be_allowed(tmp_path, allowed):
    file = write(tmp_path, "a.b:make")
    assert load_scenario(file, allow_planners=[allowed]).planner.name == "a.b:make"
    assert load_sweep(write(tmp_path, "a.b:make", SWEEP), [allowed])


def test_another_allowed_module_does_not_help(tmp_path):
    with pytest.raises(ConfigError, match="may not name"):
        require_allowed("ab:make", "here", tmp_path, ["a", "a.b"])


def test_whoever_names_it_on_the_command_line_may(tmp_path):
    file = write(tmp_path, "os:system")
    assert load_scenario(file, planner="os:system").planner.name == "os:system"
    chosen = load_scenario(file, overrides=["planner.name=mine:make"])
    assert chosen.planner.name == "mine:make"
    assert load_scenario(file, overrides=["planner=mine:make"])


def test_other_options_do_not_make_it_allowed(tmp_path):
    file = write(tmp_path, "os:system")
    for option in ("planner.settings.command=ls", "ego.goal_m=50"):
        with pytest.raises(ConfigError, match="may not name"):
            load_scenario(file, overrides=[option])
    short = tmp_path / "short.yaml"
    lines = SCENARIO.format("x").splitlines()[:4]
    short.write_text("\n".join([*lines, "planner: os:system"]))
    with pytest.raises(ConfigError, match="may not name"):
        load_scenario(str(short), overrides=["planner.settings.command=ls"])
