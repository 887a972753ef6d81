"""The arrays that one cycle evaluates: profiles, road, limits and bodies."""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.bodies import Bodies, BodyTable, Leader, bodies_of, leader_of
from planner.cruise.candidate_motion import (
    Lateral,
    RoadTables,
)
from planner.cruise.evaluation import CycleTables
from planner.cruise.feasibility import (
    TOLERANCE,
    CandidateLimits,
    RoadBend,
    RoadBody,
    road_excess,
)
from planner.cruise.sampling.lateral import (
    full_grid_size,
    lane_term,
    lateral_room,
    terminal_offsets,
)
from planner.cruise.sampling.longitudinal import (
    EMPTY,
    STANDING,
    longitudinal_profiles,
)
from planner.cruise.sampling.reference_speed import reference_speed
from planner.cruise.settings import ComfortLimits, CruiseSettings, LateralMotion
from planner.cruise.workspace import FollowingRules, Surroundings
from planner.numerics.compiled import compiled
from planner.reference_path.linear_curvature import CURVATURE, RATE, S
from planner.reference_path.road_turn import (
    RoadTurn,
    circle_to,
    circles_to,
    turn_between,
    turn_of_pieces,
)
from planner.scene import OFF_ROAD_TOLERANCE, Scene
from planner.shapes.disc_clearance import segment_to_rectangle
from planner.states import CartesianState, FloatArray, Trajectory
from planner.vehicle import Vehicle, body_scale

LONG = 1.5  # times as long as a car, a body is led by its front [-]
QUEUE_GAP = 1.0  # from the line behind a waiting vehicle to its rear [m]
DISC_EXCESS = 0.3  # by which the discs may reach beyond the sides of a long body [m]
NO_DISCS = np.zeros(0)  # not frozen, as others: one type, one kernel
# By which a gap below the margin may still shrink in a cycle: rounding, no more, or an
# ego that stands would creep into contact [m].
TOUCH_TOLERANCE = 1e-6
# A vehicle that stands can turn its wheels before it starts: its motions need not
# begin with the curvature that it stopped with, which may leave none within the limits.
WHEELS_TURN_FREELY = 0.02  # [m/s]
START_SHARE = 0.8  # of the largest curvature, to which wheels are turned there [-]
WHEEL_SHARES = (0.5, 0.75)  # of that, which are tried to either side [-]
# The road's turn is taken that much farther than the body gets [m].
BEHIND, BEYOND = 1.0, 40.0


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Everything that one cycle's evaluation reads."""

    bodies: Bodies
    tables: CycleTables
    scale: float  # of lateral motions, against those of a car [-]
    off_road: int  # candidates left out because the road is narrower than the grid
    last: Trajectory | None
    leader: Leader | None

    @classmethod
    def of(
        cls, scene: Scene, settings: CruiseSettings, last: Trajectory | None
    ) -> "Cycle":
        """Sample the profiles and collect the arrays of the scene."""
        bodies = bodies_of(scene, settings.n_steps, settings.step)
        leader = leader_of(scene, bodies)
        if scene.stop_lines and leader is not None:
            scene = _behind_queue(scene, bodies, leader)
        speed_ahead = reference_speed(scene, settings)
        profiles = longitudinal_profiles(scene, settings, speed_ahead, leader)
        ego = scene.ego_frenet
        whole_body = settings.cover_discs > 1
        turn, circles = _turn_ahead(scene, profiles.farthest, whole_body=whole_body)
        limits = _limits(scene, settings, turn)
        offsets = terminal_offsets(
            scene.road, (ego.s, profiles.farthest), limits.half_width, settings
        )
        lateral, scale = _lateral(scene, settings, offsets)
        table, road = scene.path.table, scene.road
        ground = RoadTables(
            table.knots,
            table.bins,
            road.s,
            road.left,
            road.right,
            EMPTY if last is None else last.s,
            EMPTY if last is None else last.l,
            scene.vehicle.front_reach,
            turn,
            circles,
        )
        return cls(
            bodies,
            CycleTables(
                profiles.tracks,
                lateral,
                limits,
                ground,
                _surroundings(scene, settings, bodies),
                profiles.speed_term,
                lane_term(scene, offsets),
            ),
            scale,
            profiles.speed_term.size * max(full_grid_size(settings) - offsets.size, 0),
            last,
            leader,
        )

    def gentle(self, ego: CartesianState, comfort: ComfortLimits) -> "Cycle":
        """Return the same cycle within the limits of comfort.

        Limits that the ego exceeds already, for example after a fallback, are its
        present values.
        """
        limits, tables = self.tables.limits, self.tables
        sideways = max(comfort.lateral_acceleration, ego.speed**2 * abs(ego.curvature))
        deceleration = max(comfort.deceleration, -ego.acceleration)
        closer = limits._replace(
            lateral_acceleration=min(limits.lateral_acceleration, sideways + TOLERANCE),
            deceleration=min(limits.deceleration, deceleration + TOLERANCE),
            jerk=comfort.jerk,
            sideways_change=comfort.lateral_jerk * tables.lateral.step,
        )
        return self._with(tables._replace(limits=closer))

    def starting(
        self, length: float, excess: float, bend: float | None = None
    ) -> "Cycle":
        """Return the same cycle for an ego that has to get out of where it stands.

        Args:
            length: Of its lateral motions, at least [m].
            excess: How far they may reach over the edge less its margin, at least [m].
            bend: Curvature beside the road's to which it turns its wheels before it
                moves off; as it is without one [1/m].
        """
        tables = self.tables
        lateral = tables.lateral._replace(min_length=length)
        if bend is not None:
            lateral = lateral._replace(start=(*lateral.start[:2], bend))
        limits = tables.limits._replace(excess=max(tables.limits.excess, excess))
        return self._with(tables._replace(lateral=lateral, limits=limits))

    def _with(self, tables: CycleTables) -> "Cycle":
        """Return the same cycle with other tables."""
        return replace(self, tables=tables)


def _lateral(
    scene: Scene, settings: CruiseSettings, offsets: FloatArray
) -> tuple[Lateral, float]:
    """Return the lateral samples, and the scale of their lengths."""
    ego = scene.ego_frenet
    over_time = settings.lateral_motion is LateralMotion.TIME
    lead = led_point(scene.vehicle, settings)
    scale = 1.0 if lead > 0.0 else body_scale(scene.vehicle)
    first, second = (
        (ego.l_dot, ego.l_ddot) if over_time else (ego.l_prime, ego.l_second)
    )
    if scene.ego.speed < WHEELS_TURN_FREELY:
        road = float(scene.path.at(np.array([ego.s])).curvature[0])
        second = _wheels_turned(first, lead, scene.vehicle, road)
    lateral = Lateral(
        over_time,
        (ego.l, first, second),
        offsets,
        settings.min_manoeuvre_length,
        settings.min_manoeuvre_speed * scale,
        settings.step,
        lead,
    )
    return lateral, scale


def led_point(vehicle: Vehicle, settings: CruiseSettings) -> float:
    """Return how far ahead of its axle a body is led [m]; 0 at the axle itself.

    The front of a long body goes farther to the side than its axle while it turns, over
    the road's edge beside what it goes round. It is led by its front axle, as its
    driver leads it, and the rear axle comes after.
    """
    over_distance = settings.lateral_motion is LateralMotion.DISTANCE
    leads = settings.lead_long_bodies and over_distance and settings.cover_discs > 1
    return vehicle.wheelbase if leads and body_scale(vehicle) > LONG else 0.0


def turning_scale(vehicle: Vehicle, settings: CruiseSettings) -> float:
    """Return how much more room than a car a body needs to steer round what stands."""
    scale = body_scale(vehicle)
    return math.sqrt(scale) if led_point(vehicle, settings) > 0.0 else scale


def _wheels_turned(slope: float, lead: float, vehicle: Vehicle, road: float) -> float:
    """Return l'' of an ego that stands: its wheels are turned before it moves off.

    Along the road, or so that the led point goes along it from there on, as far as the
    wheels turn beside the curvature of the `road` [1/m].
    """
    if lead == 0.0:
        return 0.0
    low, high = _wheels_within(vehicle, road)
    return min(max(-slope / lead, low), high)


def _wheels_within(vehicle: Vehicle, road: float) -> tuple[float, float]:
    """How far wheels turn to the right and left, beside the road's curvature [1/m]."""
    most = START_SHARE * vehicle.limits.max_curvature
    return min(-most - road, 0.0), max(most - road, 0.0)


def wheels_turned(scene: Scene) -> tuple[float, ...]:
    """Return curvatures beside the road's to turn the wheels to before moving off.

    An ego that stands askew where the road swings may have to steer out before it turns
    in, as a driver does who turns the wheel while standing.

    Returns:
        The smaller ones first [1/m]; none unless the ego stands.
    """
    if scene.ego.speed >= WHEELS_TURN_FREELY:
        return ()
    road = float(scene.path.at(np.array([scene.ego_frenet.s])).curvature[0])
    right, left = _wheels_within(scene.vehicle, road)
    return tuple(share * side for share in WHEEL_SHARES for side in (left, right))


def _behind_queue(scene: Scene, bodies: Bodies, leader: Leader) -> Scene:
    """Let the ego wait behind the vehicle ahead that waits at the closed line.

    It may not go to the line beside those who wait there: its own line is behind them.
    """
    body = bodies.ids.index(leader.id)
    rear = float(leader.s[0])
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    waits = body >= bodies.table.n_static and bodies.table.speed[body] <= STANDING
    if not waits or not front < rear < min(scene.stop_lines):
        return scene
    return replace(scene, stop_lines=(max(rear - QUEUE_GAP, front), *scene.stop_lines))


def _turn_ahead(
    scene: Scene, farthest: float, *, whole_body: bool
) -> tuple[RoadTurn, FloatArray]:
    """Integrate the road's curvature from behind the ego to beyond its plans.

    Returns:
        The integrals; circles to the body's front and rear at their points, (2, n)
        [1/m], see `RoadBend`.
    """
    knots, vehicle = scene.path.table.knots, scene.vehicle
    begin = scene.ego_frenet.s - vehicle.rear_overhang - BEHIND
    end = farthest + vehicle.front_reach + BEYOND
    points = np.array((vehicle.front_reach, -vehicle.rear_overhang))
    return _circles_between(knots, (begin, end), points if whole_body else 0.0 * points)


@compiled
def _circles_between(
    knots: FloatArray, between: tuple[float, float], points: FloatArray
) -> tuple[RoadTurn, FloatArray]:
    """Compute what `_turn_ahead` returns, from the knots of the path."""
    s = knots[:, S]
    first = max(int(np.searchsorted(s, between[0])) - 1, 0)
    last = min(int(np.searchsorted(s, between[1])) + 1, s.size)
    rows = knots[first:last]
    at, curvature, rate = rows[:, S].copy(), rows[:, CURVATURE], rows[:, RATE]
    if not curvature.any() and not rate.any():  # two points are enough
        at = at[:: max(at.size - 1, 1)].copy()
        turn = RoadTurn(at, np.zeros((at.size, 4)))
        return turn, np.zeros((points.size, at.size))
    turn = turn_of_pieces(at, curvature, rate)
    circles, _ = circles_to(at, points, turn)
    return turn, circles


def _limits(scene: Scene, settings: CruiseSettings, turn: RoadTurn) -> CandidateLimits:
    """CandidateLimits of this cycle.

    Where the ego already exceeds a limit, for example after a fallback, the limit is
    its present value, so that a way back remains.
    """
    vehicle, own, ego = scene.vehicle, scene.vehicle.limits, scene.ego
    whole_body = settings.cover_discs > 1
    deceleration = settings.max_deceleration or own.max_deceleration
    lateral = settings.max_lateral_acceleration or own.max_lateral_acceleration
    front = vehicle.front_reach if whole_body else 0.0
    rear = vehicle.rear_overhang if whole_body else 0.0
    half_width = vehicle.width / 2.0 + settings.road_margin
    at, road = scene.ego_frenet, scene.road
    excess = _excess_now(
        (at.s, at.l, at.l_prime),
        turn,
        (road.s, road.left, road.right),
        (front, rear, half_width),
    )
    return CandidateLimits(
        max(own.max_acceleration, ego.acceleration) + TOLERANCE,
        max(deceleration, -ego.acceleration) + TOLERANCE,
        max(lateral, ego.speed**2 * abs(ego.curvature)) + TOLERANCE,
        max(settings.max_curvature or own.max_curvature, abs(ego.curvature))
        + TOLERANCE,
        front,
        rear,
        half_width,
        _allowed_excess(excess, settings.road_margin),
        np.inf,
        np.inf,
    )


@compiled
def _excess_now(
    ego: tuple[float, float, float],
    turn: RoadTurn,
    road: tuple[FloatArray, FloatArray, FloatArray],
    body: tuple[float, float, float],
) -> float:
    """How far the ego reaches over the road's edge now; negative inside [m].

    Args:
        ego: s, l and dl/ds.
        turn: Of the road.
        road: Arc lengths, left and right bounds, (n,) [m].
        body: To its front and rear from the axle, and half its width [m].
    """
    s, l, slope = ego
    front, rear, half_width = body
    _, _, curvature = turn_between(s, turn)
    ahead, behind = circle_to(s, front, turn)[0], circle_to(s, -rear, turn)[0]
    error = math.atan2(slope, 1.0 - curvature * l)
    right, left = lateral_room(road, (s, s))
    cos, sin = math.cos(error), math.sin(error)
    return road_excess(
        l,
        cos,
        sin,
        RoadBend(ahead, curvature, behind),
        left,
        right,
        RoadBody(front, rear, half_width),
    )


def _allowed_excess(excess: float, road_margin: float) -> float:
    """How far a candidate may reach over the edge less its margin [m].

    Near the edge half of the margin that is left may be used, so that cycle after cycle
    never takes more than all of it: the tail of a vehicle that turns away from the edge
    swings out before the vehicle moves in. A body that is over the edge itself gets the
    margin once more for its way back.
    """
    if excess < -road_margin:
        return TOLERANCE
    over = 2.0 * (excess - road_margin) / OFF_ROAD_TOLERANCE - 1.0
    if over > 0.0:  # by more than rounding
        return excess + road_margin * min(over, 1.0)
    used = max(excess, 0.0)
    return max(used, 0.5 * (used + road_margin) + TOLERANCE)


def disc_cover(
    scene: Scene, settings: CruiseSettings
) -> tuple[tuple[float, float, float], FloatArray, float]:
    """Discs that cover the ego: their centres from the rear axle, and their radius.

    Returns:
        Three of them, the first and the last one included, rear first; the others,
        (n,); their radius [m]. A single disc is repeated three times.
    """
    if settings.cover_discs == 1:
        return (0.0, 0.0, 0.0), NO_DISCS, settings.single_disc_radius
    vehicle = scene.vehicle
    if vehicle.disc_radius - vehicle.width / 2.0 <= DISC_EXCESS:
        return vehicle.disc_offsets, NO_DISCS, vehicle.disc_radius
    centres, radius = vehicle.disc_cover(DISC_EXCESS)
    three = float(centres[0]), float(centres[1]), float(centres[-1])
    return three, centres[2:-1].copy(), radius


@compiled
def _thresholds(
    ego: tuple[float, float, float],
    discs: tuple[float, float, float],
    disc_radius: float,
    poses: FloatArray,
    extents: FloatArray,
    margin: float,
) -> FloatArray:
    """Required gap to each body, capped at the present gap so that an escape remains.

    The present gap is measured from a capsule about the discs: from three discs it
    would shrink and grow while the ego drives straight past a body.
    """
    cos, sin = math.cos(ego[2]), math.sin(ego[2])
    out = np.full(poses.shape[0], margin)
    ends = np.empty((2, 2))  # of the capsule's axis in a body's frame
    for b in range(out.size):
        half_length, half_width, radius = extents[b, 0], extents[b, 1], extents[b, 2]
        grown = radius + disc_radius
        for k, disc in enumerate((discs[0], discs[2])):
            dx = ego[0] + disc * cos - poses[b, 0, 0]
            dy = ego[1] + disc * sin - poses[b, 1, 0]
            ends[k, 0] = dx * poses[b, 2, 0] + dy * poses[b, 3, 0]
            ends[k, 1] = dy * poses[b, 2, 0] - dx * poses[b, 3, 0]
        reach = abs(discs[2] - discs[0]) + half_length + half_width + grown + margin
        if abs(ends[0, 0]) + abs(ends[0, 1]) > 2.0 * reach:
            continue
        apart = segment_to_rectangle(
            ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1], half_length, half_width
        )
        out[b] = min(margin, apart - grown - TOUCH_TOLERANCE)
    return out


def _surroundings(
    scene: Scene, settings: CruiseSettings, bodies: Bodies
) -> Surroundings:
    """Collect the bodies and the rules of following them."""
    vehicle, table = scene.vehicle, bodies.table
    discs, more_discs, disc_radius = disc_cover(scene, settings)
    threshold = _thresholds(
        (scene.ego.x, scene.ego.y, scene.ego.heading),
        discs,
        disc_radius,
        table.poses,
        table.extents,
        settings.margin,
    )
    turn_gap = _turn_gaps(
        table,
        settings.obstacle_gap * turning_scale(vehicle, settings),
        settings.standstill_gap * turning_scale(vehicle, settings),
        (scene.ego_frenet.s, max(scene.stop_lines, default=-np.inf)),
    )
    rules = FollowingRules(
        discs,
        disc_radius,
        settings.scales.clearance,
        disc_radius + settings.margin,
        vehicle.front_reach,
        vehicle.rear_overhang,
        vehicle.limits.max_deceleration,
        settings.standstill_gap,
        settings.time_headway,
        settings.rear_time_headway,
    )
    return Surroundings(*table, threshold, turn_gap, more_discs, *rules)


@compiled
def _turn_gaps(
    table: BodyTable,
    obstacle_gap: float,
    standstill_gap: float,
    queue: tuple[float, float],
) -> FloatArray:
    """Room that the ego keeps to what stands ahead, 0 for what moves, (n,) [m].

    What stands in `queue`, from the ego to the closed line ahead, waits there and will
    move: one does not drive round it but stands behind it.
    """
    gaps = np.zeros(table.speed.size)
    for b in range(gaps.size):
        if b >= table.n_static and queue[0] < table.s[b, 0] < queue[1]:
            continue
        if not table.follower[b] and table.speed[b] <= STANDING:
            gaps[b] = obstacle_gap if b < table.n_static else standstill_gap
    return gaps
