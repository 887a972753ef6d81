"""The compiled batch against a slow planner that goes by the formulas.

The samples (profiles, offsets, bodies) are those of the planner; every check and every
cost term is done again in plain numpy, candidate by candidate.
"""

import math
from dataclasses import dataclass, fields, replace
from functools import cache, partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from planner import cruise
from planner.bodies import bodies_of, leader_of
from planner.cruise.costs import convolve, safety_kernel, speed_deviation
from planner.cruise.feasibility import RoadBend, RoadBody, road_excess
from planner.cruise.headway import MIN_REAR_GAP, STRIDE
from planner.cruise.planner import NEAR_END
from planner.cruise.sampling.lateral import terminal_offsets
from planner.cruise.sampling.longitudinal import longitudinal_profiles
from planner.cruise.sampling.reference_speed import reference_speed
from planner.cruise.settings import (
    ComfortLimits,
    LateralMotion,
    Normalisation,
    SafetyTerm,
    Weights,
)
from planner.cruise.surroundings import DISC_EXCESS
from planner.errors import InvalidInputError
from planner.interface import PlanStatus
from planner.reference_path.frenet import frenet_to_cartesian
from planner.scene import Lanes
from planner.states import FrenetStates
from planner.vehicle import Vehicle, body_scale
from tests.planner.scenes import STEP, Car, Disc, bend, ego_on, make_scene, straight

TOLERANCE = 1e-6  # of limits
TERMS = (
    "jerk",
    "safety",
    "offset",
    "speed",
    "headway",
    "consistency",
    "heading",
    "dead_end",
    "lane",
)
STANDING = 0.5  # slower bodies are steered round [m/s]


@dataclass
class Candidate:
    """What the slow planner finds out about one candidate."""

    profile: int
    verdict: str
    terms: dict[str, float]
    s: np.ndarray
    l: np.ndarray
    x: np.ndarray
    y: np.ndarray
    blocker: str | None = None
    hit_size: float = 0.0


def quintic(start, offset, length):
    """Polynomial in u = done / length through the boundary values."""
    rows = [
        [1, 0, 0, 0, 0, 0],
        [0, 1, 0, 0, 0, 0],
        [0, 0, 2, 0, 0, 0],
        [1, 1, 1, 1, 1, 1],
        [0, 1, 2, 3, 4, 5],
        [0, 0, 2, 6, 12, 20],
    ]
    l, first, second = start
    values = [l, first * length, second * length**2, offset, 0.0, 0.0]
    return np.polynomial.Polynomial(np.linalg.solve(np.array(rows, float), values))


def taylor(polynomial, jet):
    """Compose with jets (4, n): value, derivatives over their factorials."""
    out = np.zeros_like(jet)
    for c in polynomial.coef[::-1]:
        out = np.stack(
            [sum(out[i] * jet[k - i] for i in range(k + 1)) for k in range(4)]
        )
        out[0] += c
    return out


def led_by(settings, scene):
    """How far ahead of its axle a body is led: long ones by their front axle."""
    long = body_scale(scene.vehicle) > 1.5 and settings.cover_discs > 1
    over_time = settings.lateral_motion is LateralMotion.TIME
    led = settings.lead_long_bodies and long and not over_time
    return scene.vehicle.wheelbase if led else 0.0


def trailing(start, offset, length, lead, done):
    """Offset and three derivatives of an axle that follows a led point, (4, n).

    The led point is on the quartic q from where it is, flat where it ends; the axle
    follows by dl/ds = (q - l) / lead, which is integrated numerically.
    """
    l, slope, bent = start
    rows = [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [1, 1, 1, 1, 1]]
    rows += [[0, 1, 2, 3, 4], [0, 0, 2, 6, 12]]
    values = [l + lead * slope, (slope + lead * bent) * length, offset, 0.0, 0.0]
    p = np.polynomial.Polynomial(np.linalg.solve(np.array(rows, float), values))

    def led(d, order):
        within = p.deriv(order)(d / length) / length**order if order else p(d / length)
        return np.where(d <= length, within, 0.0 if order else offset)

    axle, begin, now = np.full(done.size, l), 0.0, l
    for end in (length, max(length, done[-1]) + 1.0):
        found = solve_ivp(
            lambda d, l: (led(d, 0) - l) / lead,
            (begin, end),
            [now],
            method="DOP853",
            dense_output=True,
            rtol=1e-12,
            atol=1e-13,
        )
        here = (done > begin) & (done <= end)
        if here.any():
            axle[here] = found.sol(done[here])[0]
        begin, now = end, found.y[0, -1]
    first = (led(done, 0) - axle) / lead
    second = (led(done, 1) - first) / lead
    return np.stack([axle, first, second, (led(done, 2) - second) / lead])


def lateral(settings, scene, motion, duration, offset):
    """(l, l', l'', d³l/dt³) of every step, and the polynomial over its length."""
    ego, over_time = scene.ego_frenet, settings.lateral_motion is LateralMotion.TIME
    s, s_dot, s_ddot, s_dddot = motion
    if over_time:
        done, length = settings.step * np.arange(s.size), duration
        start = (ego.l, ego.l_dot, ego.l_ddot)
    else:
        end = min(round(duration / settings.step), s.size - 1)
        slow = max(
            settings.min_manoeuvre_length,
            settings.min_manoeuvre_speed
            * duration
            * (1.0 if led_by(settings, scene) else body_scale(scene.vehicle)),
        )
        done, length = s - s[0], max(s[end] - s[0], slow)
        start = (ego.l, ego.l_prime, ego.l_second)
    p = quintic(start, offset, length)
    lead = led_by(settings, scene)
    if lead > 0.0:
        l, first, second, third = trailing(start, offset, length, lead, done)
        jerk = third * s_dot**3 + 3.0 * second * s_dot * s_ddot + first * s_dddot
        return np.stack([l, first, second, jerk]), p, length
    u = done / length
    l, first, second = p(u), p.deriv(1)(u) / length, p.deriv(2)(u) / length**2
    if over_time:
        speed = np.maximum(s_dot, 0.1)
        slope, jerk = first / speed, p.deriv(3)(u) / length**3
        bent = (second - slope * s_ddot) / speed**2
    else:
        jet = np.stack([done, s_dot, s_ddot / 2.0, s_dddot / 6.0]) / length
        slope, bent, jerk = first, second, 6.0 * taylor(p, jet)[3]
    rows = np.stack([l, slope, bent, jerk])
    over = done > length + 1e-9
    rows[:, over] = 0.0
    rows[0, over] = offset
    return rows, p, length


def outside(u, w, half_length, half_width):
    return np.hypot(
        np.maximum(np.abs(u) - half_length, 0.0),
        np.maximum(np.abs(w) - half_width, 0.0),
    )


def nearest_on_segments(u0, w0, u1, w1, half_length, half_width):
    """Distance of segments from a box: convex along a segment, so ternary search."""
    if half_length == half_width == 0.0:
        along, across = u1 - u0, w1 - w0
        square = np.maximum(along**2 + across**2, 1e-300)
        share = np.clip(-(u0 * along + w0 * across) / square, 0.0, 1.0)
        return np.hypot(u0 + share * along, w0 + share * across)
    low, high = np.zeros_like(u0), np.ones_like(u0)
    for _ in range(60):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_a = outside(u0 + a * (u1 - u0), w0 + a * (w1 - w0), half_length, half_width)
        at_b = outside(u0 + b * (u1 - u0), w0 + b * (w1 - w0), half_length, half_width)
        low, high = np.where(at_a > at_b, a, low), np.where(at_a > at_b, high, b)
    ends = np.minimum(
        outside(u0, w0, half_length, half_width),
        outside(u1, w1, half_length, half_width),
    )
    middle = 0.5 * (low + high)
    inside = outside(
        u0 + middle * (u1 - u0), w0 + middle * (w1 - w0), half_length, half_width
    )
    return np.minimum(ends, inside)


def step_gaps(settings, scene, bodies, b, x, y, heading):
    """Gap of each step's sweep to body b, (n_steps - 1,); one pose gives its gap."""
    if settings.cover_discs == 1:
        discs, radius = [0.0], settings.single_disc_radius
    else:
        discs, radius = scene.vehicle.disc_cover(DISC_EXCESS)
    half_length, half_width, round_off = bodies.table.extents[b]
    px, py, cos, sin = bodies.table.poses[b, :, : x.size]
    gaps = []
    for disc in discs:
        dx, dy = x + disc * np.cos(heading) - px, y + disc * np.sin(heading) - py
        u, w = dx * cos + dy * sin, dy * cos - dx * sin
        first = slice(None, -1) if x.size > 1 else slice(None)
        last = slice(1, None) if x.size > 1 else slice(None)
        gaps.append(
            nearest_on_segments(
                u[first], w[first], u[last], w[last], half_length, half_width
            )
        )
    return np.min(gaps, axis=0) - round_off - radius


@cache
def circle_between(path, s, ahead, curvature):
    """Curvature of the circle that leads as far aside as the path does."""
    if ahead == 0.0:
        return curvature
    way = np.linspace(0.0, ahead, 401)
    turned = np.unwrap(path.at(s + way).heading)
    return 2.0 * np.trapezoid(turned - turned[0], way) / ahead**2


class SlowPlanner:
    """Everything of one cycle, candidate by candidate."""

    def __init__(self, settings, scene, comfort=None):
        self.settings, self.scene = settings, scene
        self.comfort = comfort or ComfortLimits.none()
        self.speed_ahead = reference_speed(scene, settings)
        end = settings.horizon or max(settings.times)
        self.bodies = bodies_of(scene, round(end / settings.step) + 1)
        self.tracks = longitudinal_profiles(
            scene, settings, self.speed_ahead, leader_of(scene, self.bodies)
        ).tracks
        vehicle, own = scene.vehicle, scene.vehicle.limits
        whole = settings.cover_discs > 1
        self.front = vehicle.front_reach if whole else 0.0
        self.rear = vehicle.rear_overhang if whole else 0.0
        self.half_width = vehicle.width / 2.0 + settings.road_margin
        self.max_braking = min(
            settings.max_deceleration or own.max_deceleration,
            self.comfort.deceleration,
        )
        self.max_sideways = min(
            settings.max_lateral_acceleration or own.max_lateral_acceleration,
            self.comfort.lateral_acceleration,
        )
        self.max_curvature = settings.max_curvature or own.max_curvature
        furthest = float(self.tracks.rows[:, 0, -1].max())
        self.offsets = terminal_offsets(
            scene.road, (scene.ego_frenet.s, furthest), self.half_width, settings
        )
        ego = scene.ego
        now = [np.array([v]) for v in (ego.x, ego.y, ego.heading)]
        self.threshold = [
            min(
                settings.margin,
                float(step_gaps(settings, scene, self.bodies, b, *now)[0]) - 1e-6,
            )
            for b in range(len(self.bodies.ids))
        ]

    def remember(self, candidates, last):
        """Fill in the consistency with the last plan."""
        for found in candidates:
            was = 0.0 if last is None else np.interp(found.s, last.s, last.l)
            if found.terms:
                change = float(np.mean((found.l - was) ** 2))
                found.terms["consistency"] = change

    def candidates(self):
        out = []
        for p in range(self.tracks.n_valid.size):
            count = int(self.tracks.n_valid[p])
            motion = self.tracks.rows[p, :4, :count]
            dropped = self._dropped(motion)
            for offset in self.offsets:
                if dropped:
                    none = (np.empty(0),) * 4
                    out.append(Candidate(p, dropped, {}, *none))
                else:
                    out.append(self._candidate(p, motion, float(offset)))
        return out

    def _dropped(self, motion):
        limits, line = (
            self.scene.vehicle.limits,
            min(self.scene.stop_lines, default=1e9),
        )
        if motion[1].min() < -0.02:
            return "reversing"
        if motion[1].max() > max(limits.max_speed, self.scene.ego_frenet.s_dot) + 0.5:
            return "speed"
        if motion[0, -1] + self.scene.vehicle.front_reach > line:
            return "stop_line"
        if np.abs(motion[3]).max() > self.comfort.jerk:
            return "jerk"
        return ""

    def _candidate(self, p, motion, offset):
        settings, scene = self.settings, self.scene
        duration = float(self.tracks.duration[p])
        rows, polynomial, length = lateral(settings, scene, motion, duration, offset)
        s, s_dot, s_ddot, _ = motion
        l, slope, bent, jerk = rows
        road = scene.path.at(s)
        beyond = np.flatnonzero(1.0 - road.curvature * l < 0.05)
        n = int(beyond[0]) if beyond.size else s.size
        plane = frenet_to_cartesian(
            scene.path,
            FrenetStates(
                *(a[:n] for a in (s, s_dot, s_ddot, l)),
                *(np.zeros(n), np.zeros(n)),
                slope[:n],
                bent[:n],
            ),
        )
        error = plane.heading - road.heading[:n]
        verdict = self._first_violation(s[:n], l[:n], error, road.curvature[:n], plane)
        if not verdict and n < s.size:
            verdict = "domain"
        terms = {}
        if not verdict:
            if settings.lateral_motion is LateralMotion.TIME:
                third = polynomial.deriv(3) / length**3
                square = (third**2).integ()
                sideways = length * (square(1.0) - square(0.0))
            else:
                sideways = settings.step * np.sum(jerk**2)
            terms = {
                "jerk": sideways + float(self.tracks.jerk[p]),
                "offset": float(np.mean(l**2)),
                "heading": math.sin(error[-1]) ** 2,
                "headway": self._headway(s, s_dot, l),
                "dead_end": self._dead_end(
                    s,
                    s_dot,
                    partial(self._onward, polynomial, length, offset),
                ),
                "lane": self._lane(offset),
            }
        found = Candidate(p, verdict or "passed", terms, s, l, plane.x, plane.y)
        if not verdict:
            self._bodies(found, plane)
        return found

    def _first_violation(self, s, l, error, curvature, plane):
        """The first check that fails at the first point that fails one."""
        scene, ego = self.scene, self.scene.ego
        left, right = scene.road.at(s)
        ahead_left, ahead_right = scene.road.at(s + scene.vehicle.front_reach)
        left, right = np.minimum(left, ahead_left), np.maximum(right, ahead_right)
        here_left, here_right = scene.road.at(s[:1])
        body = RoadBody(self.front, self.rear, self.half_width)

        def excess(i, left, right):
            cos, sin = math.cos(error[i]), math.sin(error[i])
            ahead = circle_between(scene.path, s[i], self.front, curvature[i])
            behind = circle_between(scene.path, s[i], -self.rear, curvature[i])
            bend = RoadBend(ahead, curvature[i], behind)
            return road_excess(l[i], cos, sin, bend, left, right, body)

        allowed = max(excess(0, here_left[0], here_right[0]), 0.0)
        limits = scene.vehicle.limits
        forward = max(limits.max_acceleration, ego.acceleration)
        braking = max(self.max_braking, -ego.acceleration)
        bent = max(self.max_curvature, abs(ego.curvature))
        sideways = max(self.max_sideways, ego.speed**2 * abs(ego.curvature))
        for i in range(1, s.size):
            kappa, a = plane.curvature[i], plane.acceleration[i]
            if excess(i, left[i], right[i]) > allowed + TOLERANCE:
                return "road"
            if abs(kappa) > bent + TOLERANCE:
                return "curvature"
            if a > forward + TOLERANCE or a < -braking - TOLERANCE:
                return "acceleration"
            before, now = (plane.speed[j] ** 2 * plane.curvature[j] for j in (i - 1, i))
            if abs(now) > sideways + TOLERANCE:
                return "lateral_acceleration"
            if abs(now - before) > self.comfort.lateral_jerk * self.settings.step:
                return "lateral_jerk"
        return ""

    def _lane(self, offset):
        """Squared distance to the nearest lane's middle where the ego is in 3 s."""
        ego, lanes = self.scene.ego_frenet, self.scene.lanes
        s = ego.s + 3.0 * ego.s_dot
        middles = [np.interp(s, lanes.s, centre) for centre in lanes.centre]
        return min((abs(offset - middle) for middle in middles), default=0.0) ** 2

    def _corridor(self, b):
        """Lateral distance below which body b is in the way."""
        settings = self.settings
        _, radius = self.scene.vehicle.disc_cover(DISC_EXCESS)
        if settings.cover_discs == 1:
            radius = settings.single_disc_radius
        return radius + settings.margin + self.bodies.table.extents[b, 1:].sum()

    def _headway(self, s, s_dot, l):
        settings, bodies, vehicle = self.settings, self.bodies, self.scene.vehicle
        total = 0.0
        for b in range(bodies.table.n_static, len(bodies.ids)):
            if bodies.table.follower[b]:
                continue
            half_length = bodies.table.extents[b, 0]
            for i in range(STRIDE, s.size, STRIDE):
                if abs(bodies.table.l[b, i] - l[i]) >= self._corridor(b):
                    continue
                apart = bodies.table.s[b, i] - s[i]
                if apart > 0.0 and bodies.table.speed[b] <= STANDING:
                    continue
                if apart > 0.0:
                    gap = apart - half_length - vehicle.front_reach
                    needed = settings.standstill_gap + settings.time_headway * s_dot[i]
                else:
                    gap = -apart - half_length - vehicle.rear_overhang
                    needed = (
                        settings.rear_time_headway * bodies.table.speed[b]
                        + MIN_REAR_GAP
                    )
                if gap < needed:
                    total += (1.0 - max(gap, 0.0) / needed) ** 2
        return total * STRIDE / self.tracks.rows.shape[2]

    def _onward(self, polynomial, length, offset, done):
        """Offset and slope of the motion, driven on beyond the plan."""
        over_time = self.settings.lateral_motion is LateralMotion.TIME
        ego, lead = self.scene.ego_frenet, led_by(self.settings, self.scene)
        if lead > 0.0:
            start = (ego.l, ego.l_prime, ego.l_second)
            places = np.array([0.0, max(done, 1e-6)])
            l, slope, _, _ = trailing(start, offset, length, lead, places)
            return l[1], slope[1]
        if over_time or done > length + 1e-9:
            return offset, 0.0
        u = done / length
        return polynomial(u), polynomial.deriv(1)(u) / length

    def _comes_to(self, b, s, onward):
        """Whether front, axle or rear come to a body, driven on."""
        bodies, vehicle = self.bodies, self.scene.vehicle
        half_length, _, radius = bodies.table.extents[b]
        near = bodies.table.s[b, s.size - 1] - half_length - radius
        for q in (vehicle.front_reach, 0.0, -vehicle.rear_overhang):
            axle = max(near - q, s[-1])
            place = self._aside(q, axle, s, onward)
            if abs(bodies.table.l[b, s.size - 1] - place) <= self._corridor(b):
                return True
        return False

    def _aside(self, q, axle, s, onward):
        l, slope = onward(axle - s[0])
        curvature = float(self.scene.path.at(axle).curvature)
        circle = circle_between(self.scene.path, axle, q, curvature)
        return l + q * slope - 0.5 * circle * q * q

    def _dead_end(self, s, s_dot, onward):
        settings, bodies, vehicle = self.settings, self.bodies, self.scene.vehicle
        stopping = s_dot[-1] ** 2 / (2.0 * vehicle.limits.max_deceleration)
        worst, i = 0.0, s.size - 1
        for b in np.flatnonzero(
            ~bodies.table.follower & (bodies.table.speed <= STANDING)
        ):
            beyond = bodies.table.s[b, i] - s[-1]
            half_length, _, radius = bodies.table.extents[b]
            if beyond <= 0.0 or not self._comes_to(b, s, onward):
                continue
            gap = max(beyond - half_length - radius - vehicle.front_reach, 0.0)
            scale = body_scale(vehicle)
            scale = math.sqrt(scale) if led_by(settings, self.scene) else scale
            room = settings.obstacle_gap * scale
            worst = max(worst, 1.0 - gap / (room + stopping))
        return worst

    def _bodies(self, found, plane):
        settings, bodies, safety = self.settings, self.bodies, 0.0
        reach, first_hit = settings.scales.clearance, math.inf
        n = plane.x.size
        for b in np.flatnonzero(~bodies.table.follower):
            px, py = bodies.table.poses[b, :2, :n]
            away = np.hypot(plane.x - px, plane.y - py) - bodies.table.size[b]
            if away.min() > 10.0:
                continue
            pose = plane.x, plane.y, plane.heading
            gaps = step_gaps(settings, self.scene, bodies, b, *pose)
            gap = float(gaps.min())
            if gap < self.threshold[b]:
                found.verdict = "collision"
                found.hit_size = max(found.hit_size, float(bodies.table.size[b]))
                step = int(np.flatnonzero(gaps < self.threshold[b])[0])
                if step < first_hit:
                    first_hit, found.blocker = step, bodies.ids[b]
                gap = 0.0
            if gap < reach:
                safety += bodies.table.size[b] * (1.0 - max(gap, 0.0) / reach) ** 2
        found.terms["safety"] = safety


def priced(slow, candidates, settings, *, remembers):
    """Weighted terms (n, 7) and their sums; nan where there are none."""
    n_offsets = slow.offsets.size
    raw = np.array([[c.terms.get(name, np.nan) for name in TERMS] for c in candidates])
    speed = speed_deviation(
        slow.tracks.rows[:, 0], slow.tracks.rows[:, 1], *slow.speed_ahead
    )
    raw[:, TERMS.index("speed")] = np.repeat(speed, n_offsets)
    if settings.safety_term is not SafetyTerm.EDGE_CLEARANCE:
        hits = np.array([c.hit_size for c in candidates]).reshape(-1, n_offsets)
        sigma = settings.convolution_sigma
        kernel = safety_kernel(settings.safety_term, settings.lateral_step, sigma)
        binary = settings.safety_term is SafetyTerm.BINARY_CONVOLUTION
        raw[:, TERMS.index("safety")] = convolve(hits, kernel, binary).ravel()
    passed = np.array([c.verdict == "passed" for c in candidates])
    if settings.normalisation is Normalisation.PER_CYCLE:
        largest = raw[passed].max(axis=0, initial=0.0)
        scale = np.where(largest > 0.0, largest, 1.0)
    else:
        horizon = settings.horizon or max(settings.times)
        own = {name: getattr(settings.scales, name, 1.0) for name in TERMS}
        own["jerk"] *= horizon
        scale = np.array([own[name] for name in TERMS])
    weights = np.array([getattr(settings.weights, name) for name in TERMS])
    if not remembers:
        weights[TERMS.index("consistency")] = 0.0
    terms = raw * weights / scale
    return terms, terms.sum(axis=1), raw


def random_scene(seed):
    rng = np.random.default_rng(seed)
    path = (straight(), bend(25.0, before=30.0), bend(-18.0, before=20.0))[seed % 3]
    ego = ego_on(
        path,
        rng.uniform(0.0, 40.0),
        rng.uniform(-2.0, 2.0),
        rng.uniform(0.5, 12.0) if seed % 3 == 0 else rng.uniform(0.5, 7.0),
        rng.uniform(-0.05, 0.05),
        acceleration=rng.uniform(-1.0, 1.0),
    )
    s = float(path.project_one(ego.x, ego.y)[0])
    obstacles = [
        Disc(s + rng.uniform(8.0, 60.0), rng.uniform(-4.0, 4.0), rng.uniform(0.3, 1.5))
        for _ in range(3)
    ]
    vehicles = [
        Car(s + rng.uniform(12.0, 50.0), rng.uniform(-1.0, 3.5), rng.uniform(1.0, 9.0)),
        Car(s + rng.uniform(40.0, 90.0), 3.5, -rng.uniform(4.0, 12.0)),
        Car(s - rng.uniform(8.0, 30.0), rng.uniform(-4.0, 4.0), rng.uniform(5.0, 12.0)),
    ]
    lines = (s + rng.uniform(20.0, 60.0),) if seed % 4 == 1 else ()
    scene = make_scene(path, ego, obstacles, vehicles, stop_lines=lines)
    if seed == 3:
        scene = replace(scene, vehicle=LORRY)
    if seed % 2:
        return scene
    ends = np.array([0.0, path.length])
    centres = np.array([[-3.5, -3.4], [0.0, 0.3], [3.2, 3.5]])
    return replace(scene, lanes=Lanes(ends, centres, np.full((3, 2), 3.3)))


LORRY = Vehicle(length=12.0, width=2.5, wheelbase=6.5, rear_overhang=3.0)
FEW = {
    "times": (1.5, 4.0),
    "speed_fractions": (0.0, 0.6, 1.0),
    "stop_times": (3.0, 5.0),
    "follow_times": (3.0,),
    "starting_lengths": (),
}
SETTINGS = {
    "comfort": replace(cruise.CruiseSettings(), **FEW),
    "closed_loop": replace(
        cruise.CruiseSettings(), **FEW, comfort=ComfortLimits.none()
    ),
    "over_time": replace(
        cruise.CruiseSettings(),
        **FEW,
        lateral_motion=LateralMotion.TIME,
        comfort=ComfortLimits.none(),
    ),
    "convolution": replace(
        cruise.conventional().settings,
        **FEW,
        edge_offsets=False,
        lateral_step=1.0,
        comfort=ComfortLimits.none(),
    ),
    "thesis": replace(cruise.thesis_proposed().settings, times=(4.0, 4.5, 5.0)),
    "thesis_conventional": replace(
        cruise.thesis_conventional().settings, times=(4.0, 5.0)
    ),
}

PLANNER = cruise.CruisePlanner(SETTINGS["closed_loop"])
COMFORTABLE = cruise.CruisePlanner(SETTINGS["comfort"])


def emphasised(settings):
    """The settings, and once more with each term counting for most."""
    yield settings
    relative = settings.normalisation is Normalisation.PER_CYCLE
    for name in TERMS:
        if relative and name in ("heading", "consistency"):
            continue  # may be rounding noise, over its own maximum
        changed = replace(settings.weights, **{name: 50.0})
        yield replace(settings, weights=changed)


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))]
)
def test_the_batch_is_what_the_formulas_say(name, seed):
    settings, scene = SETTINGS[name], random_scene(seed)
    stages = [SlowPlanner(settings, scene)]
    if settings.comfort.is_limiting:
        stages.insert(0, SlowPlanner(settings, scene, settings.comfort))
    stages = [(slow, slow.candidates()) for slow in stages]
    for memory in (None, cruise.CruisePlanner(settings).plan(scene, None).memory):
        for variant in emphasised(settings):
            result = cruise.CruisePlanner(variant).plan(scene, memory)
            for slow, candidates in stages:
                last = None if memory is None else memory.trajectory
                slow.remember(candidates, last)
                prices = priced(slow, candidates, variant, remembers=last is not None)
                if slow is not stages[-1][0] and not gets_on(candidates, *prices):
                    continue  # the limits of the vehicle count
                compare(result, candidates, *prices)
                break


def gets_on(candidates, terms, total, raw):
    """Whether the cheapest comfortable candidate leads to no dead end."""
    passed = [k for k, c in enumerate(candidates) if c.verdict == "passed"]
    if not passed:
        return False
    best = passed[int(np.argmin(total[passed]))]
    return raw[best, TERMS.index("dead_end")] <= NEAR_END


def test_comfortable_candidates_are_preferred_whatever_the_others_cost():
    kept = set()
    for seed in range(12):
        scene = random_scene(seed)
        plan = COMFORTABLE.plan(scene, None)
        comfort, ego = COMFORTABLE.settings.comfort, scene.ego
        hardest = np.abs(plan.trajectory.curvature) * plan.trajectory.speed**2
        allowed = max(comfort.lateral_acceleration, ego.speed**2 * abs(ego.curvature))
        if plan.status is PlanStatus.OK and "jerk" in plan.stats.removed:
            assert hardest.max() <= allowed + 1e-5
            kept.add(seed)
    assert len(kept) > 6


@pytest.mark.parametrize("limit", [f.name for f in fields(ComfortLimits)])
def test_a_comfort_limit_of_nothing_is_refused(limit):
    with pytest.raises(InvalidInputError, match=f"comfort.{limit} = 0"):
        ComfortLimits(**{limit: 0})


def compare(result, candidates, terms, total, raw):
    stats = result.stats
    verdicts = [c.verdict for c in candidates]
    survivors = [k for k, verdict in enumerate(verdicts) if verdict == "passed"]
    assert stats.candidates >= len(candidates)
    assert stats.survivors == len(survivors)
    for check in set(verdicts) - {"passed"}:
        assert stats.removed[check] >= verdicts.count(check)
    beyond = stats.candidates - len(candidates)
    assert sum(stats.removed.values()) == len(candidates) - len(survivors) + beyond
    if not survivors:
        assert result.status is not PlanStatus.OK
        return
    best = survivors[int(np.argmin(total[survivors]))]
    assert stats.costs["total"] == pytest.approx(total[best], rel=1e-8, abs=1e-9)
    runner_up = np.sort(total[survivors])[:2][-1]
    if len(survivors) > 1 and runner_up - total[best] < 1e-7:
        return  # a tie: either may be chosen
    for k, term in enumerate(TERMS):
        expected = pytest.approx(terms[best, k], rel=1e-8, abs=1e-9)
        assert stats.costs[term] == expected, term
    jerk = pytest.approx(raw[best, 0], rel=1e-8, abs=1e-9)
    assert stats.costs["jerk_integral"] == jerk
    offset = pytest.approx(raw[best, TERMS.index("offset")], rel=1e-8, abs=1e-12)
    assert stats.costs["mean_offset_squared"] == offset
    trajectory, chosen = result.trajectory, candidates[best]
    np.testing.assert_allclose(trajectory.x, chosen.x, atol=1e-9)
    np.testing.assert_allclose(trajectory.y, chosen.y, atol=1e-9)
    assert trajectory.t[-1] == pytest.approx((chosen.x.size - 1) * STEP)
    priced_ones = [
        k for k, verdict in enumerate(verdicts) if verdict in ("passed", "collision")
    ]
    cheapest = priced_ones[int(np.argmin(total[priced_ones]))]
    if np.sum(total[priced_ones] < total[cheapest] + 1e-7) == 1:
        assert stats.blocker == candidates[cheapest].blocker


def test_there_is_a_formula_here_for_every_term():
    assert {field.name for field in fields(Weights)} == set(TERMS)


def test_these_scenes_exercise_every_verdict():
    seen = set()
    for seed in range(4):
        removed = PLANNER.plan(random_scene(seed), None).stats.removed
        seen |= set(removed)
        seen |= set(COMFORTABLE.plan(random_scene(seed), None).stats.removed)
    assert {"collision", "acceleration", "lateral_acceleration"} <= seen
    assert {"jerk", "lateral_jerk"} <= seen
    assert {"curvature", "stop_line", "reversing", "road"} <= seen
