"""Drivers who open a gap for an ego that indicates."""

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.cooperation import (
    LASTS,
    REACH,
    Cooperation,
    CooperationSettings,
)
from experiments.episode.run import run_episode
from planner.interface import Indicator

NOBODY = frozenset()


class Vehicles:
    """Stands for SUMO: who is behind on each side, and what was asked."""

    def __init__(self, left=(), right=()):
        self.beside = {0: left, 1: right}
        self.asked = []

    def getIDList(self):
        return tuple(name for side in self.beside.values() for name, _ in side)

    def getNeighbors(self, name, mode):
        return self.beside[mode]

    def openGap(self, name, *settings):
        self.asked.append(name)

    def deactivateGapControl(self, name):
        self.asked.append(f"no more {name}")


class Sumo:
    def __init__(self, vehicle):
        self.vehicle = vehicle


def cooperation(vehicles, probability=1.0, hidden=NOBODY):
    settings = CooperationSettings(3, probability)
    return Cooperation(Sumo(vehicles), settings, "ego", hidden)


def test_the_nearest_behind_in_the_indicated_lane_is_asked_until_it_is_over():
    vehicles = Vehicles(left=[("far", 30.0), ("near", 10.0)], right=[("other", 5.0)])
    asks = cooperation(vehicles)
    asks.update(0.0, Indicator.NONE)
    assert vehicles.asked == []
    asks.update(0.1, Indicator.LEFT)
    asks.update(0.2, Indicator.LEFT)
    assert vehicles.asked == ["near"]
    asks.update(0.1 + LASTS, Indicator.LEFT)  # SUMO's gap control ends by itself
    assert vehicles.asked == ["near", "near"]
    asks.update(5.0, Indicator.NONE)
    assert vehicles.asked == ["near", "near", "no more near"]


def test_who_is_far_or_nobody_is_not_asked():
    vehicles = Vehicles(left=[("ghost", 1.0), ("far", REACH + 1.0)])
    cooperation(vehicles, hidden=frozenset({"ghost"})).update(0.0, Indicator.LEFT)
    assert vehicles.asked == []


def test_as_many_drivers_cooperate_as_asked_for_and_the_same_ones_again():
    names = [f"car.{k}" for k in range(2000)]
    asks = cooperation(Vehicles(), 0.3)
    helpful = [name for name in names if asks.cooperates(name)]
    assert len(helpful) == pytest.approx(600, abs=100)
    assert helpful == [name for name in names if asks.cooperates(name)]


@pytest.mark.slow
def test_an_ego_changes_lanes_sooner_among_drivers_who_cooperate(tmp_path):
    done = {}
    for probability in (0.0, 1.0):
        drivers = f"{{population: aggressive, cooperation: {probability}}}"
        overrides = ("traffic.density=dense", f"traffic.drivers={drivers}")
        scenario = load_scenario("lane_change_leader", seed=5, overrides=overrides)
        row = run_episode(scenario, out=tmp_path / str(probability)).row
        done[probability] = row["lane_change_done_s"]
    assert done[1.0] < 0.5 * done[0.0]
