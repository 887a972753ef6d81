import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cruise.headway import MIN_REAR_GAP, STRIDE, headway_pairs

FRONT, REAR = 3.8, 1.0


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_pairs_against_plain_loops(seed):
    rng = np.random.default_rng(seed)
    n_profiles, n_bodies, n_steps = 3, 8, 31
    s = np.cumsum(rng.uniform(0.0, 1.5, (n_profiles, n_steps)), axis=1)
    s_dot = rng.uniform(0.0, 15.0, (n_profiles, n_steps))
    count = rng.integers(2, n_steps + 1, n_profiles)
    body_s = rng.uniform(-40.0, 80.0, (n_bodies, 1)) + np.cumsum(
        rng.uniform(-1.5, 1.5, (n_bodies, n_steps)), axis=1
    )
    body_s[0] = np.inf
    body_speed = rng.uniform(0.0, 15.0, n_bodies)
    body_speed[1] = 0.0
    reach = rng.uniform(0.5, 6.0, n_bodies)
    considered = rng.random(n_bodies) < 0.8
    standstill, ahead, behind = rng.uniform(0.5, 6.0, 3)
    first, step, body, lack = headway_pairs(
        s,
        s_dot,
        count,
        body_s,
        body_speed,
        reach,
        considered,
        FRONT,
        REAR,
        standstill,
        ahead,
        behind,
    )
    for p in range(n_profiles):
        expected = {}
        for i in range(STRIDE, count[p], STRIDE):
            for b in np.flatnonzero(considered):
                if body_s[b, i] > s[p, i]:
                    gap = body_s[b, i] - reach[b] - (s[p, i] + FRONT)
                    needed = standstill + ahead * s_dot[p, i]
                else:
                    gap = s[p, i] - REAR - (body_s[b, i] + reach[b])
                    needed = MIN_REAR_GAP + behind * body_speed[b]
                if gap < needed:
                    expected[i, b] = (1.0 - max(gap, 0.0) / needed) ** 2
        own = slice(first[p], first[p + 1])
        keys = zip(step[own], body[own], strict=True)
        found = dict(zip(keys, lack[own], strict=True))
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            assert abs(found[key] - value) < 1e-9


def test_nobody_near_makes_no_pairs():
    s, speed = np.linspace(0.0, 50.0, 51)[None], np.full((1, 51), 10.0)
    two = np.ones(2)
    first, step, *_ = headway_pairs(
        s,
        speed,
        np.array([51]),
        np.full((2, 51), 1000.0),
        0.0 * two,
        two,
        np.ones(2, dtype=np.bool_),
        FRONT,
        REAR,
        1.0,
        1.0,
        1.0,
    )
    assert step.size == 0
    assert list(first) == [0, 0]
