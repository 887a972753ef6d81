"""The contract between a planner and its caller."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, runtime_checkable

from planner.scene import Scene
from planner.states import FloatArray, Trajectory


class PlanStatus(StrEnum):
    """Outcome of one planning cycle; every value but OK is an expected failure."""

    OK = "ok"
    LAST_PLAN_SHIFTED = "last_plan_shifted"
    FULL_STOP = "full_stop"
    EMERGENCY_BRAKING = "emergency_braking"
    EVASION = "evasion"
    INVALID_SCENE = "invalid_scene"


class Indicator(StrEnum):
    """To which side a planner wants to change lanes, for others to see."""

    NONE = ""
    LEFT = "left"
    RIGHT = "right"


@dataclass(frozen=True, slots=True)
class PlanStats:
    """Why a cycle ended as it did.

    A scene that does not ask for full statistics may leave `survivors` None and
    `removed` empty: the planner then has not judged what cannot change its plan.
    """

    # One sentence unless the status is OK; then why the plan stands for good, if so.
    reason: str = ""
    candidates: int = 0  # trajectories made in this cycle
    survivors: int | None = 0  # of these, the ones that passed every check
    removed: Mapping[str, int] = field(default_factory=dict)  # check -> removed by it
    costs: Mapping[str, float] = field(default_factory=dict)  # of the chosen one
    blocker: str | None = None  # what the cheapest colliding candidate would hit
    explanation: str = ""  # why this one; planners may leave it empty


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """A trajectory that a cycle considered, thinned for display; (n_points,) [m]."""

    verdict: str  # KEPT, or the check that removed it, as in PlanStats.removed
    x: FloatArray
    y: FloatArray


KEPT = "kept"


@dataclass(frozen=True, slots=True, eq=False)
class SpeedGraph:
    """The s-T graph of a cycle, for display: when which vehicle is where on the path.

    `distance` is the chosen one at the times `t`, both (n_knots,). A vehicle forbids
    the distances from `lower` to `upper`, both (n_vehicles, n_knots), NaN where it is
    not in the way.
    """

    t: FloatArray  # [s]
    distance: FloatArray  # of the ego's rear axle along its path [m]
    ids: tuple[str, ...]
    sides: tuple[str, ...]  # how the ego passes each: before it, after it
    lower: FloatArray  # [m]
    upper: FloatArray  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class PlanResult:
    """Outcome of one planning cycle.

    `trajectory` is None only when the scene was invalid. `memory` belongs to the
    planner: the caller passes it to the next cycle unchanged. `alternatives` returns
    some of the trajectories considered, `speed_graph` the s-T graph behind the chosen
    one, for display. They are calls so that only a display pays for them; make them
    right after the cycle, since they keep all of its data alive. `indicator` is what
    other drivers get to see of the planner's intention.
    """

    status: PlanStatus
    trajectory: Trajectory | None
    memory: object
    stats: PlanStats = field(default_factory=PlanStats)
    alternatives: Callable[[], tuple[Alternative, ...]] | None = None
    speed_graph: Callable[[], SpeedGraph | None] | None = None
    indicator: Indicator = Indicator.NONE


class Planner(Protocol):
    """A planner: turns a scene into a trajectory."""

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan from the ego in `scene`; infeasibility is a status, not an error.

        Args:
            scene: The present situation.
            memory: `PlanResult.memory` of the cycle before, None in the first one.

        Returns:
            A trajectory that starts in `scene.ego` at t = 0, sampled at least up to
            `scene.step`, or a status that says why there is none. Its columns describe
            one motion: the speed is that of the positions, the acceleration that of
            the speed. Metrics are computed from what they say.
        """
        ...


@runtime_checkable
class BatchPlanner(Planner, Protocol):
    """A planner that plans for many egos at once, such as a network that is evaluated.

    A simulation with many egos calls `plan_many` once a step for all that this planner
    drives, `plan` for any other.
    """

    def plan_many(
        self, scenes: Sequence[Scene], memories: Sequence[object]
    ) -> Sequence[PlanResult]:
        """Plan for each scene with its memory, as `plan` does for one.

        Args:
            scenes: One of each ego, all of the same moment.
            memories: `PlanResult.memory` of the cycle before of each, None in its
                first one.

        Returns:
            One plan for each scene, in the same order. What an ego gets must not depend
            on who else is in the batch.
        """
        ...
