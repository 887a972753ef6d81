"""Who is met by an ego that swings out over the middle of the road."""

import numpy as np
import pytest

from experiments.cosim.junctions import RoadJunction, Swing
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.records import TrafficState
from experiments.cosim.right_of_way import RightOfWay, closed_lines
from experiments.cosim.road import EgoTask, Road
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.right_of_way.records import JunctionAhead, Rule
from planner.states import CartesianState
from planner.vehicle import Vehicle
from planner.ways import Ways
from tests.experiments.road_users import road_users

PATH = ReferencePath.from_segments([line(400.0)])
CAR = Vehicle()
STOP, BEGIN, END = 99.0, 100.0, 112.0
# the lane of oncoming vehicles is 3.2 m to the left; the body takes 0.9 m of it
PLACES = np.column_stack([np.arange(BEGIN, END), np.full(12, 2.5)])
SWING = RoadJunction(
    JunctionAhead("oncoming", Rule.MINOR, STOP, END, 5.0),
    (),
    "",
    0,
    swings=(Swing(BEGIN, END, PLACES),),
)


class Oncoming:
    """A world in which one vehicle comes along a lane at an offset."""

    def __init__(self, l, stop=np.inf):
        self.stop = stop
        x = np.linspace(400.0, 0.0, 41)
        self.line = np.vstack([400.0 - x, x, np.full(41, l)])

    def movements(self, near, vehicles):
        n = len(vehicles.ids)
        return (), Ways(np.zeros(n, dtype=int), np.full(n, self.stop), (self.line,))


def lines(x, speed, l=3.2, swing=SWING, stop=np.inf, steps=1):
    road = Road(PATH, constant_bounds(PATH, 5.0), junctions=(swing,))
    rules = RightOfWay(road, EgoTask(CAR, 390.0, 13.0), Oncoming(l, stop), 0.1)
    users = road_users(("car", x, l, np.pi, speed, 0.0), length=4.0, width=2.0)
    s = STOP - 5.0 - CAR.front_reach
    ego = CartesianState(s, 0.0, 0.0, 0.0, 4.0, 0.0)
    for _ in range(steps):
        _, decided = rules.update(TrafficState(0.0, users), s, ego)
    return closed_lines(decided)


@pytest.mark.parametrize(
    ("x", "speed", "waits"),
    [
        (140.0, 10.0, True),  # comes
        (108.0, 10.0, True),  # is there
        (95.0, 10.0, False),  # is past
        (190.0, 16.0, True),  # comes, fast, from afar
        (330.0, 10.0, False),  # far away
        (140.0, 0.0, False),  # stands, in a queue of its own
    ],
)
def test_the_ego_waits_for_who_comes(x, speed, waits):
    assert lines(x, speed) == ((STOP,) if waits else ())


def test_who_waits_at_a_line_before_does_not_come():
    assert lines(140.0, 10.0, stop=20.0) == ()
    assert lines(140.0, 10.0, stop=60.0) == (STOP,)


def test_who_drives_farther_to_the_side_is_not_met():
    assert lines(140.0, 10.0, l=4.5) == ()


def test_each_stretch_outside_the_lanes_counts_for_itself():
    # out at 100 to 104 m and, round the bend, at 190 to 194 m
    parts = tuple(
        Swing(x, x + 4.0, np.column_stack([np.arange(x, x + 4.0), np.full(4, 2.5)]))
        for x in (BEGIN, BEGIN + 90.0)
    )
    ahead = JunctionAhead("oncoming", Rule.MINOR, STOP, BEGIN + 94.0, 5.0)
    apart = RoadJunction(ahead, (), "", 0, swings=parts)
    whole = Swing(BEGIN, BEGIN + 94.0, np.vstack([x.places for x in parts]))
    as_one = RoadJunction(ahead, (), "", 0, swings=(whole,))
    # who comes between the two is at the first one when the ego has left it
    assert lines(150.0, 7.0, swing=as_one) == (STOP,)
    assert lines(150.0, 7.0, swing=apart) == ()
    assert lines(125.0, 7.0, swing=apart) == (STOP,)
    # before the second one the ego does not wait: nobody may be on the way there,
    # while who is there already is gone in time
    assert lines(215.0, 7.0, swing=apart) == (STOP,)
    assert lines(193.0, 7.0, swing=apart) == ()


def test_who_brakes_to_a_stand_for_a_moment_still_comes():
    """It sets off again at once, while the ego is on its lane."""
    assert lines(120.0, 0.1, steps=5) == (STOP,)
    assert lines(120.0, 0.1, steps=25) == ()
