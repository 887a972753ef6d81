"""The trials of a search: asked for in batches, run, and told in their order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from experiments.config.axes import Point
from experiments.config.search import Search
from experiments.sweep.search.objective import TrialJudgement
from experiments.sweep.search.proposals import Proposer
from experiments.sweep.search.space import SearchSpace
from experiments.sweep.search.subset_simulation import SubsetSampler
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
    search: Search, space: SearchSpace, run: RunPoints, proposer: Proposer
) -> list[SearchTrial]:
    """Run trials until the budget, the number of failures or the method's end.

    What is proposed depends on the search and the results alone: whoever runs it
    again, with results that are there already, gets the same trials.

    Args:
        search: Budget, batch, number of failures.
        space: Where to search.
        run: Runs points and judges them.
        proposer: Of the method; new.
    """
    trials: list[SearchTrial] = []
    enough = search.stop_after_failures
    estimates = isinstance(proposer, SubsetSampler)
    while len(trials) < search.budget:
        count = min(search.batch, search.budget - len(trials))
        points = [space.point(at) for at in proposer.ask(count)]
        if not points:
            break
        tried = run(points)
        proposer.tell(
            [
                one.judgement.limit_state if estimates else one.judgement.robustness
                for one in tried
            ]
        )
        for point, one in zip(points, tried, strict=True):
            place = space.coordinates(point)
            number = len(trials) + 1
            trials.append(SearchTrial(number, point, place, one.run_id, one.judgement))
        if enough is not None and sum(t.failed for t in trials) >= enough:
            break
    return trials
