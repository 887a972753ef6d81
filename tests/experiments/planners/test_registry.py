"""Planners by name and by address."""

import pytest

from experiments.errors import ConfigError
from experiments.planners.registry import PLANNERS, make_planner

MODULE = "tests.experiments.constant_speed_planner"


@pytest.mark.parametrize("name", list(PLANNERS))
def test_known_planners_can_be_made(name):
    assert callable(make_planner(name, {}).plan)


def test_settings_reach_the_planner():
    planner = make_planner("cruise", {"margin": 0.4, "weights": {"jerk": 2.0}})
    assert planner.settings.margin == 0.4
    assert planner.settings.weights.jerk == 2.0
    default = make_planner("cruise", {}).settings
    assert planner.settings.weights.safety == default.weights.safety
    assert make_planner("cruise", {"times": (1, 2)}).settings.times == (1.0, 2.0)


def test_own_planner_without_registration():
    assert make_planner(f"{MODULE}:make", {"nan_at": 2.0}).planner.nan_at == 2.0


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("cruse", {}, "did you mean cruise[?] allowed: cruise, .*module:factory"),
        ("cruise", {"margn": 1}, "settings.margn: unknown key; did you mean margin"),
        ("cruise", {"margin": "wide"}, "settings.margin: is 'wide'; input should be"),
        ("cruise", {"margin": True}, "settings.margin: is True; input should be"),
        ("cruise", {"margin": float("nan")}, "settings.margin: .* finite"),
        (
            "cruise",
            {"weights": {"jrk": 1}},
            "weights.jrk: unknown key; did you mean jerk",
        ),
        ("cruise", {"safety_term": "none"}, "safety_term: .*'edge_clearance'"),
        (
            "cruise",
            {"lateral_step": -1},
            "^planner.settings.lateral_step: is -1; allowed: > 0$",
        ),
        (
            "dense",
            {"drive": {"time_step": 7}},
            "^planner.settings.drive.time_step: is 7; allowed: between 0.05 and 0.5$",
        ),
        ("dense", {"drive": 3}, "drive: is 3; allowed: a section with keys"),
        ("dense", {"margins": [0.1, 0.2]}, "is .0.1, 0.2.; allowed: one or more"),
        ("dense", {"sides": {"solver": "x"}}, "sides.solver: is 'x'; allowed: ricc"),
        ("cruise", {"cover_discs": 2}, "cover_discs: is 2; allowed: 1, 3"),
        ("cruise", {"stop_times": [0.01]}, "planner.settings: times = "),
        ("cruise_thesis", {"margin": 1}, "margin: unknown key; cruise_thesis has none"),
        ("no_such_module:make", {}, "cannot import no_such_module"),
        (f"{MODULE}:mak", {}, "has no mak; did you mean make"),
        (f"{MODULE}:NOT_CALLABLE", {}, "NOT_CALLABLE is of type int"),
        (f"{MODULE}:no_planner", {}, "returned object; allowed: an object with plan"),
        (f"{MODULE}:make", {"depth": 1}, "refuses its settings: .*depth"),
        (":make", {}, "allowed: module:factory"),
        (
            "mine.py:make",
            {},
            "mine.py is not a module name; allowed: .* without folder",
        ),
        ("folder/mine:make", {}, "folder/mine is not a module name"),
        ("..mine:make", {}, "is not a module name"),
        (f"{MODULE}:fails", {}, "fails raises RuntimeError: no licence"),
        (f"{MODULE}:leaves", {}, "leaves raises SystemExit: no licence"),
    ],
)
def test_mistakes(name, settings, message):
    with pytest.raises(ConfigError, match=message) as caught:
        make_planner(name, settings)
    assert str(caught.value).startswith("planner")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def make(:", "importing broken raises SyntaxError"),
        ("1 / 0", "importing broken raises ZeroDivisionError: division by zero"),
        ("import sys; sys.exit(3)", "importing broken raises SystemExit: 3"),
        ("import no_such_thing", "cannot import broken: No module named 'no_such"),
    ],
)
def test_modules_that_cannot_be_imported(tmp_path, monkeypatch, text, message):
    (tmp_path / "broken.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ConfigError, match=message):
        make_planner("broken:make", {})


def test_a_missing_factory_is_looked_for_among_the_modules_own():
    with pytest.raises(ConfigError, match="has no mke") as caught:
        make_planner(f"{MODULE}:mke", {})
    assert "ConstantSpeed" in str(caught.value)
    assert "Trajectory" not in str(caught.value), "that one is imported"
