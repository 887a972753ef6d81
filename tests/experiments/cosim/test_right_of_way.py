"""Which junctions are decided on, and what a signal's letter makes of a rule."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.junctions import ConflictZone, RoadJunction
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.right_of_way import RightOfWay, closed_lines
from experiments.cosim.road import EgoTask, Road
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.right_of_way.records import JunctionAhead, Rule
from planner.states import CartesianState
from planner.vehicle import Vehicle
from planner.ways import Ways
from tests.experiments.road_users import road_users
from tests.planner.right_of_way.test_gaps import FOE

PATH = ReferencePath.from_segments([line(400.0)])
CAR = Vehicle()
TASK = EgoTask(CAR, 390.0, 13.0)


class World:
    """A world with the same foes for ever."""

    def __init__(self, *foes):
        self.foes = foes
        self.asked = []

    def movements(self, near, vehicles):
        self.asked.append(set(near))
        found = tuple(foe for foe in self.foes if foe.junction in near)
        n = len(vehicles.ids)
        return found, Ways(np.full(n, -1), np.full(n, np.inf), ())


def junction(rule, stop_s=100.0, signal=""):
    ahead = JunctionAhead("j", rule, stop_s, stop_s + 20.0, 8.0)
    return RoadJunction(ahead, (), signal, 0)


def decide(world, *junctions, s=90.0, speed=5.0, signals=(), cars=()):
    road = Road(PATH, constant_bounds(PATH, 5.0), junctions=junctions)
    rules = RightOfWay(road, TASK, world, 0.1)
    users = road_users(*cars, length=4.0, width=2.0)
    state = TrafficState(0.0, users, tuple(signals))
    ego = CartesianState(s, 0.0, 0.0, 0.0, speed, 0.0)
    state, decided = rules.update(state, s - CAR.front_reach, ego)
    return state, closed_lines(decided)


def test_a_foe_closes_the_line():
    state, lines = decide(World(FOE), junction(Rule.MINOR))
    assert lines == (100.0,)
    assert state.junctions[0].id == "j"
    assert state.foes == (FOE,)
    assert decide(World(), junction(Rule.MINOR))[1] == ()


def test_those_on_the_main_road_do_not_wait():
    assert decide(World(FOE), junction(Rule.MAJOR))[1] == ()


def test_on_the_main_road_too_the_ego_waits_for_lorries_that_cut_its_corner():
    """SUMO's table knows nothing of these: nobody waits for anybody there."""
    zone = ConflictZone(
        "a_0", "a", "b", (), 103.0, 109.0, 3.0, 9.0, 13.9, 8.0,
        merges=False, goes_first=True, gives_way=False, signal="", signal_link=0,
        shortest=7.0,
    )  # fmt: skip
    there = replace(junction(Rule.MAJOR), zones=(zone,))
    assert decide(World(FOE), there)[1] == (100.0,)
    assert decide(World(), there)[1] == ()


@pytest.mark.parametrize(
    ("letter", "closed"), [("G", 0), ("g", 1), ("s", 1), ("o", 1), ("O", 0), ("r", 0)]
)
def test_a_signal_s_letter_decides(letter, closed):
    """At red the signal's own line holds: nothing is decided here."""
    light = Signal("tl", 100.0, letter)
    lines = decide(World(FOE), junction(Rule.MINOR, signal="tl"), signals=[light])[1]
    assert len(lines) == closed


def test_an_ego_that_waits_inside_still_gives_way_when_its_light_turns_red():
    light = Signal("tl", 100.0, "y")
    at_line = junction(Rule.MINOR, signal="tl")
    foe = FOE._replace(begin_s=110.0, end_s=116.0, to_line=10.0, entry=13.0, held=True)
    assert decide(World(foe), at_line, s=99.0, signals=[light])[1] == ()
    inside = decide(World(foe), at_line, s=104.0, speed=1.0, signals=[light])[1]
    assert len(inside) == 1
    assert 104.0 < inside[0] < 110.0


def test_the_main_road_keeps_a_junction_clear_too():
    queue = ("car", 124.0, 0.0, 0.0, 0.0, 0.0)
    for rule, closed in ((Rule.MAJOR, (100.0,)), (Rule.ZIPPER, ())):
        assert decide(World(), junction(rule), cars=[queue])[1] == closed


def test_junctions_far_away_and_behind_are_left_alone():
    world = World(FOE)
    far, near, gone = (junction(Rule.MINOR, s) for s in (300.0, 100.0, 20.0))
    state, lines = decide(world, gone, near, far)
    assert world.asked == [{1}]
    assert len(state.junctions) == 1
    assert lines == ()  # the foe is at the junction that is gone
    second = World(FOE._replace(junction=1))
    state, lines = decide(second, gone, near, far)
    assert lines == (100.0,)
    assert state.foes[0].junction == 0  # its place among those of the state


@pytest.mark.parametrize(("s", "asked"), [(20.0, False), (150.0, True), (300.0, False)])
def test_in_a_bend_without_a_junction_the_ways_of_others_are_read_too(s, asked):
    path = ReferencePath.from_segments([line(200.0), arc(15.0, 0.1), line(185.0)])
    world = World()
    road = Road(path, constant_bounds(path, 5.0))
    rules = RightOfWay(road, TASK, world, 0.1)
    state = TrafficState(0.0, road_users(("car", s + 8.0, 0.0, 0.0, 5.0, 0.0)))
    ego = CartesianState(*path.pose(s), 0.0, 5.0, 0.0)
    state, decided = rules.update(state, s, ego)
    assert decided == []
    assert world.asked == ([set()] if asked else [])
    assert (state.ways is not None) == asked


def test_a_junction_without_room_behind_it_is_kept_clear():
    # the rear of a standing car is 2 m behind the junction's end
    queue = ("car", 124.0, 0.0, 0.0, 0.0, 0.0)
    assert decide(World(), junction(Rule.MINOR), cars=[queue])[1] == (100.0,)
    moving = ("car", 124.0, 0.0, 0.0, 6.0, 0.0)
    assert decide(World(), junction(Rule.MINOR), cars=[moving])[1] == ()
    beside = ("car", 124.0, 3.5, 0.0, 0.0, 0.0)
    assert decide(World(), junction(Rule.MINOR), cars=[beside])[1] == ()
    far = ("car", 135.0, 0.0, 0.0, 0.0, 0.0)
    assert decide(World(), junction(Rule.MINOR), cars=[far])[1] == ()


def test_an_ego_whose_light_turns_red_leaves_before_those_at_their_lines():
    inside = junction(Rule.MINOR, signal="tl")
    starts = FOE._replace(begin_s=110.0, end_s=116.0, to_line=0.5, entry=6.0, speed=1.0)
    for letter, lines in (("r", 0), ("g", 1)):
        light = Signal("tl", 100.0, letter)
        decided = decide(World(starts), inside, s=104.0, speed=1.0, signals=[light])
        assert len(decided[1]) == lines
