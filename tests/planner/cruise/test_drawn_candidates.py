"""The candidates that a cycle gives to be drawn."""

from collections import Counter

import numpy as np
import pytest

from planner import cruise
from planner.cruise.candidate_motion import candidate_motion
from planner.cruise.cycle import Cycle
from planner.cruise.drawn_candidates import (
    MOST_KEPT,
    MOST_REMOVED,
    SPACING,
    alternatives_of,
)
from planner.cruise.feasibility import Check
from planner.interface import KEPT
from planner.states import Trajectory
from tests.planner.scenes import Disc, make_scene, straight

PLANNER = cruise.proposed()


@pytest.fixture(scope="module")
def plan():
    scene = make_scene(straight(), obstacles=[Disc(45.0, 0.3, 0.6)])
    return scene, PLANNER.plan(scene, None)


def test_a_few_of_each_verdict_that_start_at_the_ego(plan):
    scene, result = plan
    found = result.alternatives()
    counts = Counter(one.verdict for one in found)
    assert counts[KEPT] == min(MOST_KEPT, result.stats.survivors)
    for verdict, number in counts.items():
        if verdict != KEPT:
            # a profile that no lateral motion can mend is counted, but has no shape
            assert number <= min(MOST_REMOVED, result.stats.removed[verdict])
    assert counts["collision"] > 0
    for one in found:
        assert one.x.shape == one.y.shape
        assert np.abs(one.x).max() < 1000.0  # a shape, not what lay in memory
        assert np.abs(one.y).max() < 1000.0
        assert (one.x[0], one.y[0]) == pytest.approx((scene.ego.x, scene.ego.y))


def test_those_that_collide_do_and_those_kept_do_not(plan):
    _, result = plan
    for one in result.alternatives():
        nearest = np.hypot(one.x - 45.0, one.y - 0.3).min()
        if one.verdict == KEPT:
            assert nearest > 0.6


def test_asking_changes_nothing(plan):
    scene, result = plan
    first, again = result.alternatives(), result.alternatives()
    assert [one.x.tolist() for one in first] == [one.x.tolist() for one in again]
    once_more = PLANNER.plan(scene, None)
    assert once_more.trajectory.x.tolist() == result.trajectory.x.tolist()
    assert once_more.stats == result.stats


def test_drawn_points_are_those_of_the_candidates(plan):
    """Bit by bit, at every so many points and at the last one."""
    scene, _ = plan
    cycle = Cycle.of(scene, PLANNER.settings, None)
    n_offsets = cycle.tables.lateral.offsets.size
    shaped = np.flatnonzero(
        np.repeat(cycle.tables.tracks.dropped == Check.PASSED, n_offsets)
    )
    verdict = np.zeros(cycle.tables.tracks.dropped.size * n_offsets, np.int64)
    found = alternatives_of(cycle, verdict)
    places = np.rint(np.linspace(0, shaped.size - 1, MOST_KEPT)).astype(int)
    every = round(SPACING / PLANNER.settings.step)
    assert len(found) == MOST_KEPT
    for one, index in zip(found, shaped[places], strict=True):
        p, o = divmod(int(index), n_offsets)
        tables = cycle.tables
        whole = Trajectory.from_rows(
            candidate_motion(
                p,
                float(tables.lateral.offsets[o]),
                tables.tracks,
                tables.lateral,
                tables.road,
            )
        )
        last = whole.x.size - 1
        kept = [*range(0, last, every), last]
        assert one.x.tolist() == whole.x[kept].tolist()
        assert one.y.tolist() == whole.y[kept].tolist()
