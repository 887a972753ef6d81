"""The cruise planner: [Thesis] ch. 4 made fit for the closed loop."""

import math
from dataclasses import dataclass, fields

import numpy as np

from planner.bodies import Bodies, bodies_of, leader_of
from planner.cruise import costs, sampling
from planner.cruise.evaluation import (
    CONSISTENCY,
    DEAD_END,
    HEADING,
    HEADWAY,
    JERK,
    LAST_L,
    N_ROWS,
    OFFSET,
    S_DOT,
    SAFETY,
    Lateral,
    S,
    Surroundings,
    Tracks,
    X,
    Y,
    candidate_motion,
    evaluate,
    lay_road,
)
from planner.cruise.feasibility import TOLERANCE, Check, Limits, road_excess
from planner.cruise.headway import headway_pairs
from planner.cruise.settings import (
    CruiseSettings,
    LateralMotion,
    Normalisation,
    SafetyTerm,
)
from planner.fallback import fallback
from planner.geometry.clearance import gaps_to, near_spans
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.states import FloatArray, IntArray, Trajectory

TINY = 1e-12  # a term that is nowhere larger makes no difference
CAPSULE_DISCS = 33  # 0.1 m apart: their hull waves by less than the tolerance
TOUCH_TOLERANCE = 2e-3  # by which a gap below the margin may still shrink [m]
STANDING = 0.5  # a slower vehicle is one to steer round [m/s]
REVERSE_TOLERANCE = 0.02  # rounding of profiles that end in a stand [m/s]


CHECK_NAMES = {
    int(check): check.name.lower() for check in Check if check is not Check.PASSED
}


@dataclass(frozen=True, slots=True)
class CruiseMemory:
    """What one cycle leaves to the next."""

    trajectory: Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class CruisePlanner:
    """Sample, check, price, choose; `plan` is a pure function of scene and memory."""

    settings: CruiseSettings

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = memory.trajectory if isinstance(memory, CruiseMemory) else None
        cycle = _Cycle.of(scene, self.settings, last)
        verdict, blocker, hit_size, raw = evaluate(
            cycle.tracks, cycle.lateral, cycle.limits, cycle.around
        )
        terms, total = _price(cycle, self.settings, verdict, hit_size, raw)
        counts = np.bincount(verdict, minlength=len(Check)).tolist()
        removed = {
            name: counts[check] for check, name in CHECK_NAMES.items() if counts[check]
        }
        for check, count in cycle.dropped.items():
            removed[check] = removed.get(check, 0) + count
        survivors = np.flatnonzero(verdict == Check.PASSED)
        blocking = _blocker_of_cheapest(cycle.bodies, verdict, blocker, total)
        candidates = verdict.size + sum(cycle.dropped.values())
        if survivors.size == 0:
            return _fall_back(
                scene, self.settings, cycle, last, (candidates, removed, blocking)
            )
        best = int(survivors[np.argmin(total[survivors])])
        trajectory = cycle.trajectory(best)
        stats = PlanStats(
            candidates=candidates,
            survivors=int(survivors.size),
            removed=removed,
            costs={
                **{name: float(terms[best, k]) for k, name in enumerate(costs.TERMS)},
                "total": float(total[best]),
                "jerk_integral": float(raw[best, JERK]),
                "mean_offset_squared": float(raw[best, OFFSET]),
            },
            blocker=blocking,
        )
        return PlanResult(PlanStatus.OK, trajectory, CruiseMemory(trajectory), stats)


def invalid(scene: Scene) -> str | None:
    """Say what makes a scene unusable, None if nothing does."""
    for state in (scene.ego, scene.ego_frenet):
        for field in fields(state):
            value = getattr(state, field.name)
            if not math.isfinite(value):
                return f"the ego's {field.name} is {value}"
    if not (math.isfinite(scene.target_speed) and scene.target_speed >= 0.0):
        return f"the target speed is {scene.target_speed}"
    if not scene.step > 0.0:
        return f"the time step is {scene.step}"
    if any(math.isnan(line) for line in scene.stop_lines):
        return "a stop line is nowhere (nan)"
    return _odd_array(scene)


def _odd_array(scene: Scene) -> str | None:
    """Name an array of the scene that is not finite; predictions may be out of reach."""
    ahead = scene.vehicles.prediction
    for record in (scene.obstacles, scene.vehicles, ahead, scene.road):
        for field in fields(record):
            values = getattr(record, field.name)
            if not isinstance(values, np.ndarray) or field.name in ("s", "l"):
                continue
            if not math.isfinite(float(values.sum())):
                return f"{field.name} of {type(record).__name__} is not finite"
    if np.isnan(ahead.s).any() or np.isnan(ahead.l).any():
        return "a predicted place on the path is nan"
    return None


@dataclass(frozen=True, slots=True, eq=False)
class _Cycle:
    """Everything that one cycle's evaluation reads."""

    bodies: Bodies
    tracks: Tracks
    lateral: Lateral
    limits: Limits
    around: Surroundings
    speed_term: FloatArray  # per profile [-]
    dropped: dict[str, int]  # candidates of profiles that cannot be driven
    has_last: bool

    @classmethod
    def of(
        cls, scene: Scene, settings: CruiseSettings, last: Trajectory | None
    ) -> "_Cycle":
        """Sample the profiles and put the scene into arrays."""
        speed_ahead = sampling.reference_speed(scene, settings)
        n_steps = round((settings.horizon or max(settings.times)) / settings.step) + 1
        bodies = bodies_of(scene, n_steps, settings.step)
        profiles = sampling.longitudinal_profiles(
            scene, settings, speed_ahead, leader_of(scene, bodies)
        )
        limits = _limits(scene, settings)
        span = (scene.ego_frenet.s, float(profiles.motion[:, 0, -1].max()))
        offsets = sampling.terminal_offsets(
            scene.road, span, limits.half_width, settings
        )
        n_profiles = profiles.count.size
        off_road = sampling.full_grid_size(settings) - offsets.size
        profiles, dropped = _drivable(scene, profiles)
        tracks = _tracks(scene, profiles, last)
        ego = scene.ego_frenet
        over_time = settings.lateral_motion is LateralMotion.TIME
        first, second = (
            (ego.l_dot, ego.l_ddot) if over_time else (ego.l_prime, ego.l_second)
        )
        return cls(
            bodies,
            tracks,
            Lateral(
                over_time,
                (ego.l, first, second),
                offsets,
                settings.min_manoeuvre_length,
                settings.step,
            ),
            limits,
            _surroundings(scene, settings, bodies, tracks, offsets),
            costs.speed_deviation(
                tracks.rows[:, S], tracks.rows[:, S_DOT], *speed_ahead
            ),
            {
                **{check: n * offsets.size for check, n in dropped.items() if n},
                **({"road": n_profiles * off_road} if off_road > 0 else {}),
            },
            last is not None,
        )

    def trajectory(self, index: int) -> Trajectory:
        """Candidate `index` as a trajectory."""
        p, o = divmod(index, self.lateral.offsets.size)
        count = int(self.tracks.n_valid[p])
        x, y, cos_h, sin_h, curvature, speed, acceleration, l = candidate_motion(
            p, float(self.lateral.offsets[o]), self.tracks, self.lateral
        )[:, :count]
        return Trajectory(
            self.lateral.step * np.arange(count, dtype=np.float64),
            x,
            y,
            np.arctan2(sin_h, cos_h),
            curvature,
            np.maximum(speed, 0.0),
            acceleration,
            self.tracks.rows[p, S, :count],
            l,
        )


def _limits(scene: Scene, settings: CruiseSettings) -> Limits:
    """Limits of this cycle.

    Where the ego already exceeds a limit, after a fallback say, it may do so no more
    than now: else no way back would be left.
    """
    vehicle, own, ego = scene.vehicle, scene.vehicle.limits, scene.ego
    whole_body = settings.cover_discs > 1
    deceleration = settings.max_deceleration or own.max_deceleration
    lateral = settings.max_lateral_acceleration or own.max_lateral_acceleration
    front = vehicle.front_reach if whole_body else 0.0
    rear = vehicle.rear_overhang if whole_body else 0.0
    half_width = vehicle.width / 2.0 + settings.road_margin
    at = scene.ego_frenet
    curvature = float(scene.path.at(at.s).curvature)
    error = math.atan2(at.l_prime, 1.0 - curvature * at.l)
    left, right = scene.road.at(np.array([at.s]))
    excess = road_excess(
        at.l,
        math.cos(error),
        math.sin(error),
        curvature,
        float(left[0]),
        float(right[0]),
        front,
        rear,
        half_width,
    )
    return Limits(
        max(own.max_acceleration, ego.acceleration) + TOLERANCE,
        max(deceleration, -ego.acceleration) + TOLERANCE,
        max(lateral, ego.speed**2 * abs(ego.curvature)) + TOLERANCE,
        max(settings.max_curvature or own.max_curvature, abs(ego.curvature))
        + TOLERANCE,
        front,
        rear,
        half_width,
        _allowed_excess(excess, settings.road_margin),
    )


def _stop_line(scene: Scene) -> float:
    """Arc length that the front must not pass: a line just passed asks to stand."""
    here = scene.ego_frenet.s + scene.vehicle.front_reach
    return max(min(scene.stop_lines, default=math.inf), here + TOLERANCE)


def _allowed_excess(excess: float, road_margin: float) -> float:
    """How far a candidate may reach over the edge less its margin [m].

    At the edge the margin may be used up, no more: the tail of a vehicle that turns
    away from the edge swings out before the vehicle moves in.
    """
    if excess < -road_margin:
        return TOLERANCE
    return max(excess, 0.0) + road_margin + TOLERANCE


def _drivable(
    scene: Scene, profiles: sampling.Profiles
) -> tuple[sampling.Profiles, dict[str, int]]:
    """Leave out profiles that no lateral motion can mend."""
    last = profiles.motion[np.arange(profiles.count.size), 0, profiles.count - 1]
    limit = max(scene.vehicle.limits.max_speed, scene.ego_frenet.s_dot) + 0.5
    line = _stop_line(scene)
    reverses = profiles.slowest < -REVERSE_TOLERANCE
    speeds = ~reverses & (profiles.fastest > limit)
    crosses = ~reverses & ~speeds & (last + scene.vehicle.front_reach > line)
    return profiles.only(~(reverses | speeds | crosses)), {
        Check.REVERSING.name.lower(): int(np.count_nonzero(reverses)),
        Check.SPEED.name.lower(): int(np.count_nonzero(speeds)),
        Check.STOP_LINE.name.lower(): int(np.count_nonzero(crosses)),
    }


def _tracks(
    scene: Scene, profiles: sampling.Profiles, last: Trajectory | None
) -> Tracks:
    """Put the path and the road under the profiles; the road also under the front."""
    n_profiles, _, n_steps = profiles.motion.shape
    rows = np.empty((n_profiles, N_ROWS, n_steps))
    rows[:, :LAST_L] = profiles.motion
    rows[:, LAST_L] = 0.0 if last is None else np.interp(rows[:, S], last.s, last.l)
    table, road = scene.path.table, scene.road
    lay_road(
        rows,
        (table.knots, table.bins),
        (road.s, road.left, road.right),
        scene.vehicle.front_reach,
    )
    return Tracks(rows, profiles.duration, profiles.count, profiles.jerk)


def _discs(scene: Scene, settings: CruiseSettings) -> tuple[FloatArray, float]:
    """Disc centres from the rear axle, and their radius."""
    if settings.cover_discs == 1:
        return np.zeros(1), settings.single_disc_radius
    return np.array(scene.vehicle.disc_offsets), scene.vehicle.disc_radius


def _thresholds(scene: Scene, settings: CruiseSettings, bodies: Bodies) -> FloatArray:
    """Gap that each body is due; no more than there is now, so that a way out stays.

    What there is now is measured from a capsule about the discs: from three discs it
    would shrink and grow while the ego drives straight past a body.
    """
    ego = scene.ego
    here = np.array(
        [[ego.x], [ego.y], [math.cos(ego.heading)], [math.sin(ego.heading)]]
    )
    discs, radius = _discs(scene, settings)
    capsule = np.linspace(discs[0], discs[-1], CAPSULE_DISCS)
    now = gaps_to(
        here, bodies.poses, bodies.extents, capsule, radius, settings.margin + 0.1
    )
    return np.minimum(settings.margin, now - TOUCH_TOLERANCE)


def _surroundings(
    scene: Scene,
    settings: CruiseSettings,
    bodies: Bodies,
    tracks: Tracks,
    offsets: FloatArray,
) -> Surroundings:
    """Put the bodies and the pairs that can matter into arrays."""
    vehicle = scene.vehicle
    discs, disc_radius = _discs(scene, settings)
    widest = float(np.abs(offsets).max(initial=abs(scene.ego_frenet.l)))
    reach = widest + 0.5 + disc_radius + float(np.abs(discs).max())
    fastest = float(tracks.rows[:, S_DOT].max(initial=0.0))
    first, spans = near_spans(
        tracks.rows[:, X : Y + 1],
        tracks.n_valid,
        bodies.poses,
        bodies.size,
        bodies.follower,
        reach + settings.scales.clearance,
        settings.step * (fastest + bodies.speed) + 0.01,
    )
    moving = np.arange(len(bodies.ids)) >= bodies.n_static
    lags = headway_pairs(
        tracks.rows[:, S],
        tracks.rows[:, S_DOT],
        tracks.n_valid,
        bodies.s,
        bodies.speed,
        bodies.extents[:, 0] + bodies.extents[:, 2],
        moving & ~bodies.follower,
        vehicle.front_reach,
        vehicle.rear_overhang,
        settings.standstill_gap,
        settings.time_headway,
        settings.rear_time_headway,
    )
    return Surroundings(
        bodies.poses,
        bodies.extents,
        bodies.s,
        bodies.l,
        _turn_gaps(bodies, settings),
        bodies.size,
        _thresholds(scene, settings, bodies),
        first,
        spans,
        *lags,
        discs,
        disc_radius,
        settings.scales.clearance,
        vehicle.front_reach,
        vehicle.limits.max_deceleration,
        disc_radius + settings.margin,
    )


def _turn_gaps(bodies: Bodies, settings: CruiseSettings) -> FloatArray:
    """Room that the ego keeps to what stands ahead, 0 for what moves, (n,) [m]."""
    gaps = np.full(bodies.size.size, settings.standstill_gap)
    gaps[: bodies.n_static] = settings.obstacle_gap
    return np.where(bodies.follower | (bodies.speed > STANDING), 0.0, gaps)


def _price(
    cycle: _Cycle,
    settings: CruiseSettings,
    verdict: IntArray,
    hit_size: FloatArray,
    raw: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Make the terms comparable and add them up; [Thesis] eq. 4.14.

    Returns:
        (terms (n, 8) in the order of `costs.TERMS`, weighted; total (n,)).
    """
    n_offsets = cycle.lateral.offsets.size
    safety = raw[:, SAFETY]
    if settings.safety_term is not SafetyTerm.EDGE_CLEARANCE:
        safety = costs.convolved_safety(
            hit_size.reshape(cycle.tracks.n_valid.size, n_offsets),
            settings.safety_term,
            settings.lateral_step,
            settings.convolution_sigma,
        ).ravel()
    speed = np.repeat(cycle.speed_term, n_offsets)
    columns = (raw[:, JERK], safety, raw[:, OFFSET], speed, raw[:, HEADWAY])
    rest = (raw[:, CONSISTENCY], raw[:, HEADING], raw[:, DEAD_END])
    terms = np.column_stack([*columns, *rest])
    weights, scales = settings.weights, settings.scales
    if settings.normalisation is Normalisation.PER_CYCLE:
        passed = verdict == Check.PASSED
        scale = terms[passed].max(axis=0, initial=0.0)
        scale = np.where(scale > TINY, scale, 1.0)
    else:
        horizon = settings.horizon or max(settings.times)
        scale = np.array(
            [
                scales.jerk * horizon,
                1.0,
                scales.offset,
                1.0,
                1.0,
                scales.consistency,
                scales.heading,
                1.0,
            ]
        )
    weight = np.array(
        [
            weights.jerk,
            weights.safety,
            weights.offset,
            weights.speed,
            weights.headway,
            weights.consistency if cycle.has_last else 0.0,
            weights.heading,
            weights.dead_end,
        ]
    )
    terms *= weight / scale
    return terms, terms.sum(axis=1)


def _blocker_of_cheapest(
    bodies: Bodies,
    verdict: IntArray,
    blocker: IntArray,
    total: FloatArray,
) -> str | None:
    """Name what the cheapest candidate would hit; None if it is free."""
    drivable = np.flatnonzero((verdict == Check.PASSED) | (verdict == Check.COLLISION))
    if drivable.size == 0:
        return None
    cheapest = drivable[np.argmin(total[drivable])]
    if verdict[cheapest] == Check.PASSED:
        return None
    return bodies.ids[int(blocker[cheapest])]


def _fall_back(
    scene: Scene,
    settings: CruiseSettings,
    cycle: _Cycle,
    last: Trajectory | None,
    found: tuple[int, dict[str, int], str | None],
) -> PlanResult:
    """No candidate survived: go down the ladder and say why."""
    candidates, removed, blocking = found
    threshold = cycle.around.threshold
    line = _stop_line(scene) + TOLERANCE

    def blocker(trajectory: Trajectory) -> str | None:
        if trajectory.s[-1] + scene.vehicle.front_reach > line:
            return "stop line"
        points = np.array(
            [
                trajectory.x,
                trajectory.y,
                np.cos(trajectory.heading),
                np.sin(trajectory.heading),
            ]
        )[:, : cycle.bodies.poses.shape[2]]
        discs = _discs(scene, settings)
        gaps = gaps_to(points, cycle.bodies.poses, cycle.bodies.extents, *discs)
        hits = np.flatnonzero((gaps < threshold) & ~cycle.bodies.follower)
        return cycle.bodies.ids[int(hits[np.argmin(gaps[hits])])] if hits.size else None

    horizon = settings.horizon or max(settings.times)
    status, trajectory = fallback(scene, last, blocker, horizon)
    checks = ", ".join(f"{name} {n}" for name, n in removed.items())
    stats = PlanStats(
        reason=f"no candidate of {candidates} survived ({checks})",
        candidates=candidates,
        removed=removed,
        blocker=blocking or blocker(trajectory),
    )
    return PlanResult(status, trajectory, CruiseMemory(trajectory), stats)
