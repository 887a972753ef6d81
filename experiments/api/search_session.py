"""A search from the command to the last line: check, lock, trials, reduction, table."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from experiments.api.sweep_session import STOPPED, fresh_page
from experiments.comparison.inference import wilson
from experiments.comparison.results import rebuild
from experiments.config.axes import Point
from experiments.config.search import Search
from experiments.config.yaml_reader import Document
from experiments.errors import ConfigError, ResultsError
from experiments.storage.run_files import replace_json
from experiments.sweep.executors.executor import Executor, WorkerSettings
from experiments.sweep.folder import LOG, RESULTS, locked, require_place
from experiments.sweep.plan import PlannedRun
from experiments.sweep.progress import Counts, SweepProgress, sweep_progress
from experiments.sweep.search.clusters import cluster_failures
from experiments.sweep.search.coverage import space_coverage
from experiments.sweep.search.exploration import SearchTrial, explore
from experiments.sweep.search.files import FOUND
from experiments.sweep.search.objective import check_objective
from experiments.sweep.search.proposals import (
    RandomProposer,
    estimate_of,
    make_proposer,
)
from experiments.sweep.search.reduction import reduce_failures
from experiments.sweep.search.resume import asked_content, note_asked, require_same
from experiments.sweep.search.runs import (
    LimitReachedError,
    SearchRuns,
    sweep_of_points,
)
from experiments.sweep.search.space import SearchSpace, extremes
from experiments.sweep.search.summary import (
    SearchFindings,
    as_plain,
    first_failure,
    table_lines,
)
from experiments.world_setup.layout import make_layout


class SearchSession:
    """One call of `rearview search`; yields lines for the terminal."""

    def __init__(
        self,
        search: Search,
        document: Document,
        folder: Path,
        workers: int | None = None,
        limit: int | None = None,
    ) -> None:
        check_objective(search.objective, document)
        if workers is not None:
            from experiments.sweep.executors.local import require_few

            require_few(workers)
        self._search, self._document = search, document
        self._folder = folder
        self._workers, self._limit = workers, limit
        self._space = SearchSpace(search.space)
        base = self._first_run([])
        self._mild = self._space.mild_point(base.scenario.resolved())
        self._goal = self._space.coordinates(self._mild)
        self._proposer = make_proposer(search, self._space, self._goal)
        self._asked = asked_content(search, self._check_space())

    def preview(self) -> str:
        """Describe what would run; write nothing."""
        search, count = self._search, len(self._space.keys)
        keys = f"{count} keys" if count > 1 else "1 key"
        return (
            f"{search.name}: {search.method}, {search.budget} trials in "
            f"{keys}, at most {search.most_runs} runs"
        )

    def drive(self) -> Iterator[str]:
        """Run the trials that are missing and say what they have found."""
        require_place(self._folder)
        require_same(self._folder, self._asked)
        yield self.preview()
        with locked(self._folder):
            note_asked(self._folder, self._asked)
            found = self._find()
            rebuild(self._folder)
            if found is None:
                yield "limit reached; the same command goes on"
                return
            replace_json(self._folder / FOUND, as_plain(found, self._folder))
        yield from table_lines(found, self._folder)
        if found.against is not None:
            yield against_line(found.trials, found.against)
        yield f"found: {self._folder / FOUND}"
        yield f"results: {self._folder / RESULTS}"
        yield f"report: {fresh_page(self._folder)}"

    def _find(self) -> SearchFindings | None:
        """Search with a progress display; None if the limit was reached."""
        search = self._search
        repeats = 1 if search.against is None else 2
        counts = Counts(search.budget * repeats + 1, 0)
        with sweep_progress(search.name, self._folder, counts) as progress:
            runs = SearchRuns(
                search,
                self._document,
                self._folder,
                self._executor,
                progress,
                self._limit,
            )
            try:
                found = self._findings(runs)
                progress.write("finished")
            except LimitReachedError:
                progress.write("limit reached")
                return None
            except ResultsError as error:
                self._leave(progress, f"stopped: {error}")
                raise ResultsError(f"{error}; {STOPPED}") from error
            except BaseException as error:
                interrupted = isinstance(error, KeyboardInterrupt)
                self._leave(progress, "interrupted" if interrupted else f"{error}")
                raise
            finally:
                runs.end()
        return found

    def _findings(self, runs: SearchRuns) -> SearchFindings:
        """Run everything in its order, which is always the same."""
        search, space = self._search, self._space
        mild = runs.run([self._mild])[0]
        trials = explore(search, space, runs.run, self._proposer)
        against = None
        if search.against is not None:
            chance = RandomProposer(space, search.seed + 1)
            against = explore(search, space, runs.run, chance)
        clusters = cluster_failures(space, trials)
        reduced = reduce_failures(
            [one.worst for one in clusters[: search.reduce]],
            self._mild,
            space,
            runs.run,
            search.reduction_runs,
        )
        return SearchFindings(
            search,
            self._mild,
            mild.judgement.failed,
            trials,
            clusters,
            reduced,
            space_coverage(space, [trial.coordinates for trial in trials]),
            against,
            estimate_of(self._proposer),
        )

    def _check_space(self) -> dict[str, object]:
        """Check the mild point and both ends of every key; return the mild scenario.

        Each is laid out as well: an obstacle may lie beyond the road.
        """
        for key, one in self._search.space.items():
            for value in extremes(one):
                self._check_point(key, {**self._mild, key: value})
        return self._check_point("", self._mild).scenario.resolved()

    def _check_point(self, key: str, point: Point) -> PlannedRun:
        """Plan a point and lay it out; raises ConfigError at the key's own place."""
        try:
            run = self._first_run([point])
            make_layout(run.scenario)
        except ConfigError as error:
            if str(error).startswith(f"{self._document.name}:"):
                raise
            # the scenario is sound without the point: the key or its value is not
            where = self._document.where(("space", key) if key else ("space",))
            value = f"{key}: {point[key]}" if key else "the mild values"
            raise ConfigError(f"{where}: {value}: {error}") from error
        return run

    def _first_run(self, points: Sequence[Point]) -> PlannedRun:
        """Plan a run; raises ConfigError if it is no valid scenario."""
        _, plan = sweep_of_points(self._search, self._document, points)
        return next(iter(plan))

    def _leave(self, progress: SweepProgress, words: str) -> None:
        """Write results and progress of a search that stops, if the disk allows."""
        with suppress(ResultsError, ConfigError):
            rebuild(self._folder)
            progress.write(words)

    def _executor(self) -> Executor:
        """Start the executor."""
        from experiments.sweep.executors.local import LocalExecutor
        from experiments.sweep.executors.sequential import SequentialExecutor

        settings = WorkerSettings(
            self._search.memory_mb, self._folder / LOG, Path.cwd(), self._planners()
        )
        if self._workers == 0:
            return SequentialExecutor(settings)
        return LocalExecutor(settings, self._workers)

    def _planners(self) -> tuple[str, ...]:
        """Return the folder that workers have to search for a user's planner."""
        from experiments.config.sweep_file import planner_folders

        sweep, _ = sweep_of_points(self._search, self._document, [])
        return planner_folders(sweep, self._document)


def against_line(
    trials: Sequence[SearchTrial], at_random: Sequence[SearchTrial]
) -> str:
    """Say how much sooner a method has found a failure than random search."""
    failures = sum(trial.failed for trial in at_random)
    share = wilson(failures, len(at_random))
    own, other = first_failure(trials), first_failure(at_random)
    return (
        f"against random: first failure after {_trials(own)}, at random after "
        f"{_trials(other)}; at random {failures} of {len(at_random)} trials fail "
        f"(95 %: {share.low:.2%} to {share.high:.2%})"
    )


def _trials(count: int | None) -> str:
    """Name a number of trials."""
    return "none" if count is None else f"{count} trials"
