"""Records the steps of a running episode."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

from experiments.cosim.records import StepRecord
from experiments.trace.candidates import CandidateLog
from planner.interface import PlanResult, SpeedGraph
from planner.states import Trajectory

OnStep = Callable[[StepRecord], None]


@dataclass(slots=True)
class Recorder:
    """Keeps every step and the time when it came; the loop calls it with each.

    Candidates and s-T graphs are kept only with `candidates`.
    """

    forward: OnStep | None
    candidates: CandidateLog | None = None
    graphs: list[tuple[int, SpeedGraph]] = field(default_factory=list)
    records: list[StepRecord] = field(default_factory=list)
    elapsed: list[float] = field(default_factory=list)
    started: float | None = None
    show_plan: Callable[[Trajectory], None] | None = None  # in a window

    def __call__(self, record: StepRecord) -> None:
        """Add one step."""
        now = perf_counter()
        self.started = now if self.started is None else self.started
        self.records.append(self._lightened(record))
        self.elapsed.append(now - self.started)
        plan = record.plan.trajectory if record.plan is not None else None
        if self.show_plan is not None and plan is not None:
            self.show_plan(plan)
        if self.forward is not None:
            self.forward(record)

    def _lightened(self, record: StepRecord) -> StepRecord:
        """Return the record without the parts of its plan that hold a whole cycle."""
        plan = record.plan
        if plan is None:
            return record
        if self.candidates is not None and plan.alternatives is not None:
            self.candidates.add(record.index, plan.alternatives())
        if self.candidates is not None and plan.speed_graph is not None:
            graph = plan.speed_graph()
            if graph is not None:
                self.graphs.append((record.index, graph))
        if record.planning is None or (
            plan.alternatives is None and plan.speed_graph is None
        ):
            return record
        light = PlanResult(plan.status, plan.trajectory, plan.memory, plan.stats)
        return record.with_plan(light, record.planning, record.start)
