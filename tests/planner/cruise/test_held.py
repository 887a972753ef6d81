import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import cruise
from planner.bodies import bodies_of, leader_of
from planner.cruise import planner as cruise_planner
from planner.cruise.held import is_held
from planner.cruise.planner import LEAST_DRIVEN
from tests.planner.scenes import Car, bend, ego_on, make_scene, road, straight

FRONT = 3.8  # of the ego, ahead of its rear axle [m]


def scene_at(path, half, line=None, leader=None):
    cars = [] if leader is None else [Car(100.0 + leader[0], leader[1], 0.0)]
    lines = () if line is None else (100.0 + FRONT + line,)
    return make_scene(
        path,
        ego_on(path, 100.0, 0.0, 0.0),
        bounds=road(path, half, -half),
        vehicles=cars,
        stop_lines=lines,
    )


def held(scene):
    return is_held(scene, leader_of(scene, bodies_of(scene, 50)), LEAST_DRIVEN)


@pytest.mark.parametrize(
    ("half", "line", "leader", "expected"),
    [
        (1.65, None, None, False),
        (1.65, 2.0, None, True),
        (1.65, 8.0, None, False),
        (1.65, None, (9.0, 0.0), True),  # a queue in one lane
        (1.65, None, (16.0, 0.0), False),  # farther off
        (5.0, None, (9.0, 0.0), False),  # there is room beside it
    ],
)
def test_who_is_held(half, line, leader, expected):
    assert held(scene_at(straight(300.0), half, line, leader)) is expected


@settings(max_examples=30, deadline=None)
@given(
    radius=st.sampled_from([np.inf, 30.0, -30.0]),
    half=st.floats(1.2, 6.0),
    line=st.none() | st.floats(0.2, 12.0),
    leader=st.none() | st.tuples(st.floats(7.0, 14.0), st.floats(-1.5, 1.5)),
)
def test_a_search_that_is_left_out_would_have_found_nothing(radius, half, line, leader):
    path = straight(300.0) if np.isinf(radius) else bend(radius)
    scene = scene_at(path, half, line, leader)
    plan = cruise.proposed().plan
    short = plan(scene, None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cruise_planner, "is_held", lambda *_: False)
        whole = plan(scene, None)
    assert short.status is whole.status
    if whole.trajectory is not None:
        np.testing.assert_array_equal(short.trajectory.s, whole.trajectory.s)
        np.testing.assert_array_equal(short.trajectory.l, whole.trajectory.l)
