import math

import numpy as np
import pytest

from experiments.cosim.collision_monitor import CollisionMonitor
from experiments.cosim.fleet.contacts import CheckedEgo, FleetMonitor
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.road import Road
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import RoadUsers
from planner.states import CartesianState
from planner.vehicle import Vehicle, centre_from_rear_axle

PATH = ReferencePath.from_segments([line(300.0)])
ROAD = Road(PATH, constant_bounds(PATH, 8.0))
BODY = Vehicle()
N = 25


def users(rng: np.random.Generator, before: RoadUsers | None) -> RoadUsers:
    """Draw vehicles in a heap, or move them on by up to 2 m."""
    if before is None:
        columns = rng.uniform(0.0, 1.0, (8, N))
        columns[0], columns[1] = 120.0 * columns[0], 16.0 * columns[1] - 8.0
        columns[2] *= 6.0
        columns[6], columns[7] = BODY.length, BODY.width
        ids = tuple(f"car.{k:02}" for k in range(N))
        return RoadUsers.from_table(ids, columns)
    table = before.table.copy()
    table[:2] += rng.uniform(-2.0, 2.0, (2, N))
    table[2] += rng.uniform(-0.2, 0.2, N)
    order = rng.permutation(N)  # the columns of a step are not those of the next
    ids = tuple(before.ids[k] for k in order)
    return RoadUsers.from_table(ids, table[:, order])


def ego_of(everybody: RoadUsers, name: str) -> CartesianState:
    k = everybody.ids.index(name)
    heading = float(everybody.heading[k])
    return CartesianState(
        float(everybody.x[k]) - BODY.centre_offset * math.cos(heading),
        float(everybody.y[k]) - BODY.centre_offset * math.sin(heading),
        heading,
        0.0,
        5.0,
        0.0,
    )


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_the_check_of_a_single_ego(seed):
    rng = np.random.default_rng(seed)
    names = [f"car.{k:02}" for k in (0, 3, 4, 11, 19)]
    many = FleetMonitor()
    single = {name: CollisionMonitor(ROAD, BODY) for name in names}
    everybody, touched = None, 0
    for _ in range(12):
        everybody = users(rng, everybody)
        egos = [
            CheckedEgo(name, ego_of(everybody, name), BODY, ROAD, 60.0)
            for name in names
        ]
        x, _ = centre_from_rear_axle(egos[0].state, BODY)
        assert x == pytest.approx(everybody.x[everybody.ids.index(names[0])])
        for ego, found in zip(egos, many.check(egos, everybody), strict=True):
            others = everybody.among(np.array([i != ego.id for i in everybody.ids]))
            expected = single[ego.id].check(ego.state, others, ego.s)
            assert set(found.contacts) == set(expected.contacts)
            assert found.clearance == expected.clearance
            assert found.off_road == expected.off_road
            if found.clearance > 0.0:
                assert found.nearest == expected.nearest
            touched += len(found.contacts)
    assert touched > 10  # the heap is dense enough to show something


def test_an_ego_does_not_touch_itself_and_nobody_is_far():
    alone = RoadUsers.from_table(
        ("car.00",), np.array([[5.0, 0, 0, 3, 0, 0, 4.8, 1.9]]).T
    )
    ego = CheckedEgo("car.00", ego_of(alone, "car.00"), BODY, ROAD, 5.0)
    (found,) = FleetMonitor().check([ego], alone)
    assert found.contacts == ()
    assert found.nearest is None
    assert found.clearance == math.inf
    assert FleetMonitor().check([], alone) == []
