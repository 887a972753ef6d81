import math

import numpy as np
import pytest

from experiments.cosim.perception.perceive import Perception, reckoned
from experiments.cosim.perception.settings import PerceptionSettings
from experiments.cosim.records import TrafficState
from planner.scene import Obstacles
from planner.states import CartesianState
from tests.experiments.road_users import road_users

STEP = 0.1
EGO = CartesianState(0.0, 0.0, 0.0, 0.0, 10.0, 0.0)
CLEAR = PerceptionSettings(100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, margin=0.0)


def changed(**changes) -> PerceptionSettings:
    values = {name: getattr(CLEAR, name) for name in PerceptionSettings.__slots__}
    return PerceptionSettings(**(values | changes))


def eyes(settings=CLEAR, static=None, seed=1) -> Perception:
    return Perception(settings, static or Obstacles.none(), STEP, seed, 0.0)


def traffic(k, *cars, length=4.0, width=2.0):
    """Cars are (id, x, y, heading, speed)."""
    rows = [(*car, 0.0) for car in cars]
    return TrafficState(STEP * k, road_users(*rows, length=length, width=width))


def seen(perception, *cars, k=0):
    return perception.perceive(traffic(k, *cars), EGO).ids


def test_without_faults_all_is_seen_as_it_is():
    cars = [("a", 20.0, 5.0, 0.3, 8.0), ("b", -30.0, 0.0, 0.0, 5.0)]
    state = traffic(0, *cars)
    found = eyes().perceive(state, EGO)
    assert found.ids == ("a", "b")
    assert np.array_equal(found.table, state.vehicles.table)


def test_range_and_field_of_view():
    near, far = ("near", 99.0, 0.0, 0.0, 0.0), ("far", 0.0, 101.0, 0.0, 0.0)
    assert seen(eyes(), near, far) == ("near",)
    forward = changed(field_of_view=math.radians(60.0))
    beside, ahead = ("beside", 10.0, 10.0, 0.0, 0.0), ("ahead", 20.0, 10.0, 0.0, 0.0)
    assert seen(eyes(forward), beside, ahead) == ("ahead",)


def test_a_lorry_hides_a_car_and_not_a_wide_one():
    lorry, behind = ("lorry", 20.0, 0.0, 0.0, 0.0), ("x", 40.0, 0.0, 0.0, 0.0)
    beside = ("y", 40.0, 5.0, 0.0, 0.0)
    assert seen(eyes(), lorry, behind, beside) == ("lorry", "y")
    assert "x" in seen(eyes(changed(occlusion=False)), lorry, behind)
    assert "x" in seen(eyes(), lorry, ("x", 40.0, 1.9, 0.0, 0.0))  # a corner is seen


def test_obstacles_and_buildings_hide():
    one = np.array([10.0])
    zero = np.zeros(1)
    block = Obstacles(("o",), one, zero, zero, np.ones(1), zero + 3.0, zero)
    car = ("x", 30.0, 0.0, 0.0, 0.0)
    assert seen(eyes(static=block), car) == ()
    house = np.array([[10.0, -5.0], [15.0, -5.0], [15.0, 5.0], [10.0, 5.0]])
    assert seen(eyes(changed(buildings=(house,))), car) == ()
    assert seen(eyes(changed(buildings=(house + np.array([0.0, 20.0]),))), car) == (
        "x",
    )


def test_what_is_seen_late_is_reckoned_on():
    perception = eyes(changed(latency=0.3))
    for k in range(12):
        ego = CartesianState(1.0 * k, 0.0, 0.0, 0.0, 10.0, 0.0)
        state = traffic(k, ("a", 20.0 + 0.8 * k, 3.0, 0.0, 8.0))
        found = perception.perceive(state, ego)
        assert found.x == pytest.approx(state.vehicles.x)
    # it turns off: known only after the latency
    turned = traffic(12, ("a", 29.6, 3.0, 1.0, 8.0))
    assert perception.perceive(turned, EGO).heading == pytest.approx([0.0])


def test_the_unseen_are_forgotten_after_a_while():
    perception = eyes(changed(forget_after=0.5))
    assert seen(perception, ("a", 20.0, 0.0, 0.0, 1.0)) == ("a",)
    for k in range(1, 6):
        assert seen(perception, ("a", 200.0, 0.0, 0.0, 1.0), k=k) == ("a",)
    assert seen(perception, ("a", 200.0, 0.0, 0.0, 1.0), k=6) == ()


def noisy_run(seed, *others, n=4000):
    settings = changed(position=0.2, heading=0.02, speed=0.4, size=0.1, missed=0.1)
    perception = eyes(settings, seed=seed)
    errors = []
    for k in range(n):
        car = ("a", 20.0, 3.0, 0.0, 8.0)
        found = perception.perceive(traffic(k, *others, car), EGO)
        if "a" not in found.ids:  # missed from the first step on
            continue
        at = found.ids.index("a")
        errors.append(
            (found.x[at] - 20.0, found.y[at] - 3.0, found.length[at], found.speed[at])
        )
    return np.array(errors)


def test_noise_has_its_deviation_and_its_correlation():
    errors = np.concatenate([noisy_run(seed)[:, :2] for seed in range(3)])
    y = errors[:, 1]
    assert y.std() == pytest.approx(0.2, rel=0.1)
    assert abs(y.mean()) < 0.03
    lag = np.corrcoef(y[:-10], y[10:])[0, 1]
    assert lag == pytest.approx(math.exp(-1.0), abs=0.1)  # after 1 s
    cross = np.corrcoef(errors[:, 0], y)[0, 1]
    assert abs(cross) < 0.12
    assert np.ptp(noisy_run(0, n=200)[:, 2]) == 0.0  # the size stays


def test_noise_depends_on_seed_and_vehicle_only():
    alone = noisy_run(7, n=300)
    far = ("zzz", -60.0, 0.0, 0.0, 1.0)
    assert np.array_equal(alone, noisy_run(7, n=300))
    assert np.array_equal(alone, noisy_run(7, far, n=300))
    assert not np.array_equal(alone, noisy_run(8, n=300))


def test_a_share_of_detections_is_missed():
    perception = eyes(changed(missed=0.3, forget_after=0.0))
    hits = sum(
        seen(perception, ("a", 20.0, 0.0, 0.0, 0.0), k=k) == ("a",) for k in range(2000)
    )
    assert hits / 2000 == pytest.approx(0.7, abs=0.04)


def test_reckoning_moves_along_the_heading():
    users = traffic(0, ("a", 1.0, 2.0, 0.5, 4.0)).vehicles
    later = reckoned(users, 2.0)
    assert later.x[0] == pytest.approx(1.0 + 8.0 * math.cos(0.5))
    assert later.y[0] == pytest.approx(2.0 + 8.0 * math.sin(0.5))
    assert reckoned(users, 0.0) is users


def test_more_vehicles_than_there_is_room_for():
    cars = [(f"v{n}", 20.0 + n % 7, 5.0 * n - 300, 0.0, 1.0) for n in range(200)]
    far = changed(reach=5000.0, occlusion=False)
    perception = eyes(far)
    assert len(seen(perception, *cars[:100])) == 100
    assert len(seen(perception, *cars, k=1)) == 200
