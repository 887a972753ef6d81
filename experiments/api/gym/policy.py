"""A policy as a planner: `module:factory` in runs and sweeps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from experiments.api.gym.actions import Action, ActionKind, drive
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.errors import ConfigError
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene

Policy = Callable[[Observation], Action]
PolicyOfMany = Callable[[Sequence[Observation]], Sequence[Action]]


@dataclass(frozen=True, slots=True)
class PolicyPlanner:
    """Drives by a policy, each action for a number of steps."""

    policy: Policy
    kind: ActionKind = ActionKind.LANE_AND_SPEED
    shape: ObservationShape = field(default_factory=ObservationShape)
    repeat: int = 1

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Ask the policy, or go on with its last action; `memory` is (action, age)."""
        if not self._is_over(memory):
            return self._going_on(scene, memory)
        return self._driven(scene, self.policy(observe(scene, self.shape)), 0)

    def _is_over(self, memory: object) -> bool:
        """Tell whether the last action has been driven for as long as it lasts."""
        return not isinstance(memory, tuple) or memory[1] >= self.repeat

    def _going_on(self, scene: Scene, memory: object) -> PlanResult:
        """Go on with the last action."""
        assert isinstance(memory, tuple)  # noqa: S101 - else it is over
        return self._driven(scene, *memory)

    def _driven(self, scene: Scene, action: Action, age: int) -> PlanResult:
        """Drive an action that is `age` steps old."""
        kept = (action, age + 1)
        plan = drive(self.kind, action, scene)
        if plan is None:
            reason = "the action leads off the frame of the reference path"
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, kept, stats)
        return PlanResult(PlanStatus.OK, plan, kept)


@dataclass(frozen=True, slots=True)
class BatchPolicyPlanner(PolicyPlanner):
    """The same with one call of the policy for all egos of a simulation."""

    of_many: PolicyOfMany = field(kw_only=True)

    def plan_many(
        self, scenes: Sequence[Scene], memories: Sequence[object]
    ) -> list[PlanResult]:
        """Plan for each scene; see `planner.interface.BatchPlanner`."""
        asked = [k for k, memory in enumerate(memories) if self._is_over(memory)]
        seen = [observe(scenes[k], self.shape) for k in asked]
        actions = self.of_many(seen) if seen else ()
        new = dict(zip(asked, actions, strict=True))
        return [
            self._driven(scene, new[k], 0)
            if k in new
            else self._going_on(scene, memories[k])
            for k, scene in enumerate(scenes)
        ]


def onnx_planner(
    file: str, action: str = "lane_and_speed", repeat: int = 1
) -> PolicyPlanner:
    """Make a planner of a policy in an ONNX file: `rearview.gym:onnx_planner`.

    The model takes the arrays of an observation by their names, each with a first axis
    of 1 (it may take some of them only); its first output is the action, (1, n). If
    the first axis of all is free, many egos are asked for in one call; onnxruntime may
    then round an ego's action differently with other egos beside it.

    Args:
        file: Of the model, absolute or relative to the working folder.
        action: `control`, `lane_and_speed` or `frenet`.
        repeat: Steps that an action is driven for, as in training.

    Raises:
        ConfigError: If file, action or model are not what is allowed, or onnxruntime is
            missing.
    """
    kinds = [kind.value for kind in ActionKind]
    if action not in kinds:
        allowed = ", ".join(kinds)
        raise ConfigError(f"action: is {action!r}; allowed: {allowed}")
    if not Path(file).is_file():
        raise ConfigError(f"file: {file}: no such file; allowed: an ONNX model")
    try:
        import onnxruntime
    except ImportError as error:
        raise ConfigError(
            f"onnx_planner needs onnxruntime ({error}); install it: pip install "
            "onnxruntime"
        ) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # the same bytes
    try:
        session = onnxruntime.InferenceSession(file, options)
    except Exception as error:  # of its own kinds, which are not exported
        line = (str(error).splitlines() or ["damaged"])[0][:200]
        raise ConfigError(f"file: {file}: cannot be read: {line}") from error
    names = [one.name for one in session.get_inputs()]
    unknown = set(names) - set(ObservationShape().shapes)
    if unknown:
        allowed = ", ".join(ObservationShape().shapes)
        raise ConfigError(f"file: {file}: takes {min(unknown)}; allowed: {allowed}")
    shape = _shape_of(session, names)

    def policy(observation: Observation) -> Action:
        given = {name: observation[name][None] for name in names}
        found: Action = np.asarray(session.run(None, given)[0])[0]
        return found

    def of_many(observations: Sequence[Observation]) -> Sequence[Action]:
        given = {name: np.stack([one[name] for one in observations]) for name in names}
        return list(np.asarray(session.run(None, given)[0]))

    kind = ActionKind(action)
    if _takes_many([*session.get_inputs(), *session.get_outputs()[:1]]):
        return BatchPolicyPlanner(policy, kind, shape, repeat, of_many=of_many)
    return PolicyPlanner(policy, kind, shape, repeat)


def _takes_many(nodes: Sequence[Any]) -> bool:
    """Tell whether the first axis of all inputs and of the action is free."""
    return all(node.shape and not isinstance(node.shape[0], int) for node in nodes)


def _shape_of(session: Any, names: list[str]) -> ObservationShape:
    """Read the numbers of bodies and points from the inputs of a model."""
    sizes = {one.name: one.shape for one in session.get_inputs()}
    default = ObservationShape()
    bodies = next((sizes[x][1] for x in ("vehicles", "mask") if x in names), None)
    points = sizes["path"][1] if "path" in names else None
    return ObservationShape(
        bodies if isinstance(bodies, int) else default.bodies,
        points if isinstance(points, int) else default.points,
    )
