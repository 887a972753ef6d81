"""The limits and the road, for all candidates of one profile at one step.

The inner loop runs over terminal offsets: everything that depends on the profile alone
is a constant in it, and what is left is arithmetic without branches, which the compiler
does for several candidates at once.
"""

from planner.cruise.candidate_motion import (
    BEND,
    KAPPA,
    KAPPA_RATE,
    LEFT,
    RIGHT,
    S_DDOT,
    S_DOT,
    SLOPE,
    TO_FRONT,
    TO_REAR,
    UNIT_BEND,
    UNIT_L,
    UNIT_SLOPE,
    L,
)
from planner.cruise.feasibility import (
    MIN_STRETCH,
    CandidateLimits,
    Check,
    RoadBend,
    RoadBody,
    road_excess,
)
from planner.cruise.workspace import Bench
from planner.numerics.compiled import inlined
from planner.reference_path.frenet import cartesian_rates
from planner.states import FloatArray, IntArray

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
DOMAIN = int(Check.DOMAIN)
ROAD = int(Check.ROAD)
CURVATURE = int(Check.CURVATURE)
ACCELERATION = int(Check.ACCELERATION)
LATERAL_ACCELERATION = int(Check.LATERAL_ACCELERATION)
LATERAL_JERK = int(Check.LATERAL_JERK)
SUSPECT = 100  # added to a check's number where the road's edge is to be looked at


@inlined
def check_profile(
    p: int,
    count: int,
    rows: FloatArray,
    limits: CandidateLimits,
    bench: Bench,
    verdict: IntArray,
) -> int:
    """Check candidates of one profile, point by point, to their first violation.

    [Thesis] eq. 4.12, 4.13, and bounds that settle most of the road. The first point is
    not judged, the ego is already there.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of profiles and the road under them.
        limits: Of the vehicle.
        bench: Basis and changes of offset are given, the course is filled.
        verdict: Filled, (n,).

    Returns:
        How many candidates keep the limits.
    """
    n, basis, course = verdict.size, bench.basis, bench.course
    delta_l = bench.change
    axle_to_corner = max(limits.front, limits.rear)
    for o in range(n):
        verdict[o] = PASSED
    left = n
    for i in range(count):
        if left == 0:
            break
        s_dot, s_ddot = rows[p, S_DOT, i], rows[p, S_DDOT, i]
        kappa, kappa_rate = rows[p, KAPPA, i], rows[p, KAPPA_RATE, i]
        l0, slope0, bend0 = basis[L, i], basis[SLOPE, i], basis[BEND, i]
        l1, slope1, bend1 = basis[UNIT_L, i], basis[UNIT_SLOPE, i], basis[UNIT_BEND, i]
        leftmost, rightmost = _safe_offsets(p, i, rows, limits)
        suspects, left = 0, 0
        for o in range(n):
            l = l0 + delta_l[o] * l1
            slope = slope0 + delta_l[o] * slope1
            cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
                l, kappa, kappa_rate, s_dot, s_ddot, slope, bend0 + delta_l[o] * bend1
            )
            course[0, i, o] = cos_e
            course[1, i, o] = sin_e
            turned = axle_to_corner * abs(sin_e)
            sideways = speed * speed * curvature
            found = _check_sideways(sideways, bench.sideways[o], limits)
            bench.sideways[o] = sideways
            along = max(
                acceleration - limits.acceleration, -acceleration - limits.deceleration
            )
            found = ACCELERATION if along > 0.0 else found
            found = CURVATURE if abs(curvature) > limits.curvature else found
            suspect = SUSPECT if max(l - leftmost, rightmost - l) + turned > 0.0 else 0
            found = found + suspect
            found = DOMAIN if 1.0 - kappa * l < MIN_STRETCH else found
            before = verdict[o]
            found = found if before == PASSED else before
            verdict[o] = found
            suspects += 1 if found >= SUSPECT else 0
            left += 1 if found == PASSED else 0
        if i == 0:
            left = _forgive(verdict)
        elif suspects > 0:
            left = _settle(p, i, rows, basis, delta_l, limits, course, verdict)
    return left


@inlined
def _safe_offsets(
    p: int, i: int, rows: FloatArray, limits: CandidateLimits
) -> tuple[float, float]:
    """Return offsets between which a body along the road is within its edges [m].

    No body reaches farther from its axle's offset than that, and what it turns.
    """
    sharpest = max(
        abs(rows[p, TO_FRONT, i]), abs(rows[p, KAPPA, i]), abs(rows[p, TO_REAR, i])
    )
    axle_to_corner = max(limits.front, limits.rear)
    widest = limits.half_width + axle_to_corner**2 * sharpest - limits.excess
    return rows[p, LEFT, i] - widest, rows[p, RIGHT, i] + widest


@inlined
def _check_sideways(now: float, before: float, limits: CandidateLimits) -> int:
    """Check the lateral acceleration, and what it changed in a step."""
    found = LATERAL_JERK if abs(now - before) > limits.sideways_change else PASSED
    return LATERAL_ACCELERATION if abs(now) > limits.lateral_acceleration else found


@inlined
def _forgive(verdict: IntArray) -> int:
    """Drop the first point's violations but that of the domain; count those left."""
    left = 0
    for o in range(verdict.size):
        verdict[o] = DOMAIN if verdict[o] % SUSPECT == DOMAIN else PASSED
        left += 1 if verdict[o] == PASSED else 0
    return left


@inlined
def _settle(
    p: int,
    i: int,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    limits: CandidateLimits,
    course: FloatArray,
    verdict: IntArray,
) -> int:
    """Settle where bodies reach near the road's edge; count those without violation."""
    passed = 0
    body = RoadBody(limits.front, limits.rear, limits.half_width)
    bend = RoadBend(rows[p, TO_FRONT, i], rows[p, KAPPA, i], rows[p, TO_REAR, i])
    for o in range(verdict.size):
        if verdict[o] >= SUSPECT:
            excess = road_excess(
                basis[L, i] + delta_l[o] * basis[UNIT_L, i],
                course[0, i, o],
                course[1, i, o],
                bend,
                rows[p, LEFT, i],
                rows[p, RIGHT, i],
                body,
            )
            verdict[o] = ROAD if excess > limits.excess else verdict[o] - SUSPECT
        passed += 1 if verdict[o] == PASSED else 0
    return passed
