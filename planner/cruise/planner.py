"""The cruise planner: [Thesis] ch. 4 made fit for the closed loop."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.bodies import Bodies
from planner.cruise import costs
from planner.cruise.alternatives import alternatives_of
from planner.cruise.cycle import Cycle, disc_cover, front_limit
from planner.cruise.evaluation import (
    CONSISTENCY,
    DEAD_END,
    HEADING,
    HEADWAY,
    JERK,
    OFFSET,
    SAFETY,
    evaluate,
)
from planner.cruise.feasibility import TOLERANCE, Check
from planner.cruise.settings import CruiseSettings, Normalisation, SafetyTerm
from planner.fallback import fallback
from planner.geometry.clearance import gaps_to
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.states import FloatArray, IntArray, Trajectory
from planner.validity import invalid

TINY = 1e-12  # a term that is nowhere larger makes no difference


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
        cycle = Cycle.of(scene, self.settings, last)
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
        looked_at = partial(alternatives_of, cycle, verdict)
        if survivors.size == 0:
            counts_of = candidates, removed, blocking
            found = _fall_back(scene, self.settings, cycle, last, counts_of)
            return replace(found, alternatives=looked_at)
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
        memory_now = CruiseMemory(trajectory)
        return PlanResult(PlanStatus.OK, trajectory, memory_now, stats, looked_at)


def _price(
    cycle: Cycle,
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
    cycle: Cycle,
    last: Trajectory | None,
    found: tuple[int, dict[str, int], str | None],
) -> PlanResult:
    """No candidate survived: go down the ladder and say why."""
    candidates, removed, blocking = found
    threshold = cycle.around.threshold
    line = front_limit(scene) + TOLERANCE

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
        discs = disc_cover(scene, settings)
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
