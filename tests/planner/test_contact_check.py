import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.bodies import bodies_of
from planner.contact_check import contacts_of
from planner.fallback.braking import stopping_trajectory
from planner.scene import Scene
from planner.shapes.rectangles import Rectangle, distance
from planner.states import Trajectory
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import STEP, Car

NOBODY = np.zeros(1, dtype=np.bool_)


def held(scene: Scene, seconds: float = 5.0) -> Trajectory:
    """The ego at its speed, on a straight road."""
    t = STEP * np.arange(round(seconds / STEP) + 1)
    zero, speed = np.zeros_like(t), np.full_like(t, scene.ego.speed)
    s = scene.ego_frenet.s + scene.ego.speed * t
    l = np.full_like(t, scene.ego_frenet.l)
    return Trajectory(t, s, l, zero, zero, speed, zero, s, l)


def contact(scene: Scene, trajectory: Trajectory, margin: float = 0.0):
    bodies = bodies_of(scene, 101)
    hits = contacts_of(trajectory, scene.vehicle, bodies, NOBODY, margin)
    return hits[0] if hits else None


def test_the_time_and_speed_of_a_rear_end_collision():
    scene = on_lanes(speed=15.0, cars=[Car(150.0, -1.75, 5.0)])
    hit = contact(scene, held(scene))
    gap = 50.0 - 2.4 - scene.vehicle.front_reach
    assert hit is not None
    assert hit.id == scene.vehicles.ids[0]
    assert hit.time == pytest.approx(math.ceil(gap / 10.0 / STEP) * STEP)
    assert hit.closing_speed == pytest.approx(10.0)


def test_there_is_room_beside_a_body_where_the_discs_see_none():
    beside = 1.9 + 0.1  # between the centres, 0.1 m between the sides
    scene = on_lanes(speed=15.0, cars=[Car(120.0, -1.75 + beside, 5.0)])
    discs = scene.vehicle.disc_radius - 0.5 * scene.vehicle.width
    assert discs > 0.1
    assert contact(scene, held(scene), 0.05) is None
    assert contact(scene, held(scene), 0.15) is not None


def test_what_was_left_behind_does_not_count():
    # It is passed in the next lane, then drifts in behind the ego, which brakes.
    scene = on_lanes(speed=15.0, cars=[Car(92.0, -1.75, 9.0)])
    stop = stopping_trajectory(scene, scene.ego_frenet.l, 8.0, 5.0)
    assert stop is not None
    assert contact(scene, stop) is None


@given(
    s=st.floats(85.0, 150.0),
    l=st.floats(-5.0, 2.0),
    speed=st.floats(0.0, 25.0),
    turned=st.floats(-0.4, 0.4),
)
def test_contacts_are_those_of_densely_sampled_rectangles(s, l, speed, turned):
    scene = on_lanes(speed=15.0, cars=[Car(s, l, speed, turned=turned)])
    hit = contact(scene, held(scene))
    vehicle, users = scene.vehicle, scene.vehicles.prediction
    least, time = math.inf, 0.0
    for k in range(501):
        t = 0.01 * k
        x, y = (
            float(np.interp(t, STEP * np.arange(101), row))
            for row in (users.x[0], users.y[0])
        )
        centre = scene.ego.x + vehicle.centre_offset + 15.0 * t
        own = Rectangle(centre, scene.ego.y, 0.0, vehicle.length, vehicle.width)
        heading = float(np.interp(t, STEP * np.arange(101), users.heading[0]))
        other = Rectangle(x, y, heading, 4.8, 1.9)
        behind = x + 2.4 * math.cos(heading) + 0.95 * abs(math.sin(heading))
        if behind < centre - 0.5 * vehicle.length:
            break  # left behind
        apart = distance(own, other)
        if apart < least:
            least, time = apart, t
        if apart == 0.0:
            break
    if least == 0.0:
        assert hit is not None
        assert hit.time - STEP - 1e-9 <= time <= hit.time + 1e-9
    elif least > 0.01:
        assert hit is None
