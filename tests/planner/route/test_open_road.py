"""Where the road opens round what stands: nearer than lines, junctions and turns."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.lane_change.lane_choice import bodies_on_road
from planner.right_of_way.records import JunctionAhead, Rule
from planner.route import proposed
from planner.route.memory import Driver
from planner.route.open_road import obstacle_ahead, opens_at
from planner.route.planner import CRAWLED
from planner.scene import Lanes
from tests.planner.scenes import Car, Disc, cars, discs, ego_on, make_scene, straight

WIDTH = 3.5
PATH = straight(500.0)


def scene(obstacles, gone=None, **more):
    """Three lanes, of which the outer ones may be gone between two places."""
    s = np.array([0.0, 500.0])
    width = np.full((3, s.size), WIDTH)
    if gone is not None:
        s = np.array([0.0, gone[0], gone[0] + 0.1, gone[1], gone[1] + 0.1, 500.0])
        width = np.full((3, s.size), WIDTH)
        width[[0, 2], 2:4] = 0.0
    centre = np.outer([-WIDTH, 0.0, WIDTH], np.ones(s.size))
    made = make_scene(PATH, ego_on(PATH, 100.0), obstacles=discs(PATH, obstacles))
    return replace(made, lanes=Lanes(s, centre, width), **more)


def opened(made):
    return opens_at(made, bodies_on_road(made), 1)


def junction(stop, end):
    return JunctionAhead("j", Rule.MINOR, stop, end, 8.0)


IN_LANE, BESIDE, FAR = Disc(170.0, 0.5, 1.0), Disc(170.0, 3.5, 1.0), Disc(210.0, 0, 1)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (scene([IN_LANE]), -math.inf),
        (scene([BESIDE]), math.inf),
        (scene([FAR]), math.inf),
        (scene([IN_LANE], stop_lines=(130.0,)), 130.0),
        (scene([IN_LANE], stop_lines=(190.0,)), -math.inf),
        (scene([IN_LANE], stop_lines=(130.0,), junctions=(junction(130, 150),)), 150.0),
        (scene([IN_LANE], junctions=(junction(160.0, 180.0),)), 160.0),
        (scene([IN_LANE], (130.0, 145.0)), 145.1),
        (scene([IN_LANE, Disc(190.0, 0.0, 1.0)], (180.0, 185.0)), -math.inf),
        (scene([IN_LANE], (60.0, 85.0)), -math.inf),
    ],
)
def test_the_road_opens_behind_lines_and_turns(made, expected):
    assert opened(made) == pytest.approx(expected)
    near = math.isinf(expected)
    if made.obstacles.ids and bodies_on_road(made).s[0] < 200.0:
        assert obstacle_ahead(made, bodies_on_road(made)) == near


def stands_before(obstacles, vehicles=()):
    """One lane between edges that leave no way on, the ego standing for 3 s."""
    made = make_scene(PATH, ego_on(PATH, 100.0, speed=0.0), discs(PATH, obstacles))
    made = replace(made, vehicles=cars(PATH, vehicles))
    centre, width = np.array([[0.0]]), np.array([[WIDTH]])
    made = replace(made, lanes=Lanes(np.zeros(1), centre, width))
    plan = proposed().plan(made, None)
    return made, replace(plan.memory, stood=3.0)


def test_dense_takes_no_queue_for_obstacles():
    beyond = [Disc(150.0, 0.0, 0.8)]
    made, memory = stands_before(beyond)
    assert proposed().plan(made, memory).memory.driver is Driver.DENSE
    made, memory = stands_before(beyond, [Car(113.0, 0.0, 0.5)])
    assert proposed().plan(made, memory).memory.driver is Driver.CRUISE


def test_dense_hands_back_where_it_does_not_get_on():
    made, memory = stands_before([Disc(150.0, 0.0, 0.8)])
    memory = proposed().plan(made, memory).memory
    memory = replace(memory, crawled=CRAWLED - 1.5 * made.step)
    memory = proposed().plan(made, memory).memory  # it still stands
    assert memory.driver is Driver.DENSE
    memory = proposed().plan(made, memory).memory
    memory = proposed().plan(made, memory).memory
    assert memory.driver is Driver.CRUISE
    assert memory.stood < 1.0
