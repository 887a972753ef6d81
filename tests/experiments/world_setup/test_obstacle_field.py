"""Fields of obstacles: passable or closed, as brute force sees it; what is refused.

`make test-slow ARGS="tests/experiments/world_setup/test_obstacle_field.py --seeds 100"`
checks 100 of each.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from experiments.config import ObstacleField
from experiments.config.scenario_file import load_scenario
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from experiments.world_setup.obstacle_field_advice import with_advice
from experiments.world_setup.obstacle_field_course import (
    FieldError,
    clearance,
    draw_course,
    stays_on_road,
)
from tests.experiments.way_through import connected, drivable, hits, off_road

ROADS = ("dense", "dense_curved")
START, FIRST, LAST, GOAL = 100.0, 140.0, 440.0, 470.0
CLOSED = "obstacles.field.passable=false"


def drawn(road, seed, *overrides):
    scenario = load_scenario(road, seed=seed, overrides=overrides)
    layout = make_layout(scenario)
    s, l = layout.road.path.project(layout.road.obstacles.x, layout.road.obstacles.y)
    return layout, layout.task.vehicle, s, l


def check_passable(road, seed):
    layout, vehicle, _, _ = drawn(road, seed)
    assert drivable(layout, vehicle, START, GOAL) >= GOAL
    assert connected(layout, vehicle, START, GOAL)


def check_closed(road, seed):
    layout, vehicle, s, _ = drawn(road, seed, CLOSED)
    assert not connected(layout, vehicle, START, GOAL)
    # Where the road is closed, and that up to there it is open.
    radius = layout.road.obstacles.radius
    rows = [at for at in s if np.sum(np.abs(s - at) < 1e-6) >= 2]
    assert min(rows) >= FIRST + (LAST - FIRST) / 3.0 - 1e-3
    assert max(rows) <= min(LAST, *rows) + 1e-3
    row = np.abs(s - rows[0]) < 1e-6
    reached = drivable(layout, vehicle, START, GOAL)
    before = rows[0] - radius[row].max() - vehicle.front_reach
    assert before - 15.0 < reached < rows[0]


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("seed", [3])
def test_passable_fields_have_a_way_through(road, seed):
    check_passable(road, seed)


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("seed", [3])
def test_closed_fields_have_none(road, seed):
    check_closed(road, seed)


@pytest.mark.parametrize(
    "road", [ROADS[0], *(pytest.param(r, marks=pytest.mark.slow) for r in ROADS[1:])]
)
def test_many_passable_fields(road, request):
    for seed in range(request.config.getoption("--seeds")):
        check_passable(road, seed)


@pytest.mark.slow
@pytest.mark.parametrize("road", ROADS)
def test_many_closed_fields(road, request):
    for seed in range(request.config.getoption("--seeds")):
        check_closed(road, seed)


def test_brute_force_tells_open_from_closed():
    """Two discs leave a gap that grows: it opens when the body fits, not before."""
    for gap, fits in ((1.6, False), (2.3, True)):
        centre = 0.5 * gap + 2.5
        row = [f"{{s_m: 200, l_m: {l}, radius_m: 2.5}}" for l in (centre, -centre)]
        layout, vehicle, _, _ = drawn("dense", 0, f"obstacles=[{', '.join(row)}]")
        assert connected(layout, vehicle, START, 250.0) == fits
        assert (drivable(layout, vehicle, START, 250.0) >= 250.0) == fits


@pytest.mark.parametrize("road", ROADS)
def test_fields_are_what_the_scenario_says(road):
    counts, blocking = set(), []
    for seed in range(30):
        layout, _, s, l = drawn(road, seed)
        other = layout.road.obstacles
        counts.add(s.size)
        assert set(other.radius) <= {2.5, 1.58, 2.7, 0.71}
        assert s.min() >= FIRST - 1e-3
        assert s.max() <= LAST + 1e-3
        assert np.abs(l).max() <= 5.001
        apart = np.hypot(other.x[:, None] - other.x, other.y[:, None] - other.y)
        apart -= other.radius[:, None] + other.radius
        assert apart[~np.eye(s.size, dtype=bool)].min() >= 1.0 - 1e-9
        blocking.append(int(np.sum(np.abs(l) < other.radius + 0.95)))
    assert min(counts) == 10
    assert max(counts) >= 23
    assert min(blocking) >= 3  # obstacles that who keeps straight on would hit


def test_the_course_is_clear_of_the_road_and_gentle():
    """The promise behind passable fields, by the tests' own geometry."""
    for road in ROADS:
        layout, vehicle, _, _ = drawn(road, 0, "obstacles=none")
        for seed in range(10):
            course = draw_course(layout, GOAL, 0.5, np.random.default_rng(seed))
            pose = (course.x, course.y, course.heading)
            assert not off_road(layout, vehicle, *pose, course.s).any()
            assert stays_on_road(layout, course, 0.5)
            arc = np.hypot(np.diff(course.x), np.diff(course.y))
            motion = np.arctan2(np.diff(course.y), np.diff(course.x))
            middle = 0.5 * (course.heading[1:] + course.heading[:-1])
            np.testing.assert_allclose(np.sin(motion - middle), 0.0, atol=2e-3)
            assert np.max(np.abs(np.diff(course.heading)) / arc) <= 0.1
            assert course.l.max() - course.l.min() > 3.0


def test_clearance_agrees_with_the_brute_force():
    layout, vehicle, _, _ = drawn("dense_curved", 5)
    course = draw_course(layout, GOAL, 0.5, np.random.default_rng(1))
    other = layout.road.obstacles
    for k in range(len(other.ids)):
        gap = clearance(course, vehicle, other.x[k], other.y[k]) - other.radius[k]
        near = np.abs(gap) < 10.0
        names = ("x", "y", "heading", "length", "width", "radius")
        one = {name: getattr(other, name)[[k]] for name in names}
        alone = replace(
            layout,
            road=replace(layout.road, obstacles=replace(other, ids=("one",), **one)),
        )
        pose = (course.x[near], course.y[near], course.heading[near])
        touched = hits(alone, vehicle, *pose)
        np.testing.assert_array_equal(touched, gap[near] <= 0.0)


@pytest.mark.parametrize("road", ROADS)
def test_same_seed_same_field(road):
    for overrides in ((), (CLOSED,)):
        one, again = (drawn(road, 4, *overrides)[0].road.obstacles for _ in range(2))
        assert one.x.tobytes() == again.x.tobytes()
        assert one.y.tobytes() == again.y.tobytes()
        assert one.radius.tobytes() == again.radius.tobytes()
        other = drawn(road, 5, *overrides)[0].road.obstacles
        assert other.x.tobytes() != one.x.tobytes()


def test_the_field_is_apart_from_planner_and_traffic():
    scenario = load_scenario("dense", seed=2)
    traffic = ("traffic={own_veh_per_h: 300}", "planner=cruise")
    busy = load_scenario("dense", seed=2, overrides=traffic)
    one, other = make_layout(scenario).road.obstacles, make_layout(busy).road.obstacles
    assert one.x.tobytes() == other.x.tobytes()


def test_a_start_beside_the_middle_begins_the_course_there():
    layout, vehicle, _, _ = drawn("dense", 1, "ego.start_offset_m=-3.5")
    assert drivable(layout, vehicle, START, GOAL, -3.5) >= GOAL


def test_many_small_obstacles_fit():
    settings = "{count: 200, first_m: 140, last_m: 440, radii_m: [0.5], gap_m: 0.2}"
    _, _, s, _ = drawn("dense", 0, f"obstacles.field={settings}")
    assert s.size == 200


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("count=0", "count: is 0; allowed: a whole number >= 1"),
        ("count=[20, 10]", "count: is [20, 10]; allowed: [least, most], rising"),
        ("last_m=100", "last_m: is 100; allowed: more than first_m = 140"),
        ("last_m=700", "last_m: is 700; allowed: 0 to 600.0, the road's end"),
        ("last_m=598", "last_m: is 598; allowed: at most 59"),
        ("first_m=101", "first_m: is 101; allowed: more than 103.8, the ego's"),
        ("radii_m=[]", "radii_m: is a list of 0; allowed: a list, at least 1"),
        ("course_margin_m=4.5", "course_margin_m: is 4.5; the road is 10.00 m wide"),
        ("passable=maybe", "passable: is the text 'maybe'; allowed: true or false"),
        ("gapp_m=1", "gapp_m: unknown key; did you mean gap_m?"),
    ],
)
def test_mistakes_are_one_line(override, message):
    with pytest.raises(ConfigError) as caught:
        drawn("dense", 0, f"obstacles.field.{override}")
    assert f"obstacles.field.{message}" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            (CLOSED, "obstacles.field.count=1"),
            "obstacles.field.count: is 1; allowed: at least 2, to close the road",
        ),
        (
            ("obstacles.field.count=40", "obstacles.field.gap_m=5"),
            "obstacles.field.count: is 40; 300 m have not the room with course_margin",
        ),
        (
            ("obstacles={random: {first_m: 9}, field: {first_m: 9, last_m: 99}}",),
            "obstacles.field: is beside random; allowed: one of them",
        ),
        (
            ("ego.vehicle.limits.max_curvature_1pm=0.05",),
            "obstacles.field.passable: the road bends with 0.025",
        ),
    ],
)
def test_what_cannot_be_is_one_line(overrides, message):
    with pytest.raises(ConfigError) as caught:
        drawn("dense_curved", 0, *overrides)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


LONG = tuple(
    f"ego.vehicle.{key}"
    for key in ("length_m=12", "width_m=2.5", "wheelbase_m=6", "rear_overhang_m=3")
)


def refused(road, seed, overrides):
    """Give the message if there is no such field, nothing if there is."""
    try:
        drawn(road, seed, *overrides)
    except ConfigError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "road", [ROADS[0], *(pytest.param(r, marks=pytest.mark.slow) for r in ROADS[1:])]
)
@pytest.mark.parametrize(
    ("key", "overrides"),
    [
        ("count", ("count=60", "gap_m=4")),
        pytest.param("count", ("count=[50, 60]", "last_m=200"), marks=pytest.mark.slow),
        ("count", ("gap_m=50",)),
        ("radii_m", ("radii_m=[50]",)),
        ("course_margin_m", ("course_margin_m=3.99", "radii_m=[0.2]")),
        ("course_margin_m", ("course_margin_m=4.8",)),
    ],
)
def test_what_is_advised_works(road, key, overrides):
    asked = [f"obstacles.field.{one}" for one in overrides]
    errors = {seed: error for seed in range(3) if (error := refused(road, seed, asked))}
    assert errors
    for seed, error in errors.items():
        # of what follows the key, or of the other key that it names
        advice = re.search(
            r"obstacles\.field\.(\w+): is .*; allowed: for example "
            r"(?:(\w+) = )?([^(]+)$",
            error,
        )
        assert advice, error
        advised = advice[2] or advice[1]
        assert advised == key
        assert not refused(
            road, seed, [*asked, f"obstacles.field.{advised}={advice[3]}"]
        )


def test_where_less_would_not_do_either_it_is_said():
    tried = []

    def draw(other):
        tried.append((other.radii_m, other.course_margin_m))
        raise FieldError("course_margin_m", "is too much", 0.3)

    section = ObstacleField(first_m=60.0, last_m=90.0)
    error = with_advice(FieldError("radii_m", "is x", 0.71), section, draw)
    assert error.problem == "is x; nor would less do"
    assert tried[0] == ((0.71,), 0.5)
    assert tried[-1] == (section.radii_m, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("road", ROADS)
def test_a_truck_gets_its_field_too(road):
    """Its corners swing out: courses that use the whole width leave the road."""
    for seed in range(6):
        layout, vehicle, _, _ = drawn(road, seed, *LONG)
        assert len(layout.road.obstacles.ids) >= 10
        assert vehicle.length == 12.0
    assert drivable(layout, vehicle, START, GOAL) >= GOAL
