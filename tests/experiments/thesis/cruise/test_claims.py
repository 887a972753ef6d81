"""Claims of chapter 4 say what made-up drives hold."""

import numpy as np
import pytest

from experiments.cosim.records import EpisodeStatus
from experiments.thesis.claims import ClaimVerdict
from experiments.thesis.cruise.claims import (
    comparison_claims,
    influence_claims,
    size_claim,
)
from experiments.thesis.cruise.claims_over_time import RoadDrives, drive_claims
from experiments.thesis.cruise.drives import (
    CONVENTIONAL,
    JERK_AND_SAFETY,
    ONLY_JERK,
    PROPOSED,
    Driven,
)

CYCLES = 90
ROADS = ("straight", "curved", "intersection", "u_shaped")


def driven(*, jerk=1.0, offset=1.0, clearance=1.0, back=0.1, arrived=True, begins=30):
    status = EpisodeStatus.ARRIVED if arrived else EpisodeStatus.COLLISION
    s = np.arange(CYCLES, dtype=float)
    return Driven(
        status,
        clearance,
        clearance - 0.5,
        back,
        np.full(CYCLES, jerk),
        np.full(CYCLES, offset),
        s,
        np.where(s >= begins, 1.0, 0.0),
        ((40.0, 0.0, 1.0),),
    )


OURS = {"offset": 0.5, "begins": 20}
THEIRS = {"jerk": 2.0, "back": 1.2}


def drives(road, random=3):
    methods = {
        PROPOSED: OURS,
        CONVENTIONAL: THEIRS,
        ONLY_JERK: {"clearance": 0.4},
        JERK_AND_SAFETY: {"offset": 0.9},
    }
    picked = {name: driven(**values) for name, values in methods.items()}
    return RoadDrives(
        road, picked, {name: [one] * random for name, one in picked.items()}
    )


ALL = [drives(road) for road in ROADS]


def by_id(claims):
    return {claim.id: claim for claim in claims}


def test_means_of_both_methods_are_compared():
    found = by_id(comparison_claims(ALL[0]))
    offset = found["4.2_straight_offset"]
    assert offset.measured == {
        "proposed": 0.5,
        "conventional": 1,
        "decline percent": 50,
    }
    assert offset.picked
    assert (offset.share.holds, offset.share.of) == (3, 3)
    assert found["4.2_straight_jerk"].verdict is ClaimVerdict.HOLDS


def test_only_layouts_that_both_drive_are_pairs():
    road = drives("straight")
    road.random[PROPOSED][1] = driven(arrived=False)
    assert len(road.pairs()) == 2
    assert by_id(comparison_claims(road))["4.2_straight_offset"].share.of == 2


def test_each_term_of_the_cost_is_tried():
    found = by_id(influence_claims(ALL))
    assert found["4.7.1_safety"].picked
    assert found["4.7.1_safety"].share.of == 3 * len(ROADS)
    assert found["4.7.1_safety"].measured[f"straight, {ONLY_JERK}"] == 0.4
    assert found["4.7.1_offset"].picked


@pytest.mark.parametrize(("growth", "holds"), [(0.6, True), (0.4, False)])
def test_distance_grows_with_size_by_more_than_a_sample(growth, holds):
    kept = [driven(clearance=0.5), driven(clearance=0.5 + growth)]
    claim = size_claim((0.5, 2.0), kept, kept)
    assert claim.picked is holds
    assert claim.measured["clearance to m"] == 0.5 + growth


def test_the_course_of_drives():
    found = by_id(drive_claims(ALL))
    assert found["4.7.2_safe"].picked
    assert found["4.7.2_safe"].measured["random drives that arrived"] == 24
    assert found[f"4.7.2_returns_{PROPOSED}"].picked
    assert found[f"4.7.2_returns_{CONVENTIONAL}"].picked  # it does not come back
    begins = found["4.7.2_curved_begins"]
    assert begins.measured == {"proposed m": 20, "conventional m": 30}
    assert begins.picked
    # J_jerk of the proposed method is the lower one: neither higher nor alike
    assert not found["4.7.2_straight_first_cycles"].picked
    assert not found["4.7.2_u_shaped_alike_to"].picked
    assert found["4.7.2_u_shaped_better_to"].picked
    window = found["4.7.2_curved_offset_to"]
    assert window.published == {"from cycle": 20, "to cycle": 40}
    assert window.measured == {"proposed": 0.5, "conventional": 1}
    assert not window.picked


def test_a_collision_is_not_safe():
    roads = [drives(road) for road in ROADS]
    roads[1].picked[PROPOSED] = driven(arrived=False)
    assert not by_id(drive_claims(roads))["4.7.2_safe"].picked
