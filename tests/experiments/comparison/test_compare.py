"""Results as a table: queries, comparison with a baseline, exports."""

import csv
import io
import json
import os
import signal
from dataclasses import replace
from pathlib import Path
from threading import Timer
from time import monotonic

import numpy as np
import pytest

from experiments.cli.app import app
from experiments.comparison import inference as statistics
from experiments.comparison import results
from experiments.comparison.compare import PENALISED, Center, Question, compare
from experiments.comparison.latex import as_latex
from experiments.comparison.table import as_csv, as_markdown, export
from experiments.errors import ConfigError, ResultsError
from experiments.metrics.catalogue import ALL_COLUMNS
from experiments.metrics.row import row_without_episode
from experiments.sweep.folder import run_folder

TRAVEL = {"slow": 20.0, "fast": 18.0}


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    """Make the run folders of two planners on 12 seeds; one run was lost."""
    rng = np.random.default_rng(2)
    for seed in range(12):
        common = rng.normal(0.0, 3.0)  # of the seed: traffic
        for label, travel in TRAVEL.items():
            row = row_without_episode("road", "p", seed, "arrived")
            row |= {"arrived": True, "collisions": int(label == "slow" and seed < 3)}
            row |= {"travel_time_s": travel + common + rng.normal(0.0, 0.5)}
            about = {"scenario": "road", "planner": "p", "seed": seed}
            about |= {"status": "arrived", "trace_hash": f"{label}{seed}"}
            about |= {"attempts": 1, "wall_s": 0.5}
            if (label, seed) == ("fast", 11):
                row = row_without_episode("road", "p", seed, "crashed")
                about |= {"failure": "memory", "reason": "took more than 9 MB"}
            point = {"ego.goal_m": 100.0, "obstacles": [{"s_m": 1}]}
            about |= {"sweep": {"name": "s", "label": label, "point": point}}
            folder = run_folder(tmp_path, f"{label}{seed:02d}")
            folder.mkdir(parents=True)
            (folder / "manifest.json").write_text(json.dumps(about))
            (folder / "metrics.json").write_text(json.dumps(row))
    keys = "scenarios: [curved]\nplanners: [cruise]\nseeds: {first: 0, count: 12}\n"
    (tmp_path / "sweep.yaml").write_text(f"name: s\n{keys}")
    return tmp_path


def test_one_row_a_run_in_order(sweep):
    rows = results.rows(sweep)
    assert len(rows) == 24
    assert list(rows[0])[:4] == ["run_id", "label", "ego.goal_m", "obstacles"]
    assert [name for name in rows[0] if name in ALL_COLUMNS] == list(ALL_COLUMNS)
    assert [row["seed"] for row in rows if row["label"] == "fast"] == list(range(12))
    assert rows[0]["obstacles"] == '[{"s_m": 1}]'
    lost = [row for row in rows if row["failure"]]
    assert [row["reason"] for row in lost] == ["took more than 9 MB"]
    assert lost[0]["collisions"] is None


def test_new_runs_are_found_without_asking(sweep):
    results.rebuild(sweep)
    extra = run_folder(sweep, "zz")
    extra.mkdir(parents=True)
    for name in ("manifest.json", "metrics.json"):
        text = (run_folder(sweep, "fast00") / name).read_text()
        (extra / name).write_text(text)
    assert len(results.rows(sweep)) == 25


def test_damaged_run_is_named(sweep):
    (run_folder(sweep, "fast00") / "metrics.json").write_text("{")
    with pytest.raises(ResultsError, match=r"fast00/metrics\.json: cannot be read"):
        results.rebuild(sweep)


def test_sql(sweep):
    found = results.rows(sweep, "SELECT label, count(*) AS n FROM runs GROUP BY ALL")
    assert {row["label"]: row["n"] for row in found} == {"slow": 12, "fast": 12}
    for sql in ("SELECT nothing FROM runs", "SELEC", "SELECT 'a'::INT FROM runs"):
        with pytest.raises(ConfigError, match="--sql: ") as refusal:
            results.rows(sweep, sql)
        assert "\n" not in str(refusal.value)


def test_only_one_select_is_a_question(sweep, tmp_path):
    for sql in (
        "DROP TABLE runs",
        "SELECT 1; DROP TABLE runs",
        "DELETE FROM runs RETURNING seed",
        f"COPY runs TO '{tmp_path}/copy.csv'",
        "-- nothing",
    ):
        with pytest.raises(ConfigError, match=r"^--sql: allowed: one SELECT"):
            results.rows(sweep, sql)
    assert not (tmp_path / "copy.csv").exists()
    assert results.rows(sweep, "FROM runs WHERE label = 'slow';")


@pytest.mark.parametrize("where", ["sed < 9", "seed <", "seed < 9; DROP TABLE runs"])
def test_a_mistaken_condition_names_its_option(sweep, capsys, where):
    with pytest.raises(SystemExit):
        app(["compare", str(sweep), "--baseline", "slow", "--where", where])
    error = capsys.readouterr().err
    assert error.startswith("rearview: --where: ")
    assert error.count("\n") == 1


def test_dataframe_without_pyarrow(sweep):
    pytest.importorskip("pandas")
    frame = results.dataframe(sweep, "SELECT seed, travel_time_s FROM runs ORDER BY 1")
    assert list(frame.columns) == ["seed", "travel_time_s"]
    assert len(frame) == 24
    assert frame["travel_time_s"].isna().sum() == 1


def test_comparison_is_on_common_seeds(sweep):
    rows = results.rows(sweep)
    by_key = {(row["label"], row["seed"]): row for row in rows}
    lines = compare(rows, Question("slow", ["travel_time_s", "collided", "arrived"]))
    travel = next(x for x in lines if (x.metric, x.label) == ("travel_time_s", "fast"))
    assert (travel.runs, travel.pairs) == (11, 11)
    differences = [
        by_key["fast", seed]["travel_time_s"] - by_key["slow", seed]["travel_time_s"]
        for seed in range(11)
    ]
    assert travel.difference.value == pytest.approx(np.mean(differences))
    assert travel.difference.high < 0.0  # though the two overlap by far unpaired
    assert travel.value.high > 20.0 - 3.0
    collided = next(x for x in lines if (x.metric, x.label) == ("collided", "fast"))
    assert collided.difference.value == pytest.approx(-3 / 11)
    assert collided.p_value == pytest.approx(statistics.rates_p(3, 0))
    arrived = next(x for x in lines if (x.metric, x.label) == ("arrived", "fast"))
    assert (arrived.value.value, arrived.pairs) == (11 / 12, 12)


def test_p_values_are_corrected_together(sweep):
    lines = [
        x
        for x in compare(results.rows(sweep), Question("slow"))
        if x.p_value is not None
    ]
    corrected = statistics.holm([x.p_value for x in lines])
    assert [x.p_holm for x in lines] == corrected
    assert {x.test for x in lines} == {"score and McNemar", "t and bootstrap"}


def test_metric_that_applies_to_no_run_is_left_out(sweep):
    metrics = {line.metric for line in compare(results.rows(sweep), Question("slow"))}
    assert "travel_time_s" in metrics
    assert "min_ttc_s" not in metrics


def test_yes_and_no_is_a_rate(sweep):
    rows = results.rows(sweep)
    for row in rows:
        row["changed_before_blockage"] = row["seed"] % 3 == 0
    first, second = compare(rows, Question("slow", ["changed_before_blockage"]))
    assert (first.rate, second.test) == (True, "")
    assert first.value.value == pytest.approx(4 / 12)
    assert second.note.endswith("; no pair differs: not tested")
    assert "33.3 %" in as_markdown([first])


def test_medians(sweep):
    rows = results.rows(sweep)
    slow, fast = compare(
        rows, Question("slow", ["travel_time_s"], center=Center.MEDIAN)
    )[:2]
    times = [r["travel_time_s"] for r in rows if r["label"] == "slow"]
    assert slow.value.value == np.median(times)
    mean = compare(rows, Question("slow", ["travel_time_s"]))[1]
    assert fast.difference.value != mean.difference.value
    penalised = compare(
        rows, Question("slow", ["travel_time_s"], center=Center.MEDIAN)
    )[2]
    assert (penalised.metric, penalised.test) == (PENALISED, "sign")


def test_rows_are_sorted_by_size(sweep):
    for number, goal in enumerate((100.0, 9.0, 20.0)):
        folder = run_folder(sweep, f"fast{number:02d}")
        about = json.loads((folder / "manifest.json").read_text())
        about["sweep"]["point"]["ego.goal_m"] = goal
        (folder / "manifest.json").write_text(json.dumps(about))
    goals = [r["ego.goal_m"] for r in results.rows(sweep) if r["label"] == "fast"]
    assert goals == [9.0, 20.0, *[100.0] * 10]


def test_exports(sweep, tmp_path):
    lines = compare(
        results.rows(sweep), Question("slow", ["travel_time_s", "collided"])
    )
    read = list(csv.DictReader(io.StringIO(as_csv(lines))))
    planners = [row["planner"] for row in read if row["metric"] != PENALISED]
    assert planners == ["slow", "fast", "slow", "fast"]
    assert float(read[1]["difference"]) == lines[1].difference.value
    markdown = as_markdown(lines).splitlines()
    assert len({line.count("|") for line in markdown}) == 1
    latex = as_latex(lines)
    assert latex.count(r"\\") == 1 + len(lines)
    assert "travel time [s] & slow & " in latex
    assert r"collided [\%] & slow & " in latex
    assert "caption" not in latex
    whole = as_latex(lines, "5 % of a_b")
    assert r"\caption{5 \% of a\_b}" in whole
    assert whole.count(r"\begin{") == whole.count(r"\end{") == 2
    noted = as_latex([replace(lines[0], note="5 % lost"), *lines[1:]])
    assert r"& $p$ & note \\" in noted
    assert r" & 5 \% lost" in noted
    for text in (latex, noted):
        columns = text.split("{tabular}{")[1].splitlines()[0].partition("p{")[0]
        count = sum(sign in "lr" for sign in columns) + ("p{" in text)
        rows = [row for row in text.splitlines() if row.endswith(r"\\")]
        assert {row.count(" & ") for row in rows} == {count - 1}
    for name in ("t.csv", "t.md", "t.tex"):
        export(lines, tmp_path / name)
        assert (tmp_path / name).read_text()
    with pytest.raises(
        ConfigError, match=r"unknown suffix; allowed: \.csv, \.md, \.tex"
    ):
        export(lines, tmp_path / "t.xlsx")


def test_bad_names_are_refused(sweep):
    rows = results.rows(sweep)
    with pytest.raises(ConfigError, match="did you mean slow"):
        compare(rows, Question("slwo"))
    with pytest.raises(ConfigError, match="did you mean travel_time_s"):
        compare(rows, Question("slow", ["travel_time"]))
    with pytest.raises(ConfigError, match="no runs to compare"):
        compare([], Question("slow"))


def test_commands(sweep, capsys, tmp_path):
    def run(*arguments: str) -> str:
        app(arguments, standalone_mode=False)
        return capsys.readouterr().out

    assert "24" in run("results", str(sweep), "--sql", "SELECT count(*) FROM runs")
    rows = run("results", str(sweep), "--format", "json").splitlines()
    assert [json.loads(row)["runs"] for row in rows] == [12, 12]
    table = run("compare", str(sweep), "--baseline", "slow", "--metric", "collided")
    assert "25.0 %" in table
    target = tmp_path / "t.tex"
    run(
        "compare",
        str(sweep),
        "--baseline",
        "slow",
        "--where",
        "seed < 9",
        "-o",
        str(target),
    )
    assert r"\toprule" in target.read_text()


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT * FROM read_text('{file}')",
        "SELECT * FROM '{file}'",
        "SELECT * FROM glob('{folder}/*')",
        "SELECT * FROM read_csv('{file}')",
        "SELECT * FROM read_parquet('{results}')",
        "SELECT count(*) FROM runs WHERE label IN (SELECT content FROM "
        "read_text('{file}'))",
    ],
)
def test_sql_reads_no_file(sweep, tmp_path, sql):
    secret = tmp_path / "secret.csv"
    secret.write_text("a,b\n1,2\n")
    found = results.refresh(sweep)
    places = {"file": secret, "folder": tmp_path, "results": found}
    with pytest.raises(ConfigError, match="--sql: "):
        results.rows(sweep, sql.format(**places))
    where = f"WHERE label IN (SELECT content FROM read_text('{secret}'))"
    with pytest.raises(ConfigError, match="--where: "):
        results.rows(sweep, f"{results.ALL_RUNS} {where}", "--where")


SLOW = "SELECT count(*) FROM range(10000000) a, range(10000000) b WHERE a.range % 7 = 3"


def test_sql_has_a_time_limit(sweep, monkeypatch):
    monkeypatch.setattr(results, "SQL_TIME", 1.0)
    before = monotonic()
    with pytest.raises(ConfigError, match=r"^--sql: takes more than 1 s$"):
        results.rows(sweep, SLOW)
    assert monotonic() - before < 20.0


def test_ctrl_c_ends_a_query(sweep):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    started = monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            results.rows(sweep, SLOW)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    assert monotonic() - started < 20.0


def test_folders_named_like_partitions_do_not_change_the_rows(sweep):
    odd = sweep / "seed=77"
    odd.mkdir()
    for name in ("runs", "sweep.yaml"):
        (sweep / name).rename(odd / name)
    assert {row["seed"] for row in results.rows(odd)} == set(range(12))
