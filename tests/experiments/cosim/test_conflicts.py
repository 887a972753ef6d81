import numpy as np
import pytest

from experiments.cosim.conflicts import (
    LateralProfile,
    Sizes,
    braking_leader,
    cut_in,
    cut_out,
)
from experiments.errors import ConfigError


def test_cut_in_has_its_parameters_at_the_start():
    lateral = np.array([0.0, 0.4, 1.7])
    conflicts = cut_in(20.0, 12.0, np.array([10.0, 20.0, 30.0]), lateral)
    column = np.arange(3)
    start = conflicts.start
    np.testing.assert_array_equal(start, [0, 3, 12])
    np.testing.assert_allclose(conflicts.lateral_gap[start, column], 1.6)
    np.testing.assert_allclose(conflicts.lateral_speed[start, column], lateral)
    np.testing.assert_allclose(conflicts.gap - 8.0 * start * 0.1, [10.0, 20.0, 30.0])


def test_lateral_speed_grows_with_one_and_a_half():
    conflicts = cut_in(20.0, 12.0, np.array([10.0]), np.array([0.5]))
    np.testing.assert_allclose(
        conflicts.lateral_speed[:6, 0], [0.0, 0.15, 0.3, 0.45, 0.5, 0.5]
    )


def test_lateral_gap_is_the_integral_of_the_lateral_speed():
    conflicts = cut_in(20.0, 12.0, np.array([10.0]), np.array([1.1]))
    driven = -np.diff(conflicts.lateral_gap[:, 0])
    np.testing.assert_allclose(driven, 0.1 * conflicts.lateral_speed[:-1, 0])


def test_standing_vehicle_is_seen_when_the_leader_has_left():
    conflicts = cut_out(20.0, 40.0, np.array([30.0]), np.array([1.0]))
    # 1.9 m at 1 m/s; the ego stands 40 m + 4.3 m + 30 m away
    assert np.flatnonzero(conflicts.visible[:, 0])[0] == 19
    np.testing.assert_allclose(conflicts.gap, 74.3)


def test_leader_brakes_to_a_stop():
    conflicts = braking_leader(np.array([10.0]), np.array([5.0]), np.array([20.0]))
    np.testing.assert_allclose(conflicts.other_speed[[0, 10, 20, 30], 0], [10, 5, 0, 0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sizes(other_width=3.6), "other_width 3.6 m must lie between"),
        (lambda: Sizes(ego_length=0.0), "lengths of vehicles"),
        (lambda: cut_in(20, 10, np.zeros(1), np.ones(1)), "dx0 0 m must be greater"),
        (lambda: cut_in(-1, 10, np.ones(1), np.ones(1)), "got -1"),
        (
            lambda: cut_out(20, 30, np.ones(1), np.zeros(1)),
            "lateral speed of a cut-out",
        ),
        (lambda: braking_leader(*np.zeros((3, 1))), "deceleration of a leader"),
    ],
)
def test_impossible_conflicts_are_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


def test_quintic_cut_in_has_vy_as_its_greatest_speed_and_ends_in_the_lane():
    lateral = np.array([0.0, 1.5])
    conflicts = cut_in(
        20.0, 10.0, np.full(2, 30.0), lateral, profile=LateralProfile.QUINTIC
    )
    assert conflicts.lateral_speed[:, 1].max() == pytest.approx(1.5, abs=0.01)
    assert conflicts.lateral_gap[0, 1] == pytest.approx(1.6)
    assert conflicts.lateral_gap[-1, 1] == pytest.approx(1.6 - 3.5)
    moved = np.sum(conflicts.lateral_speed[:, 1]) * 0.1  # the speed is its derivative
    assert moved == pytest.approx(3.5, abs=1e-3)
    np.testing.assert_allclose(conflicts.lateral_gap[:, 0], 1.6)
    assert conflicts.gap[1] == 30.0
