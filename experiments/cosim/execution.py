"""Between plan and truth: when a plan is made, from where, and who drives it.

The only place that knows of planning periods and delays, and of where a plan begins.
With a perfect plant, planning in every step and no delay, plans begin where the ego is
and the ego is where they say.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from experiments.cosim.plant import (
    START_TOLERANCE,
    PerfectTracking,
    Plant,
    check_motion,
    drivable_trajectory,
)
from experiments.cosim.plants.tracked import TrackedPlant
from experiments.cosim.records import PlanStart, PlanStartKind, TrackingReport
from planner.errors import OutsidePathDomainError
from planner.interface import PlanResult
from planner.numerics.angles import wrapped
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.states import CartesianState, FrenetState, Trajectory
from planner.tracking.reference import errors_against, plan_table

EPSILON = 1e-9  # [s]
TO_S = 1e-3  # from milliseconds


class StartRule(StrEnum):
    """Where a plan begins."""

    STITCHED = "stitched"  # on the last plan, unless the ego is far from it
    MEASURED = "measured"  # where the ego is


@dataclass(frozen=True, slots=True)
class PlanTiming:
    """When plans are made, take effect, and where they begin."""

    period: float | None = None  # between plans, the loop's step if None [s]
    delay: float | None = 0.0  # until one takes effect; None: what planning took [s]
    rule: StartRule = StartRule.STITCHED
    lateral: float = 0.5  # an ego farther beside its plan starts anew [m]
    longitudinal: float = 2.5  # and so does one farther before or behind it [m]


@dataclass(frozen=True, slots=True, eq=False)
class _TimedPlan:
    """A plan on the loop's clock."""

    trajectory: Trajectory
    begin: float  # time of its first point [s]
    effect: float  # from when on it is driven [s]


@dataclass(slots=True)
class PlanExecution:
    """Drives an ego along its plans, one episode long."""

    plant: Plant
    path: ReferencePath
    step: float  # of the loop [s]
    timing: PlanTiming
    _active: _TimedPlan | None = field(default=None, init=False)
    _waiting: list[_TimedPlan] = field(default_factory=list, init=False)
    _delay: float = field(default=0.0, init=False)  # of the next plan [s]

    def __post_init__(self) -> None:
        """Take the delay of the first plan that has one before it."""
        self._delay = self.timing.delay or 0.0

    @property
    def period(self) -> float:
        """Time between plans [s]."""
        return self.timing.period or self.step

    @property
    def report(self) -> TrackingReport | None:
        """How the plant followed its plan in the last step, if it has errors."""
        return self.plant.report if isinstance(self.plant, TrackedPlant) else None

    def start(
        self, index: int, time: float, ego: CartesianState, place: FrenetState
    ) -> PlanStart | None:
        """Return where a plan that is made now begins; None if none is made now.

        Args:
            index: Of the step.
            time: Now [s].
            ego: Where it really is.
            place: The same along the path.
        """
        here = PlanStart(PlanStartKind.EGO, ego, place, 0.0)
        if self._active is None:
            return here
        if index % max(round(self.period / self.step), 1):
            return None
        exact = isinstance(self.plant, PerfectTracking)
        if exact and self._delay == 0.0:
            return here
        latest = self._waiting[-1] if self._waiting else self._active
        begin = time + self._delay
        kind = PlanStartKind.STITCHED
        if not exact:
            if self.timing.rule is StartRule.MEASURED:
                kind = PlanStartKind.MEASURED
            elif self._is_far(time, ego):
                kind = PlanStartKind.ANEW
        on_plan = latest.trajectory.at(begin - latest.begin)
        state = on_plan if kind is PlanStartKind.STITCHED else self._ahead(ego)
        try:
            frenet = cartesian_to_frenet_one(self.path, state, place.s)
        except OutsidePathDomainError:
            return here
        return PlanStart(kind, state, frenet, self._delay)

    def accept(
        self, plan: PlanResult, start: PlanStart, time: float, took: float
    ) -> None:
        """Take over a plan.

        Args:
            plan: Made at `time`.
            start: Where it was to begin.
            time: Now [s].
            took: Wall clock of planning [ms].

        Raises:
            PlannerOutputError: If it cannot be driven.
        """
        tolerance = START_TOLERANCE
        if start.kind is PlanStartKind.ANEW:
            # a planner may go on with its last plan, which the vehicle can follow
            tolerance += math.hypot(self.timing.lateral, self.timing.longitudinal)
        reach = self.period + start.lead
        trajectory = drivable_trajectory(plan, start.state, reach, tolerance)
        begin = effect = time + start.lead
        if self.timing.delay is None:
            steps = math.ceil(took * TO_S / self.step - EPSILON)
            self._delay = steps * self.step
            effect = max(begin, time + self._delay)
        made = _TimedPlan(trajectory, begin, effect)
        if self._active is None:
            self._active = made
        else:
            self._waiting.append(made)

    def advance(self, time: float, ego: CartesianState) -> CartesianState:
        """Return the ego's state one step on.

        Raises:
            PlannerOutputError: If the plant has lost its plan, or the ego would jump.
        """
        while self._waiting and self._waiting[0].effect <= time + EPSILON:
            self._active = self._waiting.pop(0)
        active = self._active
        assert active is not None  # noqa: S101 - a plan was made in the first step
        at = time - active.begin
        at = 0.0 if abs(at) < EPSILON else at  # times are sums of steps
        after = self.plant.step(ego, active.trajectory, self.step, at)
        check_motion(ego, after, self.step)
        return after

    def _is_far(self, time: float, ego: CartesianState) -> bool:
        """Check whether the ego is too far from its plan to start on it."""
        active = self._active
        if active is None:
            return True
        lateral, behind, _, _ = errors_against(
            plan_table(active.trajectory),
            time - active.begin,
            (ego.x, ego.y, ego.heading),
        )
        timing = self.timing
        return abs(lateral) > timing.lateral or abs(behind) > timing.longitudinal

    def _ahead(self, ego: CartesianState) -> CartesianState:
        """Return where the ego will be when the plan takes effect, on its arc."""
        driven = max(ego.speed, 0.0) * self._delay
        turned = ego.curvature * driven
        return CartesianState(
            ego.x + driven * math.cos(ego.heading + 0.5 * turned),
            ego.y + driven * math.sin(ego.heading + 0.5 * turned),
            wrapped(ego.heading + turned),
            ego.curvature,
            ego.speed,
            ego.acceleration,
        )
