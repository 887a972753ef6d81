import json

import pytest

from experiments.cosim.plants.parameters import ACTUATORS, CHASSIS, PlantModel
from experiments.cosim.plants.tracked import PlantSettings
from experiments.cosim.plants.tube import (
    ErrorBounds,
    measure_tube,
    planned_vehicle,
    read_tube,
)
from experiments.errors import ConfigError
from planner.vehicle import Vehicle

SLOW = PlantSettings(
    PlantModel.DYNAMIC, CHASSIS["car"], actuators=ACTUATORS["autoware"]
)
ICE = PlantSettings(PlantModel.DYNAMIC, CHASSIS["car"], friction=0.15)


def test_a_tube_grows_with_speed_and_reads_back(tmp_path):
    tube = measure_tube(SLOW)
    slow, fast = tube.upto(5.0), tube.upto(20.0)
    assert 0.02 < slow.lateral < fast.lateral < 0.5
    file = tmp_path / "tube.json"
    file.write_text(tube.to_json())
    back = read_tube(file, SLOW).upto(20.0)
    assert back.lateral == pytest.approx(fast.lateral, abs=1e-4)
    assert back.behind == pytest.approx(fast.behind, abs=1e-4)


def test_files_that_are_not_of_this_plant_are_refused(tmp_path):
    file = tmp_path / "tube.json"
    with pytest.raises(ConfigError, match="No such file"):
        read_tube(file, SLOW)
    file.write_text(measure_tube(SLOW).to_json())
    with pytest.raises(ConfigError, match="of another plant"):
        read_tube(file, ICE)
    damaged = json.loads(file.read_text())
    damaged["cells"][0]["lateral_m"] = -1
    whole = json.loads(file.read_text())
    strange = json.loads(file.read_text())
    strange["cells"][0]["speed_mps"] = float("nan")
    for content in (
        "[]",
        "no JSON",
        json.dumps(damaged),
        '{"plant": "x"}',
        json.dumps({**whole, "cells": []}),
        json.dumps({**whole, "cells": whole["cells"][1:]}),
        json.dumps(strange),
    ):
        file.write_text(content)
        with pytest.raises(ConfigError, match="no tube file"):
            read_tube(file, SLOW)


def test_plans_are_made_with_a_larger_body_and_reachable_limits():
    vehicle = Vehicle()
    grown = planned_vehicle(vehicle, SLOW, ErrorBounds(0.2, 0.1, 0.3), 14.0)
    assert grown.width == pytest.approx(vehicle.width + 0.4)
    assert grown.rear_overhang == pytest.approx(vehicle.rear_overhang + 0.3)
    assert grown.front_reach == pytest.approx(vehicle.front_reach + 0.1)
    assert grown.limits.max_deceleration == vehicle.limits.max_deceleration
    assert 0.05 < grown.limits.max_curvature_rate < 0.2
    icy = planned_vehicle(vehicle, ICE, ErrorBounds(0.0, 0.0, 0.0), 14.0).limits
    assert icy.max_deceleration == pytest.approx(0.8 * 0.15 * 9.81)
    assert icy.max_lateral_acceleration == icy.max_deceleration
