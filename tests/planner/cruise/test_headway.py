import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cruise import CruiseSettings
from planner.cruise.candidate_motion import N_ROWS, S_DOT, UNIT_L, L, S
from planner.cruise.cycle import Cycle
from planner.cruise.headway import MIN_REAR_GAP, STRIDE, add_headway
from tests.planner.scenes import Car, Disc, ego_on, make_scene, straight

FRONT, REAR = 3.8, 1.0


def surroundings(cars, obstacles=()):
    path = straight()
    scene = make_scene(path, ego_on(path, 100.0, 0.0, 9.0), obstacles, cars)
    return Cycle.of(scene, CruiseSettings(), None).tables.around


def summed(rows, basis, change, around, count):
    headway = np.full(change.size, np.nan)
    add_headway(0, count, rows, basis, change, around, headway)
    return headway


def random_motion(rng, n_steps):
    """One profile and its lateral basis: only what the headway reads is filled."""
    rows, basis = np.full((1, N_ROWS, n_steps), np.nan), np.full((8, n_steps), np.nan)
    rows[0, S_DOT] = rng.uniform(0.0, 15.0, n_steps)
    rows[0, S] = 100.0 + np.cumsum(0.1 * rows[0, S_DOT])
    basis[L] = rng.uniform(-1.0, 1.0) + 0.02 * np.arange(n_steps)
    basis[UNIT_L] = np.linspace(0.0, 1.0, n_steps)
    return rows, basis


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_headway_against_plain_loops(seed):
    rng = np.random.default_rng(seed)
    cars = [
        Car(rng.uniform(60, 150), rng.uniform(-5, 5), rng.choice([0.0, 9.0, -8.0]))
        for _ in range(6)
    ]
    around = surroundings(cars, [Disc(120.0, 0.0, 1.0)])
    n_steps = around.s.shape[1]
    rows, basis = random_motion(rng, n_steps)
    count = int(rng.integers(2, n_steps + 1))
    change = np.array([-3.0, 0.0, 2.5])
    found = summed(rows, basis, change, around, count)
    s, s_dot = rows[0, S], rows[0, S_DOT]
    for o in range(change.size):
        l = basis[L] + change[o] * basis[UNIT_L]
        total = 0.0
        for i in range(STRIDE, count, STRIDE):
            for b in range(around.n_static, around.s.shape[0]):
                if around.follower[b]:
                    continue
                half_length, half_width, _ = around.extents[b]
                if abs(around.l[b, i] - l[i]) >= around.corridor + half_width:
                    continue
                ahead = around.s[b, i] - half_length - (s[i] + FRONT)
                behind = s[i] - REAR - (around.s[b, i] + half_length)
                if around.s[b, i] > s[i] and around.speed[b] <= 0.5:
                    continue
                if around.s[b, i] > s[i]:
                    gap = ahead
                    needed = around.standstill_gap + around.time_headway * s_dot[i]
                else:
                    gap = behind
                    room = around.rear_time_headway * around.speed[b]
                    needed = MIN_REAR_GAP + room
                if gap < needed:
                    total += (1.0 - max(gap, 0.0) / needed) ** 2
        assert abs(found[o] - total * STRIDE / n_steps) < 1e-12


def test_nobody_near_costs_nothing():
    around = surroundings([Car(380.0, 0.0, 10.0)])
    rng = np.random.default_rng(0)
    rows, basis = random_motion(rng, around.s.shape[1])
    free = summed(rows, basis, np.array([0.0, 1.0]), around, around.s.shape[1])
    assert not free.any()


def test_what_stands_ahead_is_nobody_to_follow():
    rng = np.random.default_rng(0)
    standing, driving = (surroundings([Car(112.0, 0.0, speed)]) for speed in (0.0, 2.0))
    rows, basis = random_motion(rng, standing.s.shape[1])
    change = np.array([0.0])
    assert not summed(rows[:, :, :21], basis, change, standing, 10).any()
    assert summed(rows[:, :, :21], basis, change, driving, 10).all()


def test_an_obstacle_is_no_vehicle_to_keep_a_headway_to():
    around = surroundings([], [Disc(112.0, 0.0, 1.0)])
    rng = np.random.default_rng(0)
    rows, basis = random_motion(rng, around.s.shape[1])
    free = summed(rows, basis, np.array([0.0, 1.0]), around, around.s.shape[1])
    assert not free.any()
