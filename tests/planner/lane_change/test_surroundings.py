from dataclasses import replace

import numpy as np

from planner.lane_change.lane_choice import bodies_on_road
from planner.lane_change.surroundings import behind_ego, in_lane
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car


def test_behind_is_behind_the_rear_bumper():
    rows = [Car(94.0, -1.75, 8.0), Car(98.0, 1.75, 8.0), Car(120.0, -1.75, 8.0)]
    scene = on_lanes(s=100.0, cars=rows)
    np.testing.assert_array_equal(
        behind_ego(scene, bodies_on_road(scene)), [True, False, False]
    )


def test_a_car_on_its_way_out_is_in_neither_lane():
    rows = [Car(80.0, -1.75, 8.0), Car(70.0, 1.75, 8.0), Car(60.0, -1.0, 8.0)]
    scene = on_lanes(cars=rows)
    ahead = scene.vehicles.prediction
    drifting = ahead.l.copy()
    drifting[2] = np.minimum(-1.0 + 0.15 * np.arange(drifting.shape[1]), 1.0)
    moved = replace(scene.vehicles, prediction=replace(ahead, l=drifting))
    scene = replace(scene, vehicles=moved)
    bodies = bodies_on_road(scene)
    np.testing.assert_array_equal(in_lane(scene, bodies, 0), [True, False, False])
    np.testing.assert_array_equal(in_lane(scene, bodies, 1), [False, True, False])
