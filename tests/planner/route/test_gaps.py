"""Who is behind and slower is left behind where the lane is long enough."""

import pytest

from planner.lane_change.lane_choice import bodies_on_road
from planner.lane_change.settings import LaneChangeSettings
from planner.route.gaps import gap_beside, grows_calm, seeking_speed
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car

SETTINGS = LaneChangeSettings().manoeuvre
EGO = 14.0  # [m/s]
SIDE = 1.75  # offset of the other lane [m]


def beside(ahead, speed):
    """The ego and one car in the other lane, so far ahead of it [m]."""
    scene = on_lanes(
        speed=EGO, target_speed=EGO, cars=[Car(100.0 + ahead, SIDE, speed)]
    )
    return scene, bodies_on_road(scene)


@pytest.mark.parametrize(
    ("ahead", "speed", "room", "keeps"),
    [
        (-6.0, 13.0, 250.0, True),  # a metre each second, enough of them
        (-6.0, 13.0, 20.0, False),
        (-6.0, 14.5, 250.0, False),  # it catches up
        (4.0, 13.0, 250.0, False),  # ahead of the ego's middle: let go
    ],
)
def test_the_ego_slows_down_only_for_whom_it_cannot_leave_behind(
    ahead, speed, room, keeps
):
    scene, bodies = beside(ahead, speed)
    gap = gap_beside(scene, bodies, 1, SETTINGS)
    assert not gap.is_safe
    assert gap.lack > 0.0
    assert (seeking_speed(scene, bodies, gap, room) == scene.target_speed) == keeps


@pytest.mark.parametrize(
    ("ahead", "speed", "room", "waits"),
    [
        (-12.0, 13.0, 250.0, True),
        (-12.0, 13.0, 30.0, False),  # no time left
        (-12.0, 14.0, 250.0, False),  # it does not grow
        (-30.0, 13.0, 250.0, False),  # calm already
        (12.0, 13.0, 250.0, False),  # nobody behind
    ],
)
def test_a_change_waits_for_a_gap_that_grows_calm_in_time(ahead, speed, room, waits):
    scene, bodies = beside(ahead, speed)
    assert grows_calm(scene, bodies, 1, room) == waits


def test_it_does_not_wait_where_it_would_lose_the_gap_to_who_is_ahead():
    behind, ahead = Car(88.0, SIDE, 13.0), Car(118.0, SIDE, 12.0)
    alone = on_lanes(speed=EGO, target_speed=EGO, cars=[behind])
    both = on_lanes(speed=EGO, target_speed=EGO, cars=[behind, ahead])
    assert grows_calm(alone, bodies_on_road(alone), 1, 250.0)
    assert not grows_calm(both, bodies_on_road(both), 1, 250.0)
