"""The cruise planner: [Thesis] ch. 4 made fit for the closed loop."""

import math
from dataclasses import dataclass, field, replace
from functools import partial

from planner.bodies import touched_by
from planner.contact_check import Contact, contacts_of
from planner.cruise import costs
from planner.cruise.candidate_motion import S
from planner.cruise.costs import DEAD_END, JERK, OFFSET, SPEED
from planner.cruise.cycle import Cycle
from planner.cruise.drawn_candidates import alternatives_of
from planner.cruise.evaluation import Evaluation, evaluate
from planner.cruise.feasibility import TOLERANCE, Check
from planner.cruise.held import is_held
from planner.cruise.sampling.longitudinal import STANDING, front_limit
from planner.cruise.selection import Pricing
from planner.cruise.settings import CruiseSettings
from planner.cruise.steering import wheels_turned
from planner.cruise.surroundings import disc_cover
from planner.fallback.behind import behind
from planner.fallback.ladder import fallback
from planner.interface import Alternative, PlanResult, PlanStats, PlanStatus
from planner.scene import Scene
from planner.scene_checks import invalid
from planner.states import Trajectory

CHECK_NAMES = {
    int(check): check.name.lower() for check in Check if check is not Check.PASSED
}


SLOW = 3.0  # slower, the ego may be about to stop where it cannot start [m/s]
FAR_TOO_SLOW = 1.3  # price of the speed of a plan that does not get on; 2 stands [-]
LEAST_DRIVEN = 5.0  # a plan that drives less does not get on [m]
NEAR_END = 0.5  # share of the room to steer round what stands, that may be missing [-]
MARGIN_USED = 0.5  # share of the margin to the road's edge, by who has to start [-]
S_ROW = 7  # of a motion: arc length


@dataclass(frozen=True, slots=True)
class CruiseMemory:
    """State handed from one cycle to the next."""

    trajectory: Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class CruisePlanner:
    """Sample, check, price, choose; `plan` is a pure function of scene and memory."""

    settings: CruiseSettings
    _pricing: Pricing = field(init=False, repr=False)
    _separable: bool = field(init=False, repr=False)
    _wants_comfort: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compute what follows from the settings alone."""
        pricing = Pricing.of(self.settings)
        object.__setattr__(self, "_pricing", pricing)
        object.__setattr__(self, "_separable", pricing.separable)
        limiting = self.settings.comfort.is_limiting
        object.__setattr__(self, "_wants_comfort", limiting)

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = memory.trajectory if isinstance(memory, CruiseMemory) else None
        cycle = Cycle.of(scene, self.settings, last)
        exhaustive = scene.full_statistics or not self._separable
        cycle, found = self._search(scene, cycle, exhaustive=exhaustive)
        stats = _statistics(cycle, found)
        looked_at = partial(self._alternatives, cycle, found)
        if found.choice.best < 0:
            instead = _fall_back(scene, self.settings, cycle, stats)
            return replace(instead, alternatives=looked_at)
        trajectory = Trajectory.from_rows(found.motion)
        memory_now = CruiseMemory(trajectory)
        return PlanResult(PlanStatus.OK, trajectory, memory_now, stats, looked_at)

    def _search(
        self, scene: Scene, cycle: Cycle, *, exhaustive: bool
    ) -> tuple[Cycle, Evaluation]:
        """Find the best candidate: a comfortable one, if there is any that gets on."""
        if self._wants_comfort:
            gentle = cycle.gentle(scene.ego, self.settings.comfort)
            found = self._evaluate(gentle, exhaustive=exhaustive)
            if found.choice.best >= 0 and found.choice.raw[DEAD_END] <= NEAR_END:
                if _has_to_start(scene, gentle, found):
                    return self._start(scene, gentle, found, exhaustive=exhaustive)
                return gentle, found
        found = self._evaluate(cycle, exhaustive=exhaustive)
        if _has_to_start(scene, cycle, found):
            return self._start(scene, cycle, found, exhaustive=exhaustive)
        return cycle, found

    def _start(
        self, scene: Scene, cycle: Cycle, found: Evaluation, *, exhaustive: bool
    ) -> tuple[Cycle, Evaluation]:
        """Look for longer lateral motions, where none of the usual length gets on.

        Beside the path in a bend, a motion that is over within the few metres that a
        slow ego covers may need more curvature than the vehicle has; and where the
        road leaves little more than the margin, a few centimetres beside the path leave
        none: half of the margin may be used up. If none of these gets on either, and
        none was refused for a body, the wheels of an ego that stands are turned first,
        and the whole margin may be used up, and `starting_excess` over the edge.

        Returns:
            The cheapest of all that gets on and its cycle; those given without one.
        """
        best, least = (cycle, found), math.inf
        scale = cycle.scale
        if found.choice.best >= 0:
            least = float(found.choice.terms.sum())
        excess = MARGIN_USED * self.settings.road_margin
        for length in self.settings.starting_lengths:
            longer = cycle.starting(scale * length, excess)
            tried = self._evaluate(longer, exhaustive=exhaustive)
            total = float(tried.choice.terms.sum())
            if _moves(tried) and total < least:
                best, least = (longer, tried), total
        # who is in the way will move: a queue is not worth the search in each cycle
        in_the_way = best[1].choice.counts[Check.COLLISION] > 0
        if _moves(best[1]) or in_the_way or not self.settings.starting_lengths:
            return best
        shortest = scale * min(self.settings.starting_lengths)
        excess = self.settings.road_margin + self.settings.starting_excess
        for bend in wheels_turned(scene) or (None,):
            turned = cycle.starting(shortest, excess, bend)
            tried = self._evaluate(turned, exhaustive=exhaustive)
            if _moves(tried):
                return turned, tried
        return best

    def _evaluate(self, cycle: Cycle, *, exhaustive: bool) -> Evaluation:
        """Evaluate the candidates of a cycle, all of them if exhaustive."""
        pricing = self._pricing.columns(remembers=cycle.last is not None)
        return evaluate(cycle.tables, pricing, exhaustive)

    def _alternatives(self, cycle: Cycle, found: Evaluation) -> tuple[Alternative, ...]:
        """Return candidates to be drawn; judge those that had been left out."""
        if not _is_complete(found):
            found = self._evaluate(cycle, exhaustive=True)
        return alternatives_of(cycle, found.verdict.ravel())


def _has_to_start(scene: Scene, cycle: Cycle, found: Evaluation) -> bool:
    """Check whether a slow ego does not get on, although nothing holds it."""
    if scene.ego.speed >= SLOW or _gets_on(scene, found):
        return False
    return not is_held(scene, cycle.leader, LEAST_DRIVEN)


def _gets_on(scene: Scene, found: Evaluation) -> bool:
    """Check whether the chosen motion gets on, if need be up to a closed line."""
    waits = bool(scene.stop_lines)
    return _moves(found) and (waits or found.choice.raw[SPEED] < FAR_TOO_SLOW)


def _moves(found: Evaluation) -> bool:
    """Check whether the chosen motion gets on."""
    s = found.motion[S_ROW]
    return bool(s.size) and bool(s[-1] - s[0] > LEAST_DRIVEN)


def _is_complete(found: Evaluation) -> bool:
    """Check whether every candidate was judged."""
    return int(found.choice.counts.sum()) == found.verdict.size


def _statistics(cycle: Cycle, found: Evaluation) -> PlanStats:
    """Count the removed candidates and list the costs of the chosen one."""
    choice = found.choice
    counts = choice.counts.tolist()
    complete = sum(counts) == found.verdict.size  # as `_is_complete`
    removed: dict[str, int] = {}
    if complete:
        removed = {
            name: counts[check] for check, name in CHECK_NAMES.items() if counts[check]
        }
        if cycle.off_road:
            removed["road"] = removed.get("road", 0) + cycle.off_road
    prices = {}
    if choice.best >= 0:
        terms = choice.terms.tolist()
        prices = dict(zip(costs.TERMS, terms, strict=True))
        prices["total"] = sum(terms)
        prices["jerk_integral"] = float(choice.raw[JERK])
        prices["mean_offset_squared"] = float(choice.raw[OFFSET])
    body = int(found.blocker.flat[choice.cheapest]) if choice.cheapest >= 0 else -1
    if body >= 0 and _stands_behind(cycle, body):
        body = -1
    return PlanStats(
        candidates=found.verdict.size + cycle.off_road,
        survivors=counts[Check.PASSED] if complete else None,
        removed=removed,
        costs=prices,
        blocker=cycle.bodies.ids[body] if body >= 0 else None,
    )


def _stands_behind(cycle: Cycle, body: int) -> bool:
    """Check whether a body stands behind the ego: it keeps nobody from driving on."""
    around, s = cycle.tables.around, cycle.tables.tracks.rows[0, S, 0]
    front = around.s[body, 0] + around.extents[body, 0] + around.extents[body, 2]
    slow = around.speed[body] < STANDING
    return bool(slow and front < s - around.rear_overhang)


def _fall_back(
    scene: Scene, settings: CruiseSettings, cycle: Cycle, stats: PlanStats
) -> PlanResult:
    """No candidate survived: go down the ladder and say why."""
    threshold = cycle.tables.around.threshold
    line = front_limit(scene) + TOLERANCE
    discs, more_discs, radius = disc_cover(scene, settings)
    theirs = behind(scene, cycle.bodies)

    def blocker(trajectory: Trajectory) -> str | None:
        if trajectory.s[-1] + scene.vehicle.front_reach > line:
            return "stop line"
        bodies = cycle.bodies
        return touched_by(
            trajectory,
            bodies,
            theirs,
            (*discs, *more_discs.tolist()),
            radius,
            threshold,
        )

    def contacts(trajectory: Trajectory, margin: float) -> tuple[Contact, ...]:
        return contacts_of(trajectory, scene.vehicle, cycle.bodies, theirs, margin)

    horizon = settings.horizon or max(settings.times)
    status, trajectory = fallback(scene, cycle.last, blocker, horizon, contacts)
    checks = ", ".join(f"{name} {n}" for name, n in stats.removed.items())
    stats = replace(
        stats,
        reason=f"no candidate of {stats.candidates} survived ({checks})",
        blocker=stats.blocker or blocker(trajectory),
    )
    return PlanResult(status, trajectory, CruiseMemory(trajectory), stats)
