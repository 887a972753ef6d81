"""Settings that a factory does not take, in words of the scenario file."""

from datetime import date
from pathlib import Path
from typing import Literal

import pytest

from experiments.errors import ConfigError
from experiments.planners.factory_settings import check_call, check_factory_settings
from experiments.planners.registry import make_planner
from planner.vehicle import Vehicle


def make(gain, speed=1.0, *, lanes=2):
    return gain, speed, lanes


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"gain": 1, "speeed": 2}, "speeed: unknown key; did you mean speed? allowed:"),
        ({"gain": 1, "x": 2}, "x: unknown key; allowed: gain, speed, lanes"),
        ({"speed": 2}, "gain: is missing; own:make needs it"),
    ],
)
def test_wrong_keys(settings, problem):
    with pytest.raises(ConfigError) as refusal:
        check_factory_settings("own:make", make, settings)
    assert str(refusal.value).startswith(f"planner.settings.{problem}")


def test_right_keys_and_factories_that_take_any():
    check_factory_settings("own:make", make, {"gain": 1, "lanes": 3})
    check_factory_settings("own:make", lambda **_: None, {"x": 1})
    check_factory_settings("own:make", dict, {"x": 1})  # has no signature


class Typed:
    def __init__(
        self,
        braking: float = 3.0,
        mode: Literal["fast", "slow"] = "fast",
        gaps: tuple[float, ...] = (1.0,),
        limit: float | None = None,
        body: Vehicle | None = None,
    ):
        self.braking = braking


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"braking": "hard"}, "braking: is 'hard'; input should be a valid number"),
        ({"braking": True}, "braking: is True; input should be a valid number"),
        ({"braking": None}, "braking: is None; input should be a valid number"),
        ({"mode": "wild"}, "mode: is 'wild'; input should be 'fast' or 'slow'"),
        ({"gaps": [1, "x"]}, "gaps.1: is 'x'; input should be a valid number"),
        ({"gaps": 3}, "gaps: is 3; input should be a valid "),
    ],
)
def test_wrong_types_are_refused_before_the_run(settings, problem):
    with pytest.raises(ConfigError) as refusal:
        check_factory_settings("own:Typed", Typed, settings)
    assert str(refusal.value).startswith(f"planner.settings.{problem}")


@pytest.mark.parametrize(
    "settings",
    [
        {"braking": 2, "mode": "slow", "gaps": [1, 2.5], "limit": 4},
        {"limit": None, "gaps": []},
        {"body": None},
    ],
)
def test_right_types(settings):
    check_factory_settings("own:Typed", Typed, settings)


def test_annotations_that_mean_nothing_are_left_to_the_factory():
    def odd(one: "No such type" = 1, *, two: Path = Path()):  # noqa: F722
        return one, two

    check_factory_settings("own:odd", odd, {"one": "x"})
    check_factory_settings("own:odd", odd, {"two": date(2026, 1, 1)})


def test_a_planner_without_settings():
    with pytest.raises(ConfigError) as refusal:
        make_planner("cruise_thesis", {"x": 1})
    expected = "planner.settings.x: unknown key; cruise_thesis has none"
    assert str(refusal.value) == expected


class Planners:
    def fits(self, scene, memory): ...

    def takes_more(self, scene, memory=None, *, careful=False): ...

    def takes_any(self, *arguments): ...

    def takes_none(self): ...

    def takes_one(self, scene): ...

    def needs_more(self, scene, memory, other): ...


@pytest.mark.parametrize("method", ["fits", "takes_more", "takes_any"])
def test_methods_that_take_what_they_are_called_with_are_fine(method):
    check_call("my:make", Planners(), method, "scene, memory")


@pytest.mark.parametrize(
    ("method", "written"),
    [
        ("takes_none", r"takes_none\(\)"),
        ("takes_one", r"takes_one\(scene\)"),
        ("needs_more", r"needs_more\(scene, memory, other\)"),
    ],
)
def test_methods_of_another_signature_are_refused(method, written):
    expected = rf"planner: my:make: {written} .*allowed: {method}\(scene, memory\)"
    with pytest.raises(ConfigError, match=expected):
        check_call("my:make", Planners(), method, "scene, memory")


def test_methods_without_a_signature_are_left_alone():
    class Odd:
        plan = dict  # of the interpreter: it has none to be read

    check_call("my:make", Odd(), "plan", "scene, memory")
