"""What one cycle evaluates: profiles, road, limits and bodies put into arrays."""

import math
from dataclasses import dataclass

import numpy as np

from planner.bodies import Bodies, bodies_of, leader_of
from planner.cruise import costs, sampling
from planner.cruise.evaluation import Surroundings
from planner.cruise.feasibility import TOLERANCE, Check, Limits, road_excess
from planner.cruise.headway import headway_pairs
from planner.cruise.motion import (
    KAPPA,
    LAST_L,
    N_ROWS,
    S_DOT,
    Lateral,
    S,
    Tracks,
    X,
    Y,
    candidate_motion,
    lay_road,
)
from planner.cruise.settings import CruiseSettings, LateralMotion
from planner.geometry.clearance import gaps_to, near_spans
from planner.scene import Scene
from planner.states import FloatArray, Trajectory

CAPSULE_DISCS = 33  # 0.1 m apart: their hull waves by less than the tolerance
TOUCH_TOLERANCE = 2e-3  # by which a gap below the margin may still shrink [m]
SWERVE = 1.5  # driven way over the way along the ego's offset, 48 degrees askew [-]
SWERVE_TURN = 0.5  # what turning adds to it in one step [m]
STANDING = 0.5  # a slower vehicle is one to steer round [m/s]
REVERSE_TOLERANCE = 0.02  # rounding of profiles that end in a stand [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
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
    ) -> "Cycle":
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


def front_limit(scene: Scene) -> float:
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
    line = front_limit(scene)
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


def disc_cover(scene: Scene, settings: CruiseSettings) -> tuple[FloatArray, float]:
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
    discs, radius = disc_cover(scene, settings)
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
    discs, disc_radius = disc_cover(scene, settings)
    widest = float(np.abs(offsets).max(initial=abs(scene.ego_frenet.l)))
    reach = widest + 0.5 + disc_radius + float(np.abs(discs).max())
    fastest = float(tracks.rows[:, S_DOT].max(initial=0.0))
    stretch = 1.0 + widest * float(np.abs(tracks.rows[:, KAPPA]).max(initial=0.0))
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
        settings.step * (SWERVE * stretch * fastest + bodies.speed) + SWERVE_TURN,
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
