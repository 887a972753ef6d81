from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.sumo.lanes import Lane, Strip
from experiments.cosim.sumo.route_place import RoutePlace
from experiments.cosim.sumo.waiting_place import (
    AT_END,
    WaitingPlace,
)

WIDTH = 3.5


def waiting(lane_id):
    """The place of an ego before a junction at x = 40 m, which SUMO has in a lane."""
    road = Lane("in_0", "in", 0, WIDTH, np.array([(0.0, 0.0), (40.0, 0.0)]))
    inside = Lane(":j_0_0", ":j_0", 0, WIDTH, np.array([(40.0, 0.0), (50.0, 5.0)]))
    route = RoutePlace([Strip([road]), Strip([inside])])
    vehicle = SimpleNamespace(getLaneID=lambda _: lane_id)
    place = WaitingPlace(SimpleNamespace(vehicle=vehicle), "ego", route)
    return place, vehicle, route


@given(st.floats(36.0, 42.0), st.floats(-1.5, 1.5))
def test_an_ego_at_its_line_is_put_on_its_lane_half_a_lane_before_the_end(x, y):
    place, vehicle, route = waiting(":j_0_0")
    point = place.update((x, y), before_line=True)
    far = np.hypot(x - 40.0, y)
    if abs(far - AT_END) > 1e-6:
        assert (point is None) == (far > AT_END)
    if point is not None:
        assert point == pytest.approx((min(x, 40.0 - WIDTH / 2.0 - 0.1), 0.0))
        vehicle.getLaneID = lambda _: "in_0"  # SUMO has it there now: it stays
        assert place.update((x, y), before_line=True) == point
        assert place.update((x, y), before_line=False) is None
        assert place.update((x, y), before_line=True) is None
        assert not route.strip.inside_junction


def test_an_ego_that_sumo_has_on_its_lane_or_that_drives_on_stays_where_it_is():
    assert waiting("in_0")[0].update((39.7, 0.2), before_line=True) is None
    assert waiting(":j_0_0")[0].update((39.7, 0.2), before_line=False) is None


def test_the_road_behind_and_the_way_since():
    def strip(name, *points):
        return Strip([Lane(f"{name}_0", name, 0, WIDTH, np.array(points))])

    route = RoutePlace(
        [
            strip("in", (0.0, 0.0), (40.0, 0.0)),
            strip(":j_0", (40.0, 0.0), (50.0, 0.0)),
            strip(":j_1", (50.0, 0.0), (60.0, 0.0)),
            strip("out", (60.0, 0.0), (90.0, 0.0)),
        ]
    )
    assert route.locate((30.0, 0.0))
    assert route.road_behind((30.0, 0.0)) is None
    assert route.locate((53.0, 0.0))
    road, driven = route.road_behind((53.0, 0.0))
    assert (road.lanes[0].edge, driven) == ("in", pytest.approx(13.0))
    assert route.road is road
    assert not route.locate((53.0, 30.0))
    assert route.locate((70.0, 0.0))
    assert route.road_behind((70.0, 0.0)) is None
    assert not route.locate((30.0, 0.0))  # never back
