"""Whether the gap is safe, and whether a change that does not bind may go on."""

import numpy as np
import pytest

from planner.lane_change.phases.cycle_view import blockage_ahead, look
from planner.lane_change.phases.gap_safety import has_way_out
from planner.lane_change.settings import LaneChangeSettings
from planner.states import SpeedProfile
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.test_planner import WALL_HALF_LENGTH, wall
from tests.planner.scenes import Car

SETTINGS = LaneChangeSettings()
SPEED = 19.0
STOP = SPEED * 4.5 / (2.0 * 5.0) + SPEED**2 / (2.0 * 4.5)  # jerk 5 m/s³, then 4.5 m/s²
DRIVEN = 0.1 * SPEED  # until the next cycle


def way_out(room, start, cars=()):
    front = 100.0 + on_lanes().vehicle.front_reach
    blocked = wall(front + room + WALL_HALF_LENGTH)
    here = look(on_lanes(speed=SPEED, cars=cars, obstacles=blocked), SETTINGS)
    assert blockage_ahead(here, 0) == pytest.approx(room)
    t = np.array([0.0, 1.0])
    held = SpeedProfile(t, SPEED * t, np.full(2, SPEED), np.zeros(2), np.zeros(2))
    return has_way_out(here, 1, room, held, start, SETTINGS)


@pytest.mark.parametrize("start", [0.0, 20.0])
def test_who_can_still_stop_and_pull_out_may_go_on(start):
    beside = [Car(100.0, 1.75, SPEED)]
    assert way_out(STOP + DRIVEN + 7.1, start, beside)


def test_beyond_that_a_change_goes_on_only_now_and_into_a_safe_gap():
    room = STOP + DRIVEN + 6.9
    assert way_out(room, 0.0)
    assert not way_out(room, 20.0)
    assert not way_out(room, 0.0, [Car(100.0, 1.75, SPEED)])


def test_nothing_ahead_leaves_every_way_out():
    here = look(on_lanes(speed=SPEED), SETTINGS)
    t = np.array([0.0, 1.0])
    held = SpeedProfile(t, SPEED * t, np.full(2, SPEED), np.zeros(2), np.zeros(2))
    assert has_way_out(here, 1, blockage_ahead(here, 0), held, 20.0, SETTINGS)
