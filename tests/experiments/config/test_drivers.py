"""Mistakes in `traffic.drivers` are one line each."""

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.errors import ConfigError

NO_FLOW = (
    *tuple(f"traffic.{key}=0" for key in ("own_veh_per_h", "oncoming_veh_per_h")),
    "traffic.cross_veh_per_h=0",
)
MISTAKES = {
    ("traffic.drivers={population: urban, cooperation: 1.5}",): "cooperation: is 1.5",
    ("traffic.drivers={population: urban, late_mergers: -0.1}",): "late_mergers: is",
    ("traffic.drivers={population: rural}",): "allowed: calm, urban, motorway",
    ("traffic.drivers={cooperation: 0.5}",): "population: is missing",
    (
        "traffic.drivers={population: urban, near_ego_factor: 3}",
    ): "near_ego_factor: is 3 of no errors; allowed: 1",
    (
        "traffic.drivers={population: urban, near_ego_factor: 0.5, stalls_per_h: 1}",
    ): "near_ego_factor: is 0.5; allowed",
    (
        "traffic.cautious_share=0.7",
        "traffic.aggressive_share=0.7",
    ): "allowed: at most 1",
    ("traffic.van_share=0.8", "traffic.truck_share=0.3"): "allowed: at most 1",
    ("traffic.drivers=urban", *NO_FLOW): "drivers: urban: of no vehicles; allowed",
    ("traffic.drivers=urban", "traffic.temper=normal"): "is given beside temper",
}


@pytest.mark.parametrize("overrides", MISTAKES)
def test_a_mistake_is_one_line(overrides):
    with pytest.raises(ConfigError) as caught:
        load_scenario("straight", overrides=overrides)
    message = str(caught.value)
    assert "\n" not in message
    assert MISTAKES[overrides] in message


@pytest.mark.parametrize(
    "drivers", ["{population: urban, cooperation: 0.5}", "distracted"]
)
def test_drivers_of_a_single_ego_are_refused_with_many(drivers):
    overrides = (f"traffic.drivers={drivers}",)
    with pytest.raises(ConfigError, match="is of a single ego; allowed"):
        load_scenario("motorway", overrides=overrides)
