"""The page of a run: what is in it, and what happens to runs that are not whole."""

import json
import re
import sys
from html.parser import HTMLParser
from time import process_time

import duckdb
import numpy as np
import pytest

from experiments.cli.app import app
from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.episode.run import record_crash, run_episode
from experiments.episode.run_folder import OutputOptions
from experiments.report.run.page import run_page, save_run_page
from experiments.report.run_reader import numbers
from experiments.trace.candidates import CandidateLog, write_candidates
from experiments.trace.files import read_trace
from planner.interface import KEPT, Alternative, PlanStats
from planner.scene import Obstacles
from tests.experiments.report.run_folders import HOSTILE, driven_trace, write_run
from tests.experiments.report.unpacking import unpack
from tests.experiments.traces import trace_of

MEGABYTE = 1e6


def data_of(page: str):
    block = re.search(
        r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL
    )
    return json.loads(block[1])


class Tags(HTMLParser):
    """Collects tags with their attributes, as a browser would see them."""

    def __init__(self, page):
        super().__init__()
        self.found = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))


def refusal(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        app(("report", *map(str, arguments)))
    out, err = capsys.readouterr()
    assert left.value.code == 2
    assert out == ""
    assert err.count("\n") == 1
    return err


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "one", driven_trace(60))


def test_page_goes_into_the_run_folder_or_where_asked(run, tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        app(("report", str(run)))
    assert not left.value.code
    assert capsys.readouterr().out == f"{run / 'report.html'}\n"
    other = tmp_path / "other.html"
    assert save_run_page(run, other) == other
    assert other.read_bytes() == (run / "report.html").read_bytes()


def test_page_shows_outcome_metrics_versions_and_the_command(run):
    page = run_page(run)
    for text in (
        "made_up",
        "seed 3",
        "at t = 9.0 s",
        "min clearance",
        "rearview run runs/made_up/config.yaml --out runs",
        "3.11",
        "0123abc, changed",
        "simulation: {step_s: 0.1}",
    ):
        assert text in page


def test_page_holds_what_the_trace_holds(run):
    trace = read_trace(run)
    data = data_of(run_page(run))
    offset = trace.fact("length_m") / 2 - trace.fact("rear_overhang_m")
    x = numbers(trace.steps["x_m"]) + offset
    np.testing.assert_allclose(unpack(data["ego"]["x"]), x, atol=0.01)
    np.testing.assert_allclose(
        unpack(data["vehicles"]["x"]), numbers(trace.vehicles["x_m"]), atol=0.01
    )
    starts = unpack(data["vehicles"]["start"]).astype(int)
    assert starts.tolist() == list(range(0, 3 * 60 + 1, 3))
    plans = unpack(data["plans"]["start"]).astype(int)
    assert plans[1] == 16  # every second of 31 points
    assert plans[-1] == plans[-2] == 59 * 16  # nothing was planned in the last step
    first, last = unpack(data["plans"]["x"])[[0, 15]]
    assert first == pytest.approx(0.0, abs=0.01)
    assert last == pytest.approx(15.0, abs=0.01)


def test_every_chart_and_scene_has_words_for_those_who_do_not_see_it(run):
    canvases = [at for tag, at in Tags(run_page(run)).found if tag == "canvas"]
    assert len(canvases) == 10
    for attributes in canvases:
        assert attributes["role"] == "img"
        assert len(attributes["aria-label"]) > 20
    labels = " ".join(attributes["aria-label"] for attributes in canvases)
    assert "speed over time: least 5.00 m/s at 0.0 s" in labels


def test_nothing_is_fetched_and_only_the_own_script_may_run(run):
    tags = Tags(run_page(run)).found
    policy = next(at for t, at in tags if at.get("http-equiv"))["content"]
    assert "default-src 'none'" in policy
    assert re.search(r"script-src 'sha256-[^']+';", policy)
    for _, attributes in tags:
        for name in ("src", "href", "action"):
            assert attributes.get(name, "data:").startswith(("data:", "#"))


def test_hostile_names_stay_text(tmp_path):
    stats = PlanStats(reason=HOSTILE, removed={HOSTILE: 1}, blocker=HOSTILE)
    bodies = Obstacles(
        (HOSTILE,), *(np.array([v]) for v in (20.0, 2.0, 0.0, 1.0, 1.0, 0.0))
    )
    trace = driven_trace(5, name=HOSTILE, stats=stats, obstacles=bodies)
    about = {"scenario": HOSTILE, "reason": HOSTILE, "command": HOSTILE}
    folder = write_run(tmp_path / "run", trace, **about)
    (folder / "config.yaml").write_text(f"name: {HOSTILE}\n")
    page = run_page(folder)
    plain = [tag for tag, _ in Tags(run_page(write_run(tmp_path / "b", trace))).found]
    assert [tag for tag, _ in Tags(page).found] == plain
    assert data_of(page)["obstacles"][0]["id"] == HOSTILE
    assert f"{HOSTILE}.0" in data_of(page)["vehicles"]["ids"]


@pytest.mark.slow
def test_a_minute_among_a_hundred_vehicles_is_small_and_made_in_a_second(tmp_path):
    folder = write_run(tmp_path / "run", driven_trace(601, n_cars=100))
    log = CandidateLog()
    line = np.arange(13.0)
    for index in range(600):
        log.add(index, [Alternative(KEPT, line + index, line)] * 45)
    write_candidates(log, folder)
    took = []
    for _ in range(3):
        started = process_time()  # other processes may keep the cores busy
        file = save_run_page(folder)
        took.append(process_time() - started)
    size = file.stat().st_size / MEGABYTE
    sys.stdout.write(f"\n{size:.2f} MB in {min(took):.2f} s\n")
    assert size < 5.0
    assert min(took) < 1.0


def test_a_run_without_a_step_gets_a_page_that_says_so(tmp_path):
    trace = trace_of([], EpisodeStatus.CRASHED)
    folder = write_run(tmp_path / "run", trace, status="crashed", reason="killed")
    page = run_page(folder)
    assert "before its first step" in page
    assert "killed" in page
    assert data_of(page) is None


def test_a_run_whose_process_died_gets_a_page(tmp_path):
    scenario = load_scenario("thesis_straight")
    outcome = record_crash(scenario, "the process died of signal 11", tmp_path)
    assert "the process died of signal 11" in run_page(outcome.folder)


def test_a_run_whose_trace_was_not_kept_says_how_to_get_it(tmp_path):
    folder = write_run(tmp_path / "run", driven_trace(5), trace_kept=False)
    for file in folder.glob("*.parquet"):
        file.unlink()
    (folder / "map.json").unlink()
    page = run_page(folder)
    assert "was not kept" in page
    assert data_of(page) is None


def cut_short(folder):
    file = folder / "plans.parquet"
    file.write_bytes(file.read_bytes()[:-20])


def other_schema(folder):
    table = folder / "trace.parquet"
    duckdb.sql(
        f"COPY (SELECT 1 AS old) TO '{table}' "
        "(FORMAT parquet, KV_METADATA {rearview_schema: '0'})"
    )


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (cut_short, "plans.parquet: cannot be read"),
        (other_schema, "has trace schema version 0; allowed: 6"),
        (lambda f: (f / "vehicles.parquet").unlink(), "vehicles.parquet: cannot be"),
        (lambda f: (f / "map.json").unlink(), "map.json: is missing"),
        (lambda f: (f / "metrics.json").write_text("{"), "metrics.json: cannot be"),
        (lambda f: (f / "metrics.json").write_text("[]"), "metrics.json: is damaged"),
        (lambda f: (f / "manifest.json").unlink(), "is neither a run folder nor"),
        (
            lambda f: (f / "manifest.json").write_text('{"seed": 3}'),
            "manifest.json: is damaged: scenario is missing",
        ),
        (lambda f: (f / "config.yaml").unlink(), "config.yaml: cannot be read"),
    ],
)
def test_damaged_runs_are_one_line(tmp_path, capsys, damage, message):
    folder = write_run(tmp_path / "run", driven_trace(5))
    damage(folder)
    assert message in refusal(capsys, folder)
    assert not (folder / "report.html").exists()


def test_other_mistakes_are_one_line(run, tmp_path, capsys):
    assert "is neither a run folder" in refusal(capsys, tmp_path)
    assert "there is no such folder" in refusal(capsys, tmp_path / "nowhere")
    nowhere = tmp_path / "nowhere" / "a.html"
    assert "cannot be written" in refusal(capsys, run, "-o", nowhere)


def test_candidates_of_a_driven_run_are_on_its_page(tmp_path):
    scenario = load_scenario("thesis_straight", overrides=["simulation.duration_s=1"])
    output = OutputOptions(keeps_candidates=True)
    outcome = run_episode(scenario, out=tmp_path, output=output)
    plain = run_episode(scenario, out=tmp_path / "plain")
    assert outcome.trace_hash == plain.trace_hash
    assert not (plain.folder / "candidates.parquet").exists()
    found = data_of(run_page(outcome.folder))["candidates"]
    starts = unpack(found["start"]).astype(int)
    assert starts[1] > 10
    assert KEPT in found["verdicts"]
    points = unpack(found["points"]).astype(int)
    x, steps = unpack(found["x"]), outcome.trace.steps
    for step in (0, 5):
        for k in range(starts[step], starts[step + 1]):
            assert x[points[k]] == pytest.approx(steps["x_m"][step], abs=0.03)
