"""Tables and claims of chapter 6 say what results hold."""

import math

import pytest

from experiments.thesis.claims import ClaimVerdict
from experiments.thesis.lane_change.claims import (
    case_claims,
    curve_claims,
    path_claim,
)
from experiments.thesis.lane_change.published_cases import solve_case
from experiments.thesis.lane_change.random_scenes import ALL_ORDERS, AREA, RULES, Found
from experiments.thesis.lane_change.tables import (
    case_table,
    crowd_table,
    curve_table,
    order_table,
    solvable,
)


def found(area=1.0, best=1.0, *, orders=2, brute_force=None):
    cost = dict.fromkeys(RULES, best)
    cost[AREA] = area
    times = dict.fromkeys(RULES, 0.1)
    return Found(cost, times, 5, orders, 2, brute_force)


SCENES = [
    found(),
    found(area=1.5),
    found(area=math.inf),
    found(orders=1),
    found(best=math.inf, area=math.inf),
]


def test_rules_are_compared_where_there_is_a_choice():
    assert solvable(SCENES) == SCENES[:3]
    table = order_table(SCENES)
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows[ALL_ORDERS] == (3, 3, 0, 0, 0)
    assert rows[AREA] == (3, 1, 1, 50, 50)
    assert "2 of 5 scenes are left out" in table.note


def test_crowds_are_checked_against_brute_force():
    same, other = found(brute_force=1.0), found(brute_force=0.8)
    table = crowd_table({2: [same, other, found(best=math.inf)], 6: [found()]})
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    assert rows[0]["scenes that can be driven"] == 2
    assert rows[0]["other cost than brute force"] == "1 of 2"
    assert rows[1]["other cost than brute force"] == "not tried"


def test_curves_are_a_row_each_and_their_claims_have_a_verdict():
    table = curve_table()
    assert {len(row) for row in table.rows} == {len(table.header)}
    claims = {claim.id: claim for claim in curve_claims()}
    assert len(claims) == 7
    assert claims["6.3.4_dubins"].verdict is ClaimVerdict.HOLDS
    jumps = {row[0]: row[2] for row in table.rows}
    dubins = claims["6.3.4_dubins"].measured
    assert any(jumps[name.partition(",")[0]] == value for name, value in dubins.items())


def test_the_printed_cost_does_not_see_how_sharp_a_path_turns():
    claim = path_claim()
    assert not claim.picked
    corrected = claim.measured["of the corrected choice 1pm"]
    assert corrected < claim.measured["peak curvature of the choice as printed 1pm"]
    assert corrected >= claim.measured["least 1pm"]


def test_both_published_cases_are_planned_as_told():
    cases = [solve_case(speed) for speed in (9.0, 15.0)]
    table = case_table(cases)
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    assert [row["region"] for row in rows] == ["B", "A"]
    claims = {claim.id: claim for claim in case_claims(cases)}
    for number, row in enumerate(rows, 1):
        claim = claims[f"6.5.2_case_{number}"]
        assert claim.picked
        assert claim.measured["least mps"] == row["least m/s"]
        smooth = claims[f"6.5.2_case_{number}_smooth"]
        largest = row["largest jerk m/s³"]
        assert smooth.measured["largest jerk mps3"] == pytest.approx(largest)
