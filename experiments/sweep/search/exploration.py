"""The trials of a search: asked for in batches, run, and told in their order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from experiments.config.axes import Point
from experiments.config.search import Method, Search
from experiments.sweep.search.objective import TrialJudgement
from experiments.sweep.search.proposals import make_proposer
from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray


@dataclass(frozen=True, slots=True)
class Tried:
    """A point that was run."""

    run_id: str | None  # None of a point that is no valid scenario
    judgement: TrialJudgement


RunPoints = Callable[[Sequence[Point]], list[Tried]]


@dataclass(frozen=True, slots=True, eq=False)
class SearchTrial:
    """One trial, in the order in which they were proposed."""

    number: int  # from 1
    point: Point
    coordinates: FloatArray  # of the point as it was run, (n_keys,)
    run_id: str | None
    judgement: TrialJudgement

    @property
    def failed(self) -> bool:
        """Whether the planner failed."""
        return self.judgement.failed

    @property
    def is_void(self) -> bool:
        """Whether it says nothing about the planner."""
        return self.judgement.robustness is None and not self.failed


def explore(
    search: Search,
    space: SearchSpace,
    run: RunPoints,
    method: Method | None = None,
    seed: int | None = None,
) -> list[SearchTrial]:
    """Run the trials of a method until the budget or the number of failures is reached.

    What is proposed depends on the search and the results alone: whoever runs it
    again, with results that are there already, gets the same trials.

    Args:
        search: Budget, batch, objective.
        space: Where to search.
        run: Runs points and judges them.
        method: Instead of the search's own.
        seed: Instead of the search's own.
    """
    proposer = make_proposer(
        method or search.method,
        space,
        search.seed if seed is None else seed,
        search.budget,
    )
    trials: list[SearchTrial] = []
    enough = search.stop_after_failures
    while len(trials) < search.budget:
        count = min(search.batch, search.budget - len(trials))
        points = [space.point(at) for at in proposer.ask(count)]
        tried = run(points)
        proposer.tell([one.judgement.robustness for one in tried])
        for point, one in zip(points, tried, strict=True):
            place = space.coordinates(point)
            number = len(trials) + 1
            trials.append(SearchTrial(number, point, place, one.run_id, one.judgement))
        if enough is not None and sum(t.failed for t in trials) >= enough:
            break
    return trials
