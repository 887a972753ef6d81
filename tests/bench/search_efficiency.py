"""The page `search_efficiency.md`: after how many runs planted defects are found.

`python -m tests.bench.search_efficiency runs/efficiency -o docs/search_efficiency.md`
runs what is missing in its folder, and writes the page. Runs are episodes in memory, by
the planner, loop and metrics of any run, without files.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.comparison.inference import wilson
from experiments.config.search import Search
from experiments.config.search_file import load_search
from experiments.config.yaml_reader import Document
from experiments.cosim.loop import run_loop
from experiments.episode.recorder import Recorder
from experiments.episode.run import episode_options, make_scenario_planner
from experiments.episode.run_folder import OutputOptions
from experiments.metrics.row import metric_row
from experiments.sweep.plan import PlannedRun
from experiments.sweep.search.exploration import Tried, explore
from experiments.sweep.search.objective import judge
from experiments.sweep.search.proposals import make_proposer
from experiments.sweep.search.runs import sweep_of_points
from experiments.sweep.search.space import SearchSpace
from experiments.trace.recording import RunFacts, build_trace
from experiments.world_setup.layout import make_layout
from experiments.world_setup.vehicle_model import make_plant
from experiments.world_setup.world import make_world
from tests.experiments.sweep.search import planted

DEFECTS = {
    "weak": "brakes with 1 m/s² above 27.2 m/s (of 12.5 to 30)",
    "late": "reacts 1.2 s late above 27.2 m/s",
    "lorries": "does not see vehicles longer than 15.7 m (of 4 to 16)",
    "window": "sees nothing at gaps of 16 to 34 m",
    "left": "does not see obstacles more than 1.65 m to the left (of ±5)",
}
METHODS = ("directed", "tpe")
BUDGET = 200
RANDOM_TRIALS = 400
TENTH = 0.1  # of the runs at random, which a search is to need at most
HEADER = f"""# How soon searches find planted defects

Written by `python -m tests.bench.search_efficiency`; nothing is typed in by hand. Five
defects were planted in a simple lane keeper
(`tests/experiments/sweep/search/broken_planner.py`, thresholds `RARE`), each in a space
of four or five keys (`planted.py` beside it) in which the lane keeper without a defect
fails nowhere. At random each run fails with the share in the second column
(95 %: Wilson), so the first failure comes with a median of ln 2 / share runs. A cell:
the median of a method's first failure over its seeds, and the first failures (none:
not within {BUDGET} runs); **bold** where it is a tenth of the median at random or less,
even at the end of its interval. Objective `near_miss`, batches of 8.
"""
READING = """
`directed` begins at the end of all ranges that is farthest from the mild values: fast,
close, slow ahead, long. Three of the defects show there: its first run finds them,
which says nothing about defects elsewhere. Inside the ranges (gaps of 16 to 34 m,
obstacles a little to the left) its first 16 runs, at the ends, teach it little, and the
objective has other valleys, where the lane keeper brakes late or passes closely without
a defect: it is not ten times as soon as chance there, and may be later.
"""


class Planted(NamedTuple):
    """A defect with its search."""

    search: Search
    document: Document
    space: SearchSpace


def load(defect: str, folder: Path) -> Planted:
    """Write and read the search of a defect."""
    path = planted.write_search(folder, defect, rare=True, objective="near_miss")
    search, document = load_search(path, ("broken_planner",))
    return Planted(search, document, SearchSpace(search.space))


def episode(run: PlannedRun) -> dict[str, Any]:
    """Drive an episode in memory; return its row."""
    scenario = run.scenario
    layout = make_layout(scenario)
    recorder = Recorder(None, None)
    world = make_world(scenario, layout, Path(), gui=False)
    options = episode_options(scenario, layout, OutputOptions())
    planner, plant = make_scenario_planner(scenario), make_plant(scenario)
    ending = run_loop(world, planner, plant, layout.task, options, recorder)
    world.close()
    simulation = scenario.simulation
    facts = RunFacts(
        scenario.name, scenario.planner.name, simulation.seed, simulation.step_s
    )
    times = recorder.elapsed
    return metric_row(
        build_trace(facts, layout.road, layout.task, recorder.records, ending, times)
    )


def runner(one: Planted) -> Callable[[Sequence[Any]], list[Tried]]:
    """Return what runs points and judges them."""

    def run(points: Sequence[Any]) -> list[Tried]:
        names = [json.dumps(point) for point in points]
        new = dict(zip(names, points, strict=True))  # one may be proposed twice
        _, plan = sweep_of_points(one.search, one.document, list(new.values()))
        rows = dict(zip(new, map(episode, plan), strict=True))
        objective = one.search.objective
        return [Tried("", judge(objective, rows[name])) for name in names]

    return run


def first_failure(one: Planted, method: str, seed: int) -> int | None:
    """Return the number of the first trial that fails."""
    changes = {"method": method, "seed": seed, "budget": BUDGET}
    search = one.search.model_copy(update={**changes, "stop_after_failures": 1})
    mild = one.space.coordinates(one.space.mild_point({}))
    proposer = make_proposer(search, one.space, mild)
    trials = explore(search, one.space, runner(one), proposer)
    return next((trial.number for trial in trials if trial.failed), None)


def random_failures(one: Planted, seed: int, count: int) -> int:
    """Count the failures of random points."""
    generator = np.random.default_rng(seed)
    points = [
        one.space.point(generator.random(len(one.space.keys))) for _ in range(count)
    ]
    return sum(tried.judgement.failed for tried in runner(one)(points))


class Kept:
    """Results in a file, a line each, so that the command resumes."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._file = folder / "efficiency.jsonl"
        self.found: dict[str, Any] = {}
        if self._file.exists():
            for line in self._file.read_text(encoding="utf-8").splitlines():
                self.found.update(json.loads(line))

    def get(self, key: str, compute: Callable[[], Any]) -> None:
        """Compute and keep a result that is not there."""
        if key not in self.found:
            self.found[key] = compute()
            with self._file.open("a", encoding="utf-8") as file:
                file.write(json.dumps({key: self.found[key]}) + "\n")


class Asked(NamedTuple):
    """What is to be measured."""

    defects: Sequence[str]
    methods: Sequence[str]
    seeds: int
    chance: int  # random points of each defect


def measure(kept: Kept, asked: Asked) -> None:
    """Run what is missing: every seed of a method after the other, random points."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        sys.path.insert(0, str(planted.HERE))
        loaded = {defect: load(defect, folder / defect) for defect in asked.defects}
        for method in asked.methods:
            for seed in range(asked.seeds):
                for defect, one in loaded.items():
                    key = f"{defect} {method} {seed}"
                    kept.get(key, partial(first_failure, one, method, seed))
        for part in range(asked.chance // 100):
            for defect, one in loaded.items():
                key = f"{defect} at random {part}"
                kept.get(key, partial(random_failures, one, part, 100))


def page(found: dict[str, Any]) -> Iterator[str]:
    """Write the page."""
    yield HEADER
    yield f"| defect | fails at random | median at random | {' | '.join(METHODS)} |"
    yield "|---" * (len(METHODS) + 3) + "|"
    for defect, words in DEFECTS.items():
        parts = [v for k, v in found.items() if k.startswith(f"{defect} at random")]
        share = wilson(sum(parts), max(100 * len(parts), 1))
        middle, least, most = (
            np.log(2.0) / value if value > 0.0 else np.inf
            for value in (share.value, share.high, share.low)
        )
        cells = [
            words,
            f"{share.value:.1%} ({share.low:.1%} to {share.high:.1%}, "
            f"{100 * len(parts)} runs)",
            f"{middle:.0f} ({least:.0f} to {most:.0f})",
        ]
        cells += [_cell(found, f"{defect} {name} ", least) for name in METHODS]
        yield f"| {' | '.join(cells)} |"
    yield READING


def _cell(found: dict[str, Any], start: str, at_random: float) -> str:
    """Write what a method needed; `at_random`: least median that chance may need."""
    firsts = [value for key, value in found.items() if key.startswith(start)]
    if not firsts:
        return "-"
    median = float(np.median([np.inf if one is None else one for one in firsts]))
    listed = sorted(firsts, key=lambda one: np.inf if one is None else one)
    words = ", ".join("none" if one is None else str(one) for one in listed)
    needed = "more" if np.isinf(median) else f"{median:.0f}"
    text = f"{needed} ({words})"
    return f"**{text}**" if median <= TENTH * at_random else text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(prog="search_efficiency", description=__doc__)
    parser.add_argument("folder", type=Path, help="of the results")
    parser.add_argument("--seeds", type=int, default=5, help="of each method")
    parser.add_argument("--chance", type=int, default=RANDOM_TRIALS)
    parser.add_argument("--only", choices=list(DEFECTS), action="append")
    parser.add_argument("--method", choices=METHODS, action="append")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    kept = Kept(options.folder)
    methods = METHODS if options.method is None else options.method
    defects = options.only or list(DEFECTS)
    measure(kept, Asked(defects, methods, options.seeds, options.chance))
    text = "\n".join(page(kept.found)).rstrip() + "\n"
    if options.output is None:
        sys.stdout.write(text)
    else:
        options.output.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
