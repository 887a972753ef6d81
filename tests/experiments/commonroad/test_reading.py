"""Reading the format: everything that it allows, and one line for what it does not."""

import contextlib
import math
import re

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.commonroad.read import read_commonroad
from experiments.commonroad.records import Box
from experiments.commonroad.shapes import box_polygon, covering_boxes
from experiments.commonroad.states import Range
from experiments.commonroad.write import write_commonroad
from experiments.config.scenario_file import load_scenario
from experiments.cosim.goal import GoalWindow
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from planner.states import CartesianState
from tests.experiments.commonroad.examples import EXAMPLES

LANELET = """
<lanelet id="{id}">
 <leftBound>{left}<lineMarking>solid</lineMarking></leftBound>
 <rightBound>{right}</rightBound>{more}
</lanelet>"""


def angle_in(span, heading):
    """Whether a goal with these headings holds for an ego."""
    window = GoalWindow((0.0, 0.0), heading=(span.begin, span.end))
    return window.holds(0.0, 0.0, CartesianState(0, 0, heading, 0, 0, 0), 0.0)


NEIGHBOURS = (
    "<successor ref='77'/><adjacentLeft ref='2' drivingDir='opposite'/>"
    "<adjacentRight ref='99' drivingDir='same'/>"
)


def points(line):
    return "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in line)


def lanelet_text(number, x0=0.0, x1=100.0, y=0.0, more=""):
    left, right = ([(x0, y + d), (x1, y + d)] for d in (1.75, -1.75))
    return LANELET.format(id=number, left=points(left), right=points(right), more=more)


def exact(value):
    return f"<exact>{value}</exact>"


def state_text(tag, x, y=0.0, time=0, speed=5.0, heading=0.0):
    return (
        f"<{tag}><position><point><x>{x}</x><y>{y}</y></point></position>"
        f"<orientation>{exact(heading)}</orientation><time>{exact(time)}</time>"
        f"<velocity>{exact(speed)}</velocity></{tag}>"
    )


GOAL = (
    "<goalState><position><lanelet ref='1'/></position><time><intervalStart>1"
    "</intervalStart><intervalEnd>90</intervalEnd></time></goalState>"
)


def problem_text(start=None, goal=GOAL, number=9):
    begin = start or state_text("initialState", 10.0)
    return f"<planningProblem id='{number}'>{begin}{goal}</planningProblem>"


def file_text(content, version="2020a", step="0.1", root="commonRoad"):
    return (
        f"<?xml version='1.0'?><{root} commonRoadVersion='{version}' "
        f"timeStepSize='{step}' benchmarkID='ZAM_Test-1_1_T-1'>{content}</{root}>"
    )


@pytest.fixture
def read(tmp_path):
    def reading(content, **header):
        file = tmp_path / "test.xml"
        file.write_text(file_text(content, **header), encoding="utf-8")
        return read_commonroad(file)

    return reading


@pytest.mark.parametrize("make", EXAMPLES, ids=lambda make: make.__name__)
def test_what_is_written_reads_back(make, tmp_path):
    made = make()
    file = tmp_path / "made.xml"
    write_commonroad(made, file)
    found = read_commonroad(file)
    assert found.step == made.step
    assert set(found.network.lanelets) == set(made.network.lanelets)
    for name, lanelet in made.network.lanelets.items():
        other = found.network.lanelets[name]
        np.testing.assert_allclose(other.left, lanelet.left, atol=2e-6)
        np.testing.assert_allclose(other.right, lanelet.right, atol=2e-6)
        assert other.beside_left == lanelet.beside_left
    assert found.network.turns == made.network.turns
    assert found.network.lights == made.network.lights
    assert [user.id for user in found.moving] == [user.id for user in made.moving]
    for one, other in zip(made.moving, found.moving, strict=True):
        assert one.first == other.first
        np.testing.assert_allclose(other.table[:2], one.table[:2], atol=2e-6)
        np.testing.assert_allclose(other.table[3:], one.table[3:], atol=2e-6)
        turned = np.angle(np.exp(1j * (other.table[2] - one.table[2])))
        np.testing.assert_allclose(turned, 0.0, atol=2e-6)
    for one, other in zip(made.problems, found.problems, strict=True):
        assert one.start.x == pytest.approx(other.start.x)
        for mine, theirs in zip(one.goals, other.goals, strict=True):
            assert mine.steps == theirs.steps
            if mine.area is not None:
                apart = mine.area.symmetric_difference(theirs.area).area
                assert apart < 1e-3


@given(
    box=st.builds(
        Box,
        st.floats(-50, 50),
        st.floats(-50, 50),
        st.floats(-3, 3),
        st.floats(0.5, 20),
        st.floats(0.5, 20),
    ),
    notch=st.floats(0.1, 0.9),
)
@settings(max_examples=40, deadline=None)
def test_rectangles_cover_an_area_and_little_more(box, notch):
    whole = box_polygon(box)
    corner = box_polygon(
        Box(
            box.x + notch * box.length / 2 * math.cos(box.heading),
            box.y + notch * box.length / 2 * math.sin(box.heading),
            box.heading,
            notch * box.length,
            notch * box.width,
        )
    )
    area = whole.difference(corner)
    cover = shapely.union_all([box_polygon(part) for part in covering_boxes(area)])
    assert area.difference(cover.buffer(1e-6)).area < 1e-6
    assert whole.buffer(1e-6).covers(cover) or cover.area < 1.5 * area.area + 1.0


@given(
    begin=st.floats(-7, 7),
    width=st.floats(0.0, 6.0),
    share=st.floats(0.01, 0.99),
    turns=st.integers(-3, 3),
)
def test_an_angle_is_in_an_interval_whole_turns_aside(begin, width, share, turns):
    span = Range(begin, begin + width)
    if width > 1e-3:
        assert angle_in(span, begin + share * width + turns * 2.0 * math.pi)
        outside = begin + width + share * (2.0 * math.pi - width)
        assert not angle_in(span, outside + turns * 2.0 * math.pi) or share > 0.98


def test_all_kinds_of_obstacles_positions_and_goals(read):
    rectangle = "<rectangle><length>4</length><width>2</width></rectangle>"
    circle = "<circle><radius>0.5</radius></circle>"
    triangle = f"<polygon>{points([(0, 0), (2, 0), (0, 2)])}</polygon>"
    uncertain = state_text("initialState", 0).replace(
        "<point><x>0</x><y>0.0</y></point>",
        "<rectangle><length>2</length><width>1</width>"
        "<center><x>30</x><y>1</y></center></rectangle>",
    )
    area = (
        "<rectangle><length>4</length><width>2</width><orientation>0.1</orientation>"
        "<center><x>{x}</x><y>3</y></center></rectangle>"
    )
    occupied = "".join(
        f"<occupancy><shape>{area.format(x=20 + k)}</shape><time>{exact(k)}</time>"
        "</occupancy>"
        for k in range(4)
    )
    goals = (
        GOAL,
        f"<goalState><position>{circle}{triangle}</position>"
        "<orientation><intervalStart>3</intervalStart><intervalEnd>-3</intervalEnd>"
        f"</orientation><time>{exact(40)}</time></goalState>",
        f"<goalState><time>{exact(50)}</time><velocity><intervalStart>1"
        "</intervalStart><intervalEnd>3</intervalEnd></velocity></goalState>",
    )
    found = read(
        lanelet_text(1, more=NEIGHBOURS)
        + lanelet_text(2, y=3.5)
        + lanelet_text(3, 100.0, 150.0)
        + "<trafficSign id='50'><trafficSignElement><trafficSignID>274</trafficSignID>"
        "<additionalValue>8.5</additionalValue></trafficSignElement></trafficSign>"
        "<staticObstacle id='20'><type>unknown</type>"
        f"<shape>{rectangle}{circle}</shape>"
        f"{state_text('initialState', 50)}</staticObstacle>"
        f"<staticObstacle id='21'><type>unknown</type><shape>{triangle}</shape>"
        f"{uncertain}</staticObstacle>"
        f"<environmentObstacle id='22'><type>building</type><shape>{triangle}</shape>"
        "</environmentObstacle>"
        f"<dynamicObstacle id='30'><type>car</type><shape>{rectangle}</shape>"
        f"{state_text('initialState', 10, time=3)}<trajectory>"
        f"{state_text('state', 12, time=5)}{state_text('state', 11, time=4)}"
        "</trajectory></dynamicObstacle>"
        f"<dynamicObstacle id='31'><type>bicycle</type><shape>{circle}</shape>"
        f"{state_text('initialState', 20)}<occupancySet>{occupied}</occupancySet>"
        "</dynamicObstacle>"
        f"<phantomObstacle id='32'><occupancySet>{occupied}</occupancySet>"
        "</phantomObstacle>"
        + problem_text(goal="".join(goals)) + problem_text(number=10)
    )  # fmt: skip
    first = found.network.lanelets[1]
    assert first.successors == (3,)  # found where it begins; 77 is not in the file
    assert 77 in found.network.missing
    assert not set(found.network.missing) & set(found.network.lanelets)
    assert first.same_left is None
    assert first.beside_left == (2, False)
    assert first.beside_right is None
    assert found.network.speed_limits == {50: 8.5}
    assert {name for name, _ in found.static} == {"20", "21", "22"}
    disc = next(box for name, box in found.static if name == "20" and box.length == 0)
    assert (disc.x, disc.radius) == (50.0, 0.5)
    assert next(box for name, box in found.static if name == "21").radius == 1.0
    users = {user.id: user for user in found.moving}
    assert users["30"].first == 3
    np.testing.assert_allclose(users["30"].table[0], [10.0, 11.0, 12.0])
    np.testing.assert_allclose(users["32"].table[3], 10.0)  # a metre a step
    assert users["32"].table[6, 0] == pytest.approx(4.1, abs=0.3)
    states = found.problems[0].goals
    assert states[0].lanelets == (1,)
    assert angle_in(states[1].heading, math.pi)
    assert not angle_in(states[1].heading, 0.0)
    assert states[2].area is None
    assert states[2].speed == Range(1.0, 3.0)
    assert [problem.id for problem in found.problems] == [9, 10]


def test_the_older_format_is_the_same_scenario(read):
    """2018b: one kind of obstacle with a role, and limits of the lanelets' own."""
    shape = "<shape><rectangle><length>4</length><width>2</width></rectangle></shape>"
    places = {"static": 50, "dynamic": 20}

    def content(before, after):
        return lanelet_text(1, more="<speedLimit>9</speedLimit>") + "".join(
            before.format(role=role, id=number)
            + f"<type>car</type>{shape}{state_text('initialState', x)}"
            + after.format(role=role)
            for number, (role, x) in enumerate(places.items(), 20)
        ) + problem_text()  # fmt: skip

    old = content("<obstacle id='{id}'><role>{role}</role>", "</obstacle>")
    new = content("<{role}Obstacle id='{id}'>", "</{role}Obstacle>")
    found, same = read(old, version="2018b"), read(new)
    assert (found.version, same.version) == ("2018b", "2020a")
    assert found.static == same.static
    assert [user.id for user in found.moving] == ["21"]
    np.testing.assert_array_equal(found.moving[0].table, same.moving[0].table)
    assert found.network.speed_limits == same.network.speed_limits == {-1: 9.0}
    read(old, version="2018b")
    make_layout(load_scenario(str(found.file)))


def test_lanelets_that_share_a_bound_are_neighbours_though_it_is_not_written(read):
    """Three lanes, a short junction of three lanelets without neighbours, three lanes.

    The middle lane goes on; a turn that leaves it shares a begin with its neighbour.
    """

    def lane(number, x0, x1, y, beside=()):
        more = "".join(
            f"<adjacent{side} ref='{x}' drivingDir='same'/>" for side, x in beside
        )
        return lanelet_text(number, x0, x1, y, more)

    text = "".join(
        lane(
            10 * row + k,
            x0,
            x1,
            3.5 * k,
            [
                (side, 10 * row + k + d)
                for side, d in (("Left", 1), ("Right", -1))
                if written and 1 <= k + d <= 3
            ],
        )
        for row, x0, x1, written in (
            (1, 0.0, 50.0, True),
            (2, 50.0, 50.3, False),
            (3, 50.3, 100.0, True),
        )
        for k in (1, 2, 3)
    )
    turn = LANELET.format(
        id=99,
        left=points([(50.0, 8.75), (52.0, 9.5), (55.0, 14.0)]),
        right=points([(50.0, 5.25), (53.0, 6.0), (58.5, 14.0)]),
        more="",
    )
    start = state_text("initialState", 10.0, 7.0)
    goal = GOAL.replace("'1'", "'32'")
    found = read(text + turn + problem_text(start, goal))
    inside = found.network.lanelets
    assert [inside[k].same_left for k in (21, 22, 23)] == [22, 23, None]
    assert [inside[k].same_right for k in (21, 22, 23)] == [None, 21, 22]
    assert inside[99].same_left is inside[99].same_right is None
    bounds = make_layout(load_scenario(str(found.file))).road.bounds
    assert np.ptp(bounds.left) < 0.01
    assert np.ptp(bounds.right) < 0.01


OTHERS = {
    "bicycle lane": "<laneletType>urban</laneletType>"
    "<laneletType>bicycleLane</laneletType>",
    "bus lane": "<laneletType>busLane</laneletType><userOneWay>bus</userOneWay>",
    "pavement": "<laneletType>sidewalk</laneletType>",
    "shoulder": "<laneletType>shoulder</laneletType>",
    "of bicycles": "<userOneWay>bicycle</userOneWay>",
}


@pytest.mark.parametrize("kind", OTHERS.values(), ids=list(OTHERS))
def test_ways_of_others_are_not_driven_on_unless_they_are_the_goal(read, kind):
    """Lanes 1 and 3 of cars, 2 between them: the goal on 3 is out of reach by it."""

    def beside(right, left):
        return "".join(
            f"<adjacent{side} ref='{x}' drivingDir='same'/>"
            for side, x in (("Left", left), ("Right", right))
            if x
        )

    lanelets = (
        lanelet_text(1, more=beside(0, 2))
        + lanelet_text(2, y=3.5, more=beside(1, 3) + kind)
        + lanelet_text(3, y=7.0, more=beside(2, 0))
    )
    problem = read(lanelets + problem_text(goal=GOAL.replace("'1'", "'3'")))
    with pytest.raises(ConfigError, match="no route reaches its goal on lanelets 3"):
        make_layout(load_scenario(str(problem.file)))
    own = make_layout(load_scenario(str(read(lanelets + problem_text()).file)))
    assert len(own.road.lanes.at(10.0)[0]) == 1
    goal = read(lanelets + problem_text(goal=GOAL.replace("'1'", "'2'")))
    layout = make_layout(load_scenario(str(goal.file)))
    assert len(layout.road.lanes.at(10.0)[0]) > 1
    vans = kind + "<userOneWay>vehicle</userOneWay>"
    if "laneletType" not in kind:  # several users
        open_to_all = lanelets.replace(kind, vans)
        found = read(open_to_all + problem_text(goal=GOAL.replace("'1'", "'3'")))
        make_layout(load_scenario(str(found.file)))


BAD = {
    "another version": (
        {"version": "2017a"},
        "",
        "commonRoadVersion is '2017a'; allowed: 2020a, 2018b",
    ),
    "an unknown role": (
        {"version": "2018b"},
        lanelet_text(1)
        + "<obstacle id='7'><role>haunted</role></obstacle>"
        + problem_text(),
        "role: is 'haunted'; allowed: static, dynamic",
    ),
    "another root": ({"root": "osm"}, "", "is not a CommonRoad scenario; allowed: c"),
    "a demand": ({"root": "routes"}, "", "it is a demand of SUMO; give it to a netw"),
    "no time step": ({"step": "soon"}, "", "timeStepSize is 'soon'"),
    "no lanelet": ({}, problem_text(), "has no lanelet"),
    "no problem": ({}, lanelet_text(1), "has no planningProblem"),
    "no goal": ({}, lanelet_text(1) + problem_text(goal=""), "has no goalState"),
    "not a number": (
        {},
        lanelet_text(1) + problem_text(state_text("initialState", "here")),
        "x: is 'here'; allowed: a number",
    ),
    "not finite": (
        {},
        lanelet_text(1) + problem_text(state_text("initialState", "nan")),
        "allowed: a number",
    ),
    "a lanelet twice": ({}, lanelet_text(1) * 2 + problem_text(), "is there twice"),
    "a bound of one point": (
        {},
        LANELET.format(id=1, left=points([(0, 0)]), right="", more="") + problem_text(),
        "has 1 points; allowed: at least 2",
    ),
    "a goal that is over": (
        {},
        lanelet_text(1) + problem_text(state_text("initialState", 1.0, time=95)),
        "its goal ends in step 90; allowed: after step 95",
    ),
    "a goal nowhere": (
        {},
        lanelet_text(2) + problem_text(),
        "refers to lanelet 1, which is not in the file; allowed: 2",
    ),
    "a start that is too fast": (
        {},
        lanelet_text(1) + problem_text(state_text("initialState", 1.0, speed=2200)),
        "initialState: velocity is 2200; allowed: 0 to 70 m/s",
    ),
    "an obstacle without a shape": (
        {},
        lanelet_text(1)
        + f"<staticObstacle id='7'>{state_text('initialState', 1)}</staticObstacle>"
        + problem_text(),
        "staticObstacle '7': has no shape",
    ),
}


@pytest.mark.parametrize("case", BAD.values(), ids=list(BAD))
def test_bad_files_get_one_line_with_place(read, case):
    header, content, words = case
    with pytest.raises(ConfigError, match=re.escape(words)) as caught:
        read(content, **header)
    assert re.match(r"\S+test\.xml:\d+: ", str(caught.value))
    assert "\n" not in str(caught.value)


def test_hostile_files_are_refused_at_once(tmp_path):
    file = tmp_path / "hostile.xml"
    entities = "".join(
        f"<!ENTITY a{k} '{f'&a{k - 1};' * 10 if k else 'lol'}'>" for k in range(12)
    )
    texts = {
        f"<!DOCTYPE x [{entities}]><commonRoad>&a11;</commonRoad>": "document type",
        "<!DOCTYPE x SYSTEM 'file:///etc/passwd'><commonRoad/>": "document type",
        "<commonRoad>" + "<a>" * 100_000: "at most",
        "<commonRoad><lanelet": "is no XML",
        "": "is no XML",
        "\x00\x01": "is no XML",
    }
    for text, words in texts.items():
        file.write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError, match=words):
            read_commonroad(file)
    file.write_bytes(b"<?xml version='1.0' encoding='no-such'?><a/>")
    with pytest.raises(ConfigError, match="is no XML"):
        read_commonroad(file)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_commonroad(tmp_path / "missing.xml")


def test_neighbours_of_one_side_only_and_negative_ids_are_driven(read):
    far = lanelet_text(-5, y=3.5, more="<adjacentRight ref='3' drivingDir='same'/>")
    own = lanelet_text(1, more="<adjacentLeft ref='-5' drivingDir='same'/>")
    found = read(own + far + problem_text())
    make_layout(load_scenario(str(found.file)))
    only = lanelet_text(-5) + problem_text(goal=GOAL.replace("'1'", "'-5'"))
    make_layout(load_scenario(str(read(only).file)))


def test_bounds_that_cross_are_refused(read):
    left, right = [(0, 0), (100, 4)], [(100, 0), (0, -4)]
    text = LANELET.format(id=1, left=points(left), right=points(right), more="")
    with pytest.raises(ConfigError, match="has no length: its bounds cross"):
        read(text + problem_text())


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_a_damaged_file_is_read_or_refused_in_one_line(data):
    """Cut out, double or change a piece of a good file: no other error comes."""
    import tempfile
    from pathlib import Path

    text = file_text(
        lanelet_text(1)
        + f"<dynamicObstacle id='30'><type>car</type><shape><rectangle><length>4"
        "</length><width>2</width></rectangle></shape>"
        f"{state_text('initialState', 30)}<trajectory>{state_text('state', 31, time=1)}"
        "</trajectory></dynamicObstacle>" + problem_text()
    )
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(begin + 60, len(text))))
    piece = data.draw(
        st.sampled_from(["", "-1", "1e9", "<x/>", "7", text[begin:end] * 2])
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "damaged.xml"
        file.write_text(text[:begin] + piece + text[end:], encoding="utf-8")
        with contextlib.suppress(ConfigError):
            read_commonroad(file)
            make_layout(load_scenario(str(file)))
