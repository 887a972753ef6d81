from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.road import Road
from experiments.cosim.waiting_lines import LINE_VIEW, OVER_LINE, is_before_line
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from sumo_nets.route_path import StopLine

PATH = ReferencePath.from_segments([line(100.0)])
BOUNDS = constant_bounds(PATH, 6.0)


@given(st.lists(st.floats(5.0, 95.0), max_size=3), st.floats(1.0, 99.0), st.booleans())
def test_who_stands_a_little_over_a_line_waits_and_who_drives_over_it_does_not(
    places, front, stands
):
    lines = tuple(StopLine("light", 0, place) for place in places)
    road = Road(PATH, BOUNDS, stop_lines=lines)
    over = OVER_LINE if stands else 0.0
    expected = any(-over <= place - front < LINE_VIEW for place in places)
    assert is_before_line(road, front, 0.0 if stands else 1.0) == expected
