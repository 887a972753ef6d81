"""Planners by name and by address."""

import re
import sys
from dataclasses import fields, is_dataclass, replace
from math import ceil
from typing import get_type_hints

import numpy as np
import pytest

from experiments.errors import ConfigError
from experiments.interrupts import interrupts_between_steps
from experiments.planners import registry
from experiments.planners.registry import PLANNERS, make_planner
from experiments.sweep.trial import make_apart
from planner.cruise import CruiseSettings
from planner.dense import DenseSettings
from planner.errors import PlannerError
from planner.lane_change import LaneChangeSettings
from planner.vehicle import Vehicle

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


def ints_for_floats(kind: type) -> dict[str, object]:
    """Give whole numbers to all fields of a settings class that are floats."""
    given: dict[str, object] = {}
    hints = get_type_hints(kind)
    for one in fields(kind):
        hint, default = hints[one.name], getattr(kind(), one.name)
        if is_dataclass(hint):
            given[one.name] = ints_for_floats(hint)
        elif hint in (float, float | None):
            given[one.name] = ceil(default) if default is not None else 1
        elif hint == tuple[float, ...]:
            given[one.name] = [ceil(number) for number in default]
    return given


def whole_numbers(settings: object, hints: dict[str, object]) -> list[str]:
    """Name the float fields that hold an int after all."""
    found = []
    for name, hint in hints.items():
        value = getattr(settings, name)
        if is_dataclass(hint):
            found += whole_numbers(value, get_type_hints(hint))
        elif "float" in str(hint):
            numbers = value if isinstance(value, tuple) else (value,)
            found += [name for number in numbers if type(number) is int]
    return found


FLOATS = {"cruise": 40, "lane_change": 30, "dense": 40}  # fields, at least


@pytest.mark.parametrize("name", list(FLOATS))
def test_whole_numbers_become_floats_in_every_settings_class(name):
    """A kernel that gets an int is compiled again, for minutes."""
    kind = registry._load(PLANNERS[name].settings)
    given = ints_for_floats(kind)
    tried, refused = [], []
    for key, value in flat(given):
        nested = value
        for part in reversed(key):
            nested = {part: nested}
        try:
            settings = registry._checked(nested, kind)
        except (ConfigError, PlannerError):  # the whole number itself is not allowed
            refused.append(key)
            continue
        tried.append(key)
        assert whole_numbers(settings, get_type_hints(kind)) == []
    assert len(tried) >= 0.6 * FLOATS[name], (tried, refused)


def flat(given: dict, path: tuple[str, ...] = ()):
    for key, value in given.items():
        if isinstance(value, dict):
            yield from flat(value, (*path, key))
        else:
            yield (*path, key), value


@pytest.mark.parametrize("name", ["planner:make", "experiments:make", "sumo_nets:make"])
def test_names_of_our_packages_are_taken(name):
    module = name.partition(":")[0]
    words = f"the name {module} is taken by rearview; allowed: .* my_{module}.py"
    with pytest.raises(ConfigError, match=words):
        make_planner(name, {})


MINE = """\
import no_such_package

class Slow: ...
def _hidden(): ...
def make_fast(): ...
"""


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("my_planner.py", "my_planner:make_fast"),
        ("my_planner", "my_planner:make_fast"),
        ("my_planner.py:Slow", "my_planner:Slow"),
        ("my_planner.py:make", "my_planner:make_fast"),
        ("./my_planner.py", "my_planner:make_fast"),
    ],
)
def test_a_file_instead_of_a_module_is_understood(tmp_path, monkeypatch, name, meant):
    (tmp_path / "my_planner.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as caught:
        make_planner(name, {})
    words = f"did you mean {meant}? my_planner.py offers make_fast, Slow"
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("raised", "words"),
    [
        ("__import__('asyncio').CancelledError()", "raises CancelledError"),
        ("GeneratorExit()", "raises GeneratorExit"),
        ("KeyboardInterrupt()", "raises KeyboardInterrupt"),
        ("Mute()", "raises Mute: .its text raises Mute"),
        ("ValueError('x' * 9999)", "refuses its settings: x{100,500}"),
    ],
)
def test_whatever_a_factory_or_a_module_raises_is_one_line(
    tmp_path, monkeypatch, raised, words
):
    mute = "class Mute(BaseException):\n    def __str__(self): raise self\n"
    (tmp_path / "odd_factory.py").write_text(f"{mute}def make(): raise {raised}\n")
    (tmp_path / "odd_module.py").write_text(f"{mute}raise {raised}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with interrupts_between_steps():
        for address in ("odd_factory:make", "odd_module:make"):
            monkeypatch.delitem(sys.modules, address.partition(":")[0], raising=False)
            with pytest.raises(ConfigError) as caught:
                make_planner(address, {})
            assert len(str(caught.value)) < 700
            if address.startswith("odd_factory"):
                assert re.search(words, str(caught.value))


def test_a_factory_that_ends_its_process_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "leaves.py").write_text("import os\ndef make(): os._exit(3)\n")
    (tmp_path / "crashes.py").write_text("import os\nos.abort()\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ConfigError, match="the process that makes it left with exit"):
        make_apart("leaves:make", {})
    with pytest.raises(ConfigError, match="the process that makes it died of SIGABRT"):
        make_apart("crashes:make", {})


def with_whole_numbers(record):
    """The settings with whole numbers as ints, as Python's users write them."""
    changed = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if is_dataclass(value):
            changed[field.name] = with_whole_numbers(value)
        elif isinstance(value, tuple):
            changed[field.name] = tuple(map(whole, value))
        else:
            changed[field.name] = whole(value)
    return replace(record, **changed)


def whole(value):
    return int(value) if isinstance(value, float) and value.is_integer() else value


@pytest.mark.parametrize(
    "settings", [CruiseSettings, DenseSettings, LaneChangeSettings, Vehicle]
)
def test_whole_numbers_in_settings_are_floats_where_kernels_take_floats(settings):
    # repr tells 1 from 1.0: an int would compile the kernels that it reaches anew
    assert repr(with_whole_numbers(settings())) == repr(settings())


def test_numbers_of_numpy_are_plain_and_what_is_no_number_stays():
    made = CruiseSettings(margin=np.float32(0.5), times=(np.int64(1), 2), horizon=3)
    assert repr(made.margin) == "0.5"
    assert repr(made.times) == "(1.0, 2.0)"
    assert made.edge_offsets is True
    assert made.max_curvature is None
    assert type(made.cover_discs) is int
