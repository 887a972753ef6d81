"""A reference driver as a planner: it holds its speed and brakes along the path."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.reference_drivers.careful_human import CarefulHuman
from planner.reference_drivers.driver import (
    DriverState,
    ReferenceDriver,
    attentive,
    react,
)
from planner.reference_drivers.fuzzy_safety import FuzzySafety
from planner.reference_drivers.regulation_157 import Regulation157
from planner.reference_drivers.rss import ResponsibilitySensitiveSafety
from planner.reference_drivers.situation import ConflictState
from planner.reference_path.frenet import frenet_to_cartesian
from planner.scene import Scene
from planner.scene_checks import invalid
from planner.states import FrenetStates, Trajectory

HORIZON = 5.0  # of the trajectories [s]


class _Body(NamedTuple):
    """Another body along the ego's path, now."""

    id: str
    s: float  # centre [m]
    l: float
    speed: float  # along the path, 0 if it drives against it [m/s]
    acceleration: float
    lateral_speed: float  # positive to the left [m/s]
    length: float
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class BrakingMemory:
    """What the driver remembers of each body, by its id."""

    states: Mapping[str, DriverState] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class BrakingPlanner:
    """Holds speed and offset, and brakes as the driver model does; `plan` is pure.

    Positions advance with the speed at the end of each step, as in the published
    implementation, so that one conflict ends as in a batch of them. The hardest
    braking for any body counts. A driver who finds a body uncritical goes on looking
    at it; braking ends once the gap no longer closes.
    """

    driver: ReferenceDriver

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        before = memory.states if isinstance(memory, BrakingMemory) else {}
        states: dict[str, DriverState] = {}
        hardest, cause = 0.0, None
        for body in _bodies(scene):
            situation = _situation(scene, body)
            if situation is None:
                continue
            state = before.get(body.id) or attentive(1)
            state = react(self.driver, situation, state, scene.step)
            if state.deceleration[0] > hardest:
                hardest, cause = float(state.deceleration[0]), body.id
            if situation.closing_speed[0] <= 0.0 and body.acceleration >= 0.0:
                state = attentive(1)
            looking = np.zeros(1, dtype=np.bool_)
            states[body.id] = replace(state, dismissed=looking)
        stats = PlanStats(blocker=cause, candidates=1, survivors=1)
        trajectory = _braking(scene, hardest)
        return PlanResult(PlanStatus.OK, trajectory, BrakingMemory(states), stats)


def careful_human(settings: CarefulHuman | None = None) -> BrakingPlanner:
    """Make the competent and careful human driver."""
    return BrakingPlanner(settings or CarefulHuman())


def regulation_157(settings: Regulation157 | None = None) -> BrakingPlanner:
    """Make the driver of the regulation's formula for cut-ins."""
    return BrakingPlanner(settings or Regulation157())


def rss(settings: ResponsibilitySensitiveSafety | None = None) -> BrakingPlanner:
    """Make the driver that keeps the distances of RSS."""
    return BrakingPlanner(settings or ResponsibilitySensitiveSafety())


def fuzzy_safety(settings: FuzzySafety | None = None) -> BrakingPlanner:
    """Make the driver of the fuzzy safety model."""
    return BrakingPlanner(settings or FuzzySafety())


def _bodies(scene: Scene) -> list[_Body]:
    """Collect the bodies that have a place on the path."""
    users, ahead = scene.vehicles, scene.vehicles.prediction
    on_path = np.isfinite(ahead.s[:, 0])
    point = scene.path.at(np.where(on_path, ahead.s[:, 0], 0.0))
    along = np.cos(users.heading - point.heading)
    found = [
        _Body(
            users.ids[i],
            float(ahead.s[i, 0]),
            float(ahead.l[i, 0]),
            max(float(along[i] * users.speed[i]), 0.0),
            float(users.acceleration[i]),
            float(np.sign(along[i]) * users.lateral_speed[i]),
            float(users.length[i]),
            float(users.width[i]),
        )
        for i in np.flatnonzero(on_path)
    ]
    fixed = scene.obstacles
    if fixed.ids:
        s, l = scene.path.project(fixed.x, fixed.y)
        length, width = (
            (side + 2.0 * fixed.radius).tolist() for side in (fixed.length, fixed.width)
        )
        found.extend(
            _Body(name, float(s[i]), float(l[i]), 0.0, 0.0, 0.0, length[i], width[i])
            for i, name in enumerate(fixed.ids)
        )
    return found


def _situation(scene: Scene, body: _Body) -> ConflictState | None:
    """Return what the driver sees of a body; None once the ego has passed it."""
    ego, vehicle = scene.ego_frenet, scene.vehicle
    gap = body.s - 0.5 * body.length - (ego.s + vehicle.front_reach)
    if gap <= -(vehicle.length + body.length):
        return None
    offset = body.l - ego.l
    towards = -body.lateral_speed if offset > 0.0 else body.lateral_speed
    return ConflictState(
        np.array([gap]),
        np.array([abs(offset) - 0.5 * (vehicle.width + body.width)]),
        np.array([max(towards, 0.0)]),
        np.array([scene.ego.speed]),
        np.array([body.speed]),
        vehicle.length,
        body.length,
        min(vehicle.width, body.width),
    )


def _braking(scene: Scene, deceleration: float) -> Trajectory:
    """Return the motion along the path with an even deceleration [m/s²]."""
    ego, step = scene.ego_frenet, scene.step
    t = step * np.arange(max(round(HORIZON / step), 1) + 1, dtype=np.float64)
    speed = np.empty_like(t)
    driven = np.zeros_like(t)
    speed[0] = scene.ego.speed
    for k in range(t.size - 1):
        speed[k + 1] = max(speed[k] - deceleration * step, 0.0)
        driven[k + 1] = driven[k] + speed[k + 1] * step
    here = scene.path.at(np.array([ego.s])).curvature[0]
    stretch = max(1.0 - float(here) * ego.l, 1e-3)
    none, offset = np.zeros_like(t), np.full_like(t, ego.l)
    s = ego.s + driven / stretch
    states = FrenetStates(s, speed / stretch, none, offset, none, none, none, none)
    plane = frenet_to_cartesian(scene.path, states)
    return Trajectory(
        t,
        plane.x,
        plane.y,
        plane.heading,
        plane.curvature,
        speed,
        np.where(speed > 0.0, -deceleration, 0.0),
        s,
        offset,
    )
