import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from experiments.thesis.lane_change.dubins import (
    DubinsWord,
    dubins_paths,
    shortest_dubins,
)
from experiments.thesis.lane_change.plane_curve import sample_curve
from planner.errors import InvalidInputError
from tests.experiments.thesis.lane_change.test_plane_curve import (
    finite_differences_agree,
)

ANGLE = st.floats(-3.1, 3.1)
POSES = st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), ANGLE)
RADIUS = st.floats(0.5, 3.0)


def shkel(  # noqa: PLR0911 - one return for each word
    word: str, d: float, a: float, b: float
) -> tuple[float, float, float] | None:
    """The closed forms of Shkel and Lumelsky (2001), radius 1, start (0, 0, a)."""
    turn = 2.0 * math.pi
    sa, ca, sb, cb, cab = (
        math.sin(a), math.cos(a), math.sin(b), math.cos(b), math.cos(a - b),
    )  # fmt: skip
    if word == "LSL":
        t = math.atan2(cb - ca, d + sa - sb)
        square = 2 + d * d - 2 * cab + 2 * d * (sa - sb)
        return (t - a) % turn, math.sqrt(max(square, 0.0)), (b - t) % turn
    if word == "RSR":
        t = math.atan2(ca - cb, d - sa + sb)
        square = 2 + d * d - 2 * cab + 2 * d * (sb - sa)
        return (a - t) % turn, math.sqrt(max(square, 0.0)), (t - b) % turn
    if word == "LSR":
        square = -2 + d * d + 2 * cab + 2 * d * (sa + sb)
        if square < 0.0:
            return None
        p = math.sqrt(square)
        t = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
        return (t - a) % turn, p, (t - b) % turn
    if word == "RSL":
        square = -2 + d * d + 2 * cab - 2 * d * (sa + sb)
        if square < 0.0:
            return None
        p = math.sqrt(square)
        t = math.atan2(ca + cb, d - sa - sb) - math.atan2(2.0, p)
        return (a - t) % turn, p, (b - t) % turn
    if word == "RLR":
        cos = (6 - d * d + 2 * cab + 2 * d * (sa - sb)) / 8
        if abs(cos) > 1.0:
            return None
        p = turn - math.acos(cos)
        t = (a - math.atan2(ca - cb, d - sa + sb) + p / 2) % turn
        return t, p, (a - b - t + p) % turn
    cos = (6 - d * d + 2 * cab + 2 * d * (sb - sa)) / 8
    if abs(cos) > 1.0:
        return None
    p = turn - math.acos(cos)
    t = (-a + math.atan2(cb - ca, d + sa - sb) + p / 2) % turn
    return t, p, (b - a - t + p) % turn


def by_second_formula(start, end, radius) -> dict[str, float]:
    dx, dy = end[0] - start[0], end[1] - start[1]
    d, line = math.hypot(dx, dy) / radius, math.atan2(dy, dx)
    found = {}
    for word in DubinsWord:
        segments = shkel(word, d, start[2] - line, end[2] - line)
        if segments is not None:
            found[word.value] = radius * sum(segments)
    return found


@given(POSES, POSES, RADIUS)
def test_every_word_ends_where_it_should(start, end, radius):
    for path in dubins_paths(start, end, radius):
        x, y, heading = path.end()
        assert (x, y) == pytest.approx(end[:2], abs=1e-7)
        assert math.sin(0.5 * (heading - end[2])) == pytest.approx(0.0, abs=1e-8)


@given(POSES, POSES, RADIUS)
def test_the_shortest_is_as_short_as_by_the_closed_forms(start, end, radius):
    # from a place to itself the closed forms go once about a circle
    assume(math.dist(start[:2], end[:2]) > 1e-3)
    second = by_second_formula(start, end, radius)
    ours = shortest_dubins(start, end, radius)
    assert ours.length == pytest.approx(min(second.values()), abs=1e-5)


def test_each_word_agrees_with_the_closed_forms_and_each_wins_somewhere():
    rng = np.random.default_rng(3)
    winners = set()
    for _ in range(400):
        start = (*rng.uniform(-4.0, 4.0, 2), rng.uniform(-3.0, 3.0))
        end = (*rng.uniform(-4.0, 4.0, 2), rng.uniform(-3.0, 3.0))
        second = by_second_formula(start, end, 1.5)
        paths = dubins_paths(start, end, 1.5)
        for path in paths:
            if path.word[1] != "S":
                # over three circles there are two ways, the formula has one of them
                assert path.length <= second[path.word] + 1e-8
            else:
                assert path.length == pytest.approx(second[path.word], abs=1e-8)
        assert {p.word.value for p in paths} == set(second)
        winners.add(min(paths, key=lambda p: p.length).word)
    assert winners == set(DubinsWord)


@pytest.mark.slow
def test_no_steering_found_by_search_is_shorter():
    """Brute force: any steering in 10 steps that reaches the pose is no shorter."""
    rng = np.random.default_rng(5)
    ratios = []
    for _ in range(4):
        start = (0.0, 0.0, rng.uniform(-3.0, 3.0))
        end = (*rng.uniform(-4.0, 4.0, 2), rng.uniform(-3.0, 3.0))
        shortest = shortest_dubins(start, end, 1.0).length
        best = min(searched(start, end, rng) for _ in range(12))
        assert math.isfinite(best)
        assert best >= shortest - 1e-3
        ratios.append(best / shortest)
    assert min(ratios) < 1.1  # the search was not idle


def searched(start, end, rng, n=10) -> float:
    """Minimise the length over steering |k| <= 1, held over n steps."""

    def reached(z):
        x, y, heading = start
        step = z[-1] / n
        for k in z[:-1]:
            half = 0.5 * k * step
            chord = step * np.sinc(half / np.pi)
            x += chord * math.cos(heading + half)
            y += chord * math.sin(heading + half)
            heading += 2.0 * half
        turned = heading - end[2]
        return np.array(
            [x - end[0], y - end[1], math.sin(turned), 1 - math.cos(turned)]
        )

    first = np.append(rng.uniform(-1.0, 1.0, n), rng.uniform(2.0, 14.0))
    found = minimize(
        lambda z: z[-1],
        first,
        bounds=[(-1.0, 1.0)] * n + [(0.1, 30.0)],
        constraints={"type": "eq", "fun": lambda z: reached(z)[:3]},
        options={"maxiter": 200},
    )
    ok = np.abs(reached(found.x)).max() < 1e-4
    return float(found.fun) if found.success and ok else math.inf


@pytest.mark.parametrize("seed", range(6))
def test_sampled_points_follow_the_equations_of_motion(seed):
    """Eq. 6.6 to 6.8 with v = 1, integrated numerically segment by segment."""
    rng = np.random.default_rng(seed)
    start = (*rng.uniform(-4.0, 4.0, 2), rng.uniform(-3.0, 3.0))
    end = (*rng.uniform(-4.0, 4.0, 2), rng.uniform(-3.0, 3.0))
    for path in dubins_paths(start, end, 1.2):
        curve = sample_curve(path.pieces(), 0.05)
        state = np.array(start)
        for length, curvature in zip(path.lengths, path.curvatures, strict=True):
            state = solve_ivp(
                lambda _, z, k=curvature: [math.cos(z[2]), math.sin(z[2]), k],
                (0.0, length),
                state,
                rtol=1e-10,
                atol=1e-10,
            ).y[:, -1]
        assert (curve.x[-1], curve.y[-1]) == pytest.approx(tuple(state[:2]), abs=1e-7)
        assert curve.heading[-1] == pytest.approx(state[2], abs=1e-7)
        assert curve.length == pytest.approx(path.length, abs=1e-9)
        finite_differences_agree(curve, 2e-3)


def test_straight_on_and_a_whole_circle():
    ahead = shortest_dubins(
        (0.0, 0.0, 0.3), (10 * math.cos(0.3), 10 * math.sin(0.3), 0.3), 2.0
    )
    assert ahead.length == pytest.approx(10.0)
    assert sample_curve(ahead.pieces(), 0.1).jumps.size == 0
    back = shortest_dubins((0.0, 0.0, 0.0), (-1e-3, 0.0, 0.0), 2.0)
    assert back.length == pytest.approx(4.0 * math.pi, abs=2e-3)


def test_a_radius_that_is_none_is_refused():
    with pytest.raises(InvalidInputError, match="radius = 0"):
        dubins_paths((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0)
    with pytest.raises(InvalidInputError, match="finite"):
        dubins_paths((0.0, math.nan, 0.0), (1.0, 0.0, 0.0), 1.0)
