"""What cruise says of an ego that stands."""

from dataclasses import replace

import pytest

from planner import cruise
from planner.bodies import bodies_of
from planner.cruise.cycle import Cycle
from planner.cruise.no_way_on import room_beside
from planner.cruise.settings import CruiseSettings
from planner.interface import PlanStatus
from planner.vehicle import Vehicle, VehicleLimits
from tests.planner.scenes import Disc, ego_on, make_scene, straight

LORRY = Vehicle(12.0, 2.5, 6.5, 3.0, VehicleLimits(max_curvature=0.12))
FRONT = LORRY.front_reach


def scene_with(obstacle, speed=0.0, vehicle=LORRY):
    path = straight()
    scene = make_scene(path, ego_on(path, 30.0, 0.0, speed, 0.0), [obstacle], [])
    return replace(scene, vehicle=vehicle)


@pytest.mark.parametrize(
    ("l", "radius", "words"),
    [
        (0.0, 4.0, "no way round disc.0: "),
        (3.0, 2.5, "disc.0 stands 12.0 m ahead: "),
    ],
)
def test_the_room_beside_what_stands_is_told(l, radius, words):
    scene = scene_with(Disc(30.0 + FRONT + 12.0 + radius, l, radius))
    said = room_beside(scene, bodies_of(scene, 51), 3.3)
    left, right = (float(edge[0]) for edge in scene.road.at([30.0]))
    assert said.startswith(words)
    assert f"{max(left - l - radius, 0.0):.1f} m free on its left" in said
    assert f"{l - radius - right:.1f} m on its right, 3.3 m needed" in said


def test_nothing_is_told_of_a_free_road():
    scene = scene_with(Disc(200.0, 0.0, 1.0))
    assert room_beside(scene, bodies_of(scene, 51), 3.3) == ""


def test_an_ego_that_stands_before_a_wall_says_so():
    scene = scene_with(Disc(30.0 + FRONT + 6.0 + 4.5, 0.0, 4.5))
    result = cruise.proposed().plan(scene, None)
    assert result.status is PlanStatus.OK
    assert result.stats.explanation.startswith("no way round disc.0: ")


def test_a_long_body_keeps_the_room_that_it_needs_to_pull_out():
    disc = Disc(70.0, 0.0, 1.0)
    gaps = [
        float(
            Cycle.of(
                scene_with(disc, vehicle=v), CruiseSettings(), None
            ).tables.around.turn_gap[0]
        )
        for v in (Vehicle(), LORRY)
    ]
    assert gaps == pytest.approx([8.0, 19.2])


def test_a_plan_that_goes_on_past_what_stands_is_no_dead_end():
    """A lorry starts behind a parked one: 5 s do not take it past."""
    scene = scene_with(Disc(30.0 + FRONT + 19.0 + 1.3, 0.0, 1.3))
    result = cruise.proposed().plan(scene, None)
    assert result.trajectory.s[-1] - result.trajectory.s[0] > 5.0
    assert result.stats.costs["dead_end"] == 0.0
