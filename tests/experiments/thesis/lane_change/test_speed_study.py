"""Cases 1 and 2 of chapter 6: the figures, and the picture of them."""

import io

import pytest
from rich.console import Console

from experiments.thesis.lane_change.published_cases import VARIANTS, solve_case
from experiments.thesis.lane_change.speed_study import main


def speeds(case):
    v = case.plan.profile.speed
    least = int(v.argmin())
    return [v[0], v[least], v[least:].max(), v[-1]]


def test_case_1_is_as_expected_without_the_margin_along():
    case = solve_case(9.0, VARIANTS["no margin along"])
    assert case.region == "B"
    assert speeds(case) == pytest.approx([9.0, 7.5, 12.0, 11.6], abs=0.06)


def test_the_margin_along_makes_case_1_brake_more():
    case = solve_case(9.0)
    assert case.region == "B"
    assert speeds(case) == pytest.approx([9.0, 6.96, 12.08, 11.71], abs=0.02)
    assert case.area_b > case.area_a  # the rule of the thesis says the same


def test_case_2_goes_first():
    case = solve_case(15.0)
    assert case.region == "A"
    assert speeds(case) == pytest.approx([15.0, 12.5, 14.0, 14.0], abs=0.06)
    assert case.area_a > case.area_b


def test_the_command_prints_and_draws_the_same_bytes_twice(tmp_path):
    pictures = []
    for name in ("one.svg", "two.svg"):
        out = io.StringIO()
        main(["-o", str(tmp_path / name)], Console(file=out, width=200))
        assert "6.96" in out.getvalue()
        pictures.append((tmp_path / name).read_bytes())
    assert pictures[0] == pictures[1]
    text = pictures[0].decode()
    for words in ("A: ahead of the car", "B: behind the car", "jerk [m/s³]", "6.14"):
        assert words in text


def test_a_suffix_that_is_no_picture_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["-o", str(tmp_path / "picture.txt")])
    assert "allowed: .svg" in capsys.readouterr().err
