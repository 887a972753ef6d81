"""Planners of others as planners here: FOP, FOP+, FISS and FISS+ of `fiss-planner`.

Sun et al., RA-L 2022 and IROS 2023; Werling et al., ICRA 2010 for FOP. The package does
the planning; this adapter hands it the scene and says what it had to assume:

- They plan the centre of the body, whose heading is that of its course; here bodies are
  placed by their rear axle. The centre drives their plan exactly, the rear axle rolls
  behind it without slip (a tractrix).
- A plan begins on the plan before where the ego is on it, as in their own pipeline.
- A plan is held where it stands from where on the rear axle would roll backwards, or
  turn where it is: below 1 m/s they check no curvature.
- A closed stop line is a standing wall across the road behind the line.
- The speed is capped by the bends of the next seconds, as in their pipeline.
- Vehicles are predicted as the scenario says, the same for all planners.
- A road without lanes is one lane between its bounds. Lanes may be changed anywhere.
- Where they find nothing, the fallback of this project's planners drives: the last plan
  shifted, a stop, emergency braking.
- Their QP smoother is not used: the package offers it for its own maps only.
- FISS and FISS+ remember their last solution inside: a recorded cycle planned again may
  differ, an episode run again does not.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from experiments.api.peer_scene import bodies, corridor, speed_cap, vehicle_params
from experiments.errors import ConfigError
from planner.bodies import bodies_of
from planner.contact_check import Contact, contacts_of
from planner.fallback.ladder import HARD_GAP, fallback
from planner.fallback.last_plan import SAME_PLACE, SAME_SPEED
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.scene import Scene
from planner.states import FloatArray, Trajectory
from planner.vehicle import centre_from_rear_axle

SPACING = 1.0  # of the reference line's points [m]
LEAST_ROLL = 0.2  # of the rear axle over the way of the centre; cos of 78 degrees
STOP_HORIZON = 5.0  # of a fallback that stops [s]


@dataclass(slots=True)
class _Memory:
    """What one episode keeps: their planner, the line, and the last plan."""

    planner: Any
    path: ReferencePath
    line: Any
    native: Any = None  # their last trajectory, None after a fallback
    driven: Trajectory | None = None


@dataclass(frozen=True, slots=True)
class PeerPlanner:
    """A planner of `fiss-planner`."""

    kind: str  # fop, fop_plus, fiss, fiss_plus
    sampling: dict[str, int] = field(default_factory=dict)

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle."""
        import fiss_planner as fp

        kept = memory if isinstance(memory, _Memory) else None
        if kept is None or kept.path is not scene.path:
            kept = self._begin(scene)
        start = _start(scene, kept)
        found = kept.planner.plan(
            start,
            kept.line,
            corridor(scene),
            bodies(scene),
            target_speed=speed_cap(scene),
        )
        counts = {
            str(key).rpartition(".")[2].lower(): int(value)
            for key, value in dict(found.stats.rejections).items()
            if key != fp.Rejection.OK and value
        }
        generated = int(found.stats.num_generated)
        if not found.success:
            return _fall_back(scene, kept, generated, counts)
        plan, stands = _from_centre(scene, found.trajectory)
        cost = found.trajectory.cost
        names = (
            "accel",
            "jerk",
            "lane_change",
            "lateral",
            "proximity",
            "speed",
            "time",
        )
        stats = PlanStats(
            candidates=generated,
            survivors=None,
            removed=counts,
            costs={name: float(getattr(cost, name)) for name in names},
        )
        goes_on = found.trajectory if stands > 1 else None
        after = _Memory(kept.planner, kept.path, kept.line, goes_on, plan)
        return PlanResult(PlanStatus.OK, plan, after, stats)

    def _begin(self, scene: Scene) -> _Memory:
        """Make their planner and line, once an episode."""
        import fiss_planner as fp

        config = fp.make_config(self.kind, **self.sampling, dt=scene.step)
        s = np.arange(0.0, scene.path.length, SPACING)
        points = scene.path.at(s)
        line = fp.ReferenceLine(points.x, points.y, SPACING)
        planner = fp.make_planner(config, vehicle_params(scene.vehicle))
        return _Memory(planner, scene.path, line)


def _start(scene: Scene, kept: _Memory) -> Any:
    """Return where their plan begins: on the last one if the ego is on it."""
    import fiss_planner as fp

    ego = scene.ego
    x, y = centre_from_rear_axle(ego, scene.vehicle)
    if kept.native is not None:
        here = kept.native.cartesian_state_at(1)
        near = math.hypot(here.x - x, here.y - y) <= SAME_PLACE
        if near and abs(here.v - ego.speed) <= SAME_SPEED:
            return kept.native.frenet_state_at(1)
    # the centre moves askew of the body, faster and on a wider arc than the rear axle
    slip = math.atan(scene.vehicle.centre_offset * ego.curvature)
    state = fp.EgoState(
        x,
        y,
        ego.heading + slip,
        ego.speed / math.cos(slip),
        ego.acceleration / math.cos(slip),
        ego.curvature * math.cos(slip),
    )
    return kept.line.to_frenet(state, scene.ego_frenet.s)


def _from_centre(scene: Scene, native: Any) -> tuple[Trajectory, int]:
    """Let the rear axle follow a plan of the centre, until it would turn where it is.

    Returns:
        The trajectory, and the index from which on it is held where it stands; the
        number of its points if never. Polynomials that end standing may swing through
        a negative speed, and slow ones lead the point sideways and back.
    """
    x, y = np.asarray(native.x), np.asarray(native.y)
    offset = scene.vehicle.centre_offset
    heading, askew = towed(x, y, scene.ego.heading, offset)
    dx, dy = np.diff(x), np.diff(y)
    rolled = dx * np.cos(heading[:-1]) + dy * np.sin(heading[:-1])
    back = np.flatnonzero(rolled < LEAST_ROLL * np.hypot(dx, dy))
    stands = int(back[0]) if back.size else x.size
    order = np.minimum(np.arange(x.size), stands)
    moving = np.arange(x.size) < stands
    # of the pieces on both sides of a point the next one may turn where it is
    askew = np.clip(askew, -math.acos(LEAST_ROLL), math.acos(LEAST_ROLL))
    heading, askew = heading[order], np.where(moving, askew[order], 0.0)
    x, y = x[order] - offset * np.cos(heading), y[order] - offset * np.sin(heading)
    s, l = scene.path.project(x, y, near=np.asarray(native.s)[order] - offset)
    t = np.asarray(native.t)
    speed = np.maximum(np.asarray(native.v), 0.0) * np.cos(askew)
    trajectory = Trajectory(
        t - t[0],
        x,
        y,
        heading,
        np.tan(askew) / offset,
        np.where(moving, speed, 0.0),
        np.where(moving, np.asarray(native.a) * np.cos(askew), 0.0),
        s,
        l,
    )
    return trajectory, stands


def towed(
    x: FloatArray, y: FloatArray, heading: float, offset: float
) -> tuple[FloatArray, FloatArray]:
    """Return how a body turns whose front point is led along a line.

    Its rear axle rolls without slip: θ' = sin(χ - θ) / offset a metre, for the course χ
    of the line. On a straight piece of length d this is tan((χ - θ)/2) shrinking by
    exp(-d / offset).

    Args:
        x: Of the led point, (n,) [m].
        y: The same.
        heading: Of the body at the first point [rad].
        offset: From the rear axle to the led point, more than 0 [m].

    Returns:
        Heading, and the angle from it to the course, at each point, (n,) [rad].
    """
    dx, dy = np.diff(x), np.diff(y)
    length, course = np.hypot(dx, dy), np.arctan2(dy, dx)
    shrinks = np.exp(-length / offset)
    headings = np.full(x.size, float(heading))
    for k in range(length.size):
        headings[k + 1] = headings[k]
        if length[k] > 0.0:
            apart = math.remainder(course[k] - headings[k], 2.0 * math.pi)
            left = 2.0 * math.atan(math.tan(0.5 * apart) * shrinks[k])
            headings[k + 1] += apart - left
    # the rate of turning over the way, from the pieces on both sides of a point
    turned = np.concatenate(((0.0,), np.diff(headings)))
    way = np.concatenate(((0.0,), length))
    both, over = turned.copy(), way.copy()
    both[:-1] += turned[1:]
    over[:-1] += way[1:]
    rate = np.divide(both, over, out=np.zeros_like(both), where=over > 0.0)
    return headings, np.arcsin(np.clip(offset * rate, -1.0, 1.0))


def _fall_back(
    scene: Scene, kept: _Memory, generated: int, removed: dict[str, int]
) -> PlanResult:
    """Drive the fallback of this project's planners."""
    ahead = scene.vehicles.prediction
    bodies = bodies_of(scene, max(ahead.x.shape[1], 1), ahead.step)
    none = np.zeros(len(bodies.ids), dtype=np.bool_)

    def contacts(trajectory: Trajectory, margin: float) -> tuple[Contact, ...]:
        return contacts_of(trajectory, scene.vehicle, bodies, none, margin)

    def blocker(trajectory: Trajectory) -> str | None:
        hits = contacts(trajectory, HARD_GAP)
        return hits[0].id if hits else None

    status, plan = fallback(scene, kept.driven, blocker, STOP_HORIZON, contacts)
    stats = PlanStats(
        reason=f"none of {generated} candidates is allowed",
        candidates=generated,
        removed=removed,
        blocker=blocker(plan),
    )
    after = _Memory(kept.planner, kept.path, kept.line, None, plan)
    return PlanResult(status, plan, after, stats)


def _make(kind: str, **sampling: int) -> PeerPlanner:
    """Make a planner; raises ConfigError without the package."""
    try:
        import fiss_planner  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            f"{kind} needs fiss-planner ({error}); install it: pip install "
            "fiss-planner==1.0.0"
        ) from error
    return PeerPlanner(kind, sampling)


def fop(num_width: int = 5, num_speed: int = 5, num_t: int = 5) -> PeerPlanner:
    """Make FOP: every candidate, the cheapest that is allowed.

    Args:
        num_width: End states across a lane.
        num_speed: End speeds.
        num_t: Durations.
    """
    return _make("fop", num_width=num_width, num_speed=num_speed, num_t=num_t)


def fop_plus(num_width: int = 5, num_speed: int = 5, num_t: int = 5) -> PeerPlanner:
    """Make FOP+: the same, checked in the order of cost; arguments as for `fop`."""
    return _make("fop_plus", num_width=num_width, num_speed=num_speed, num_t=num_t)


def fiss(num_width: int = 5, num_speed: int = 5, num_t: int = 5) -> PeerPlanner:
    """Make FISS: iterative search from the last solution; arguments as for `fop`."""
    return _make("fiss", num_width=num_width, num_speed=num_speed, num_t=num_t)


def fiss_plus(num_width: int = 5, num_speed: int = 5, num_t: int = 5) -> PeerPlanner:
    """Make FISS+: best first, with refined end states; arguments as for `fop`."""
    return _make("fiss_plus", num_width=num_width, num_speed=num_speed, num_t=num_t)
