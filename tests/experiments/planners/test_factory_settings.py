"""Settings that a factory does not take, in words of the scenario file."""

import pytest

from experiments.errors import ConfigError
from experiments.planners.factory_settings import check_factory_settings
from experiments.planners.registry import make_planner


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


def test_a_planner_without_settings():
    with pytest.raises(ConfigError) as refusal:
        make_planner("cruise_thesis", {"x": 1})
    expected = "planner.settings.x: unknown key; cruise_thesis has none"
    assert str(refusal.value) == expected
