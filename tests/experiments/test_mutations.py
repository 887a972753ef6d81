"""Readers against thousands of damaged inputs: never anything but one short line.

`pytest tests/experiments/test_mutations.py -m slow --mutations 20000` runs the full
campaign.
"""

import json
import math
import random
import shutil
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import duckdb
import numpy as np
import pytest
import yaml

from experiments.cli.user_errors import error_line, user_errors
from experiments.comparison import location
from experiments.comparison.compare import Question, compare
from experiments.comparison.results import rebuild, rows
from experiments.config.scenario_file import (
    SCENARIO_FOLDER,
    config_text,
    load_scenario,
    scenario_names,
)
from experiments.config.sweep_file import SWEEP_FOLDER, load_sweep, sweep_names
from experiments.episode.newest_run import newest_run
from experiments.errors import MESSAGE_LIMIT
from experiments.metrics.row import metric_row
from experiments.report.run.page import run_page
from experiments.report.run.road import page_road
from experiments.report.run_reader import read_run
from experiments.report.sweep.page import sweep_page
from experiments.storage.run_files import write_json
from experiments.sweep.folder import load_sweep_copy, take
from experiments.sweep.plan import Plan
from experiments.trace.candidates import CandidateLog, write_candidates
from experiments.trace.files import file_name
from experiments.trace.road_map import MAP_FILE, MapLane, RoadMap, read_map, write_map
from experiments.trace.schema import TABLES
from experiments.trace.speed_graphs import GRAPHS_FILE, write_graphs
from planner.interface import Alternative, SpeedGraph
from tests.experiments.mutations import (
    mutated_bytes,
    mutated_json,
    mutated_text,
    rewrite_parquet,
)
from tests.experiments.report.run_folders import driven_trace, write_run, write_sweep

pytestmark = pytest.mark.slow

TRACE = driven_trace(4)


@pytest.fixture(scope="module")
def originals(tmp_path_factory) -> Path:
    """A run with everything in it, and a sweep of two seeds."""
    folder = tmp_path_factory.mktemp("originals")
    run = write_run(folder / "run", TRACE, sweep={"label": "a", "point": {"ego.x": 1}})
    line = np.arange(8.0).reshape(4, 2)
    lanes = tuple(
        MapLane("a", index, 3.2, inside_junction=False, points=line)
        for index in range(2)
    )
    write_map(RoadMap(lanes, (line,)), run)
    log = CandidateLog()
    one = Alternative("kept", np.arange(3.0), np.arange(3.0))
    log.add(0, (one, one))
    write_candidates(log, run)
    t = 0.1 * np.arange(11)
    ends = np.tile(t, (1, 1))
    graph = SpeedGraph(t, 5.0 * t, ("car.1",), ("after",), ends, ends + 5.0)
    write_graphs([(0, graph), (1, graph)], run)
    (run / "config.yaml").write_text(config_text(load_scenario("straight").resolved()))
    sweep = write_sweep(folder / "sweep", seeds=1)
    write_json(sweep / "code.json", {"sweep": "made", "code": {"the code": "abc"}})
    rebuild(sweep)
    return folder


@pytest.fixture(autouse=True)
def _few_resamples(monkeypatch) -> None:
    """Intervals of a comparison take most of the time, and read nothing."""
    monkeypatch.setattr(location, "RESAMPLES", 99)
    monkeypatch.setattr(location, "TAIL_RESAMPLES", 99)


def one_line(read: Callable[[], object]) -> bool:
    """Read; whether it was refused, in one short line of an error for users."""
    try:
        read()
    except user_errors() as error:
        line = error_line(error)
        assert 0 < len(line) <= MESSAGE_LIMIT, line
        assert "\n" not in line
        return True
    return False


def _scenario(rng: random.Random, folder: Path, _: Path) -> Callable[[], object]:
    name = rng.choice(scenario_names())
    text = (SCENARIO_FOLDER / f"{name}.yaml").read_text()
    file = folder / "odd.yaml"
    file.write_text(mutated_text(text, rng), encoding="utf-8")
    return lambda: load_scenario(str(file))


def _set(rng: random.Random, folder: Path, _: Path) -> Callable[[], object]:
    scenario = load_scenario("straight").resolved()
    lines = yaml.safe_dump(scenario, default_flow_style=True, width=10**9)
    keys = ["ego.goal_m", "obstacles", "ego", "network", "planner.settings.x", "a[0].b"]
    key = rng.choice([*keys, *(f"{a}.{b}" for a in scenario for b in keys)])
    asked = f"{key}={rng.choice(('12', '[1, 2]', 'x', lines[: rng.randrange(200)]))}"
    text = asked if rng.random() < 0.2 else mutated_text(asked, rng)
    return lambda: load_scenario("straight", overrides=[text])


def _sweep(rng: random.Random, folder: Path, _: Path) -> Callable[[], object]:
    text = (SWEEP_FOLDER / f"{rng.choice(sweep_names())}.yaml").read_text()
    file = folder / "odd.yaml"
    file.write_text(mutated_text(text, rng), encoding="utf-8")

    def read() -> None:
        sweep, document = load_sweep(str(file))
        if sweep.count < 10_000:
            list(islice(Plan(sweep, document), 2))

    return read


def _manifest(rng: random.Random, folder: Path, there: Path) -> Callable[[], object]:
    return _json_of_a_run("manifest.json", rng, folder, there)


def _metrics(rng: random.Random, folder: Path, there: Path) -> Callable[[], object]:
    return _json_of_a_run("metrics.json", rng, folder, there)


def _json_of_a_run(
    name: str, rng: random.Random, folder: Path, there: Path
) -> Callable[[], object]:
    if rng.random() < 0.5:
        run = _copied(there / "run", folder / "run")
        _mutate_json(run / name, rng)

        def read() -> None:
            newest_run(folder)
            run_page(run)

        return read
    sweep = _copied(there / "sweep", folder / "sweep")
    _mutate_json(rng.choice(sorted(sweep.glob(f"runs/*/*/{name}"))), rng)

    def read_sweep() -> None:
        compare(rows(sweep), Question("cruise"))
        sweep_page(sweep, sweep)

    return read_sweep


def _map(rng: random.Random, folder: Path, there: Path) -> Callable[[], object]:
    text = (there / "run" / MAP_FILE).read_text()
    (folder / MAP_FILE).write_text(mutated_json(text, rng), encoding="utf-8")
    return lambda: page_road(TRACE, read_map(folder))


def _sweep_files(rng: random.Random, folder: Path, there: Path) -> Callable[[], object]:
    sweep = _copied(there / "sweep", folder / "sweep")
    asked = load_sweep_copy(sweep)
    what = rng.choice(("code.json", "sweep.yaml", "results.parquet"))
    file = sweep / what
    if what == "code.json":
        _mutate_json(file, rng)
    elif what == "sweep.yaml":
        text = mutated_text(file.read_text(), rng)
        file.write_text(text, encoding="utf-8")
    else:
        file.write_bytes(mutated_bytes(file.read_bytes(), rng))

    def read() -> None:
        compare(rows(sweep), Question("cruise"))
        load_sweep_copy(sweep)
        take(sweep, asked, {"the code": "abc"})

    return read


def _parquet(rng: random.Random, folder: Path, there: Path) -> Callable[[], object]:
    run = _copied(there / "run", folder / "run")
    file = rng.choice(sorted(run.glob("*.parquet")))
    if rng.random() < 0.5:
        file.write_bytes(mutated_bytes(file.read_bytes(), rng))
    else:
        try:
            rewrite_parquet(file, rng)
        except duckdb.Error:  # the mutation makes no sense for this column
            file.write_bytes(b"")

    def read() -> None:
        page = run_page(run)
        assert page
        metric_row(read_run(run).trace)

    return read


# kind of input -> how it is mutated and read, and its share of the campaign
MUTATIONS = {
    "scenario": (_scenario, 0.25),
    "set": (_set, 0.25),
    "sweep": (_sweep, 0.15),
    "map": (_map, 0.15),
    "parquet": (_parquet, 0.08),
    "manifest": (_manifest, 0.05),
    "metrics": (_metrics, 0.04),
    "sweep_files": (_sweep_files, 0.03),
}


def _mutate_json(file: Path, rng: random.Random) -> None:
    file.write_text(mutated_json(file.read_text(), rng), encoding="utf-8")


def _copied(source: Path, target: Path) -> Path:
    """A fresh copy with the times of the original."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target)
    return target


def test_originals_are_read(originals, tmp_path):
    assert run_page(originals / "run")
    assert (originals / "run" / GRAPHS_FILE).is_file()
    assert all((originals / "run" / file_name(name)).is_file() for name in TABLES)
    assert len(rows(originals / "sweep")) == 8


@pytest.mark.parametrize("kind", MUTATIONS)
def test_damaged_inputs_are_one_line(kind, originals, tmp_path, request):
    mutated, share = MUTATIONS[kind]
    count = math.ceil(share * request.config.getoption("--mutations"))
    refused, wrong = 0, []
    for number in range(count):
        rng = random.Random(f"{kind} {number}")
        read = mutated(rng, tmp_path, originals)
        try:
            refused += one_line(read)
        except Exception as error:  # noqa: BLE001, that is what is looked for
            wrong.append(f"{kind} {number}: {type(error).__name__}: {error!s:.300}")
    assert not wrong, f"{len(wrong)} of {count}:\n" + "\n".join(wrong[:20])
    assert refused >= 0.2 * count  # the mutations do hurt
    print(json.dumps({"kind": kind, "inputs": count, "refused": refused}))  # noqa: T201
