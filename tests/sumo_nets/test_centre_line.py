from math import pi
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import fresnel

from sumo_nets.build import ROOT
from sumo_nets.centre_line import (
    arc,
    clothoid,
    line,
    main,
    parse_segment,
    polyline,
    sample,
)
from sumo_nets.errors import NetworkError

curvatures = st.floats(-0.1, 0.1).filter(lambda k: abs(k) > 1e-3)


def test_clothoid_from_zero_curvature_matches_fresnel_integrals():
    length, curvature = 30.0, 1.0 / 20.0
    s, x, y, heading, k = sample([clothoid(length, 0.0, curvature)]).T
    a = np.sqrt(pi * length / curvature)
    sine, cosine = fresnel(s / a)
    np.testing.assert_allclose(x, a * cosine, atol=1e-12)
    np.testing.assert_allclose(y, a * sine, atol=1e-12)
    np.testing.assert_allclose(heading, 0.5 * s**2 * curvature / length, atol=1e-12)
    np.testing.assert_allclose(k, s * curvature / length, atol=1e-15)


@given(curvatures, st.floats(1.0, 60.0), st.floats(-pi, pi))
def test_arc_keeps_its_distance_to_the_centre(curvature, length, heading):
    x, y = sample([arc(length, curvature)], (3.0, -4.0, heading)).T[1:3]
    centre = np.array(
        [3.0 - np.sin(heading) / curvature, -4.0 + np.cos(heading) / curvature]
    )
    distance = np.hypot(x - centre[0], y - centre[1])
    np.testing.assert_allclose(distance, 1.0 / abs(curvature), rtol=1e-10)


@given(curvatures, st.floats(5.0, 40.0))
def test_clothoid_driven_back_returns_to_its_start(curvature, length):
    forth = clothoid(length, 0.0, curvature)
    _, x, y, heading, _ = sample([forth])[-1]
    _, x, y, heading, _ = sample(
        [clothoid(length, -curvature, 0.0)], (x, y, heading + pi)
    )[-1]
    np.testing.assert_allclose([x, y, heading - pi], 0.0, atol=1e-9)


def test_offset_polyline_lies_beside_the_segments():
    points = polyline([arc(20.0 * pi, 1.0 / 20.0)], offset=10.0)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1] - 20.0), 10.0)


def test_straight_lines_have_two_points_and_curves_one_per_metre():
    points = polyline([line(40.0), arc(10.0, 0.05), line(100.0)])
    assert len(points) == 1 + 1 + 10 + 1


def test_main_prints_the_shape_of_the_committed_road(capsys):
    bend = [f"arc {20 * pi} 0.05", "--start", "40", "0", "0"]
    assert main(bend) == 0
    edges = ElementTree.parse(ROOT / "u_shaped" / "u_shaped.edg.xml").getroot()
    shapes = {edge.get("id"): edge.get("shape", "").split() for edge in edges}
    assert capsys.readouterr().out.split() == shapes["own2"]
    assert main([*bend, "--offset", "10", "--reverse"]) == 0
    assert capsys.readouterr().out.split() == shapes["oncoming2"]


@pytest.mark.parametrize(
    "text", ["", "curve 3", "line", "arc 3", "line ten", "clothoid 1 2", "line -4"]
)
def test_a_segment_that_cannot_be_read_is_named(text, capsys):
    with pytest.raises(NetworkError, match=f'"{text}"'):
        parse_segment(text)
    assert main([text]) == 2
    assert text in capsys.readouterr().err
