"""The arrays that one cycle evaluates: profiles, road, limits and bodies."""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.bodies import Bodies, Leader, bodies_of, leader_of
from planner.cruise.candidate_motion import (
    Lateral,
    RoadTables,
)
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
from planner.cruise.steering import (
    WHEELS_TURN_FREELY,
    led_point,
    wheels_before_start,
)
from planner.cruise.surroundings import surroundings_of
from planner.cruise.workspace import CycleTables
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
from planner.states import CartesianState, FloatArray, Trajectory
from planner.vehicle import body_scale

QUEUE_GAP = 1.0  # from the line behind a waiting vehicle to its rear [m]
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
                surroundings_of(scene, settings, bodies),
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
        second = wheels_before_start(first, lead, scene.vehicle, road)
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
