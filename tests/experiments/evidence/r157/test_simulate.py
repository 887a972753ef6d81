import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from experiments.cosim.conflicts import braking_leader, cut_in, cut_out
from experiments.errors import ConfigError
from experiments.evidence.r157.drivers import DRIVERS, driver
from experiments.evidence.r157.simulate import ConflictEnd, simulate
from planner.reference_drivers import CarefulHuman
from planner.reference_drivers.careful_human import Trigger
from planner.reference_drivers.driver import Judgement
from planner.reference_drivers.reaction import Reaction


@dataclass(frozen=True)
class Blind:
    reaction: Reaction = field(default_factory=Reaction)

    def following_gap(self, speed):
        return speed

    def judge(self, situation, state):
        return Judgement(np.zeros(situation.gap.size), state.noticed, state.dismissed)


def test_without_reaction_the_gap_at_the_overlap_decides():
    # Overlap at step 14 (1.6 m at 1.2 m/s); closing with 10 m/s drives 14 m until then.
    # The ego has passed a vehicle that is 8.6 m of lengths behind: dx0 < 5.4 m.
    gaps = np.array([5.3, 5.5, 9.6, 9.8, 100.0])
    results = simulate(Blind(), cut_in(20.0, 10.0, gaps, np.full(5, 1.2)))
    np.testing.assert_array_equal(
        results.outcome,
        [
            ConflictEnd.AVOIDED,
            ConflictEnd.SIDE_COLLISION,
            ConflictEnd.SIDE_COLLISION,
            ConflictEnd.REAR_COLLISION,
            ConflictEnd.REAR_COLLISION,
        ],
    )
    np.testing.assert_allclose(results.impact_speed, [0.0, 10.0, 10.0, 10.0, 10.0])
    np.testing.assert_array_equal(results.hardest_braking, 0.0)


def test_a_vehicle_that_keeps_its_lane_is_no_conflict():
    results = simulate(Blind(), cut_in(20.0, 10.0, np.array([5.0]), np.zeros(1)))
    assert results.outcome[0] == ConflictEnd.AVOIDED


def test_uncritical_cut_in_ends_the_conflict():
    results = simulate(CarefulHuman(), cut_in(20.0, 10.0, np.array([50.0]), np.ones(1)))
    assert results.outcome[0] == ConflictEnd.UNCRITICAL
    assert not results.collided[0]


@pytest.mark.parametrize("name", DRIVERS)
def test_a_batch_is_a_loop_of_single_conflicts(name):
    rng = np.random.default_rng(3)
    gaps, lateral = rng.uniform(1.0, 60.0, 40), rng.uniform(0.2, 1.7, 40)
    batch = simulate(driver(name), cut_in(25.0, 12.0, gaps, lateral))
    single = [
        simulate(driver(name), cut_in(25.0, 12.0, gaps[i : i + 1], lateral[i : i + 1]))
        for i in range(40)
    ]
    np.testing.assert_array_equal(batch.outcome, [r.outcome[0] for r in single])
    assert 0 < batch.collided.sum() < 40


def test_careful_human_two_seconds_behind_survives_every_braking_leader():
    human = CarefulHuman(trigger=Trigger.CLOSING, critical_time=math.inf)
    speed, braking = np.full(19, 30.0), np.linspace(0.5, 9.3, 19)
    following = human.following_gap(speed)
    assert not simulate(human, braking_leader(speed, braking, following)).collided.any()
    close = braking_leader(speed, braking, 0.3 * following)
    assert simulate(human, close).collided[-1]


def test_uncovered_vehicle_needs_the_stopping_distance():
    human = CarefulHuman(trigger=Trigger.CLOSING, critical_time=math.inf)
    # 20 m/s: seen after 1.9 s, 38 m further; then about 46 m to the stop
    gap = np.array([75.0, 95.0])
    conflicts = cut_out(20.0, 0.0, gap - 4.3, np.ones(2))
    np.testing.assert_array_equal(simulate(human, conflicts).collided, [True, False])


def test_unknown_driver_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match=r"'me' is not a reference driver.*rss"):
        driver("me")
