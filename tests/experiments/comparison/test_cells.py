"""Comparison in cells, seed by seed, and what is said where it cannot be made."""

import numpy as np
import pytest

from experiments.comparison.compare import PENALISED, Line, Question, compare
from experiments.comparison.inference import holm
from experiments.comparison.pairing import REPETITION, cells
from experiments.comparison.question import claimed
from experiments.comparison.table import as_csv, as_markdown, header
from experiments.config.sweep import SweepClaim
from experiments.errors import ConfigError
from experiments.metrics.row import row_without_episode

DENSITIES = ("light", "dense")
BEHIND = ("reason", "failure", "attempts", "exit_code", "trace_hash", "trace_kept")


def made_row(label: str, seed: int, density: str, travel: float | None) -> dict:
    row = dict.fromkeys(BEHIND) | {"wall_s": 1.0, "run_id": "x"}
    row |= row_without_episode("road", label, seed, "arrived")
    row |= {"label": label, "traffic.density": density, "arrived": travel is not None}
    return row | {"travel_time_s": travel, "collisions": 0, "planning_ms_p50": 1.0}


def made_rows(seeds: int = 20) -> list[dict]:
    """Two planners in two densities; the new one is slower in dense traffic only."""
    rng = np.random.default_rng(4)
    rows = []
    for density in DENSITIES:
        for seed in range(seeds):
            common = rng.normal(50.0, 5.0)
            late = 3.0 if density == "dense" else 0.0
            for label, more in (("old", 0.0), ("new", late)):
                travel = common + more + rng.normal(0.0, 1.0)
                rows.append(made_row(label, seed, density, travel))
    return rows


def of(lines: list[Line], metric: str, label: str = "new") -> list[Line]:
    return [line for line in lines if (line.metric, line.label) == (metric, label)]


def test_each_cell_is_compared_and_all_are_corrected_together():
    lines = compare(made_rows(), Question("old", ["travel_time_s"]))
    dense, light = of(lines, "travel_time_s")
    assert (dense.where, light.where) == ("density dense", "density light")
    assert (dense.pairs, light.pairs) == (20, 20)
    assert dense.difference.low > 1.0
    assert light.difference.low < 0.0 < light.difference.high
    assert [dense.p_holm, light.p_holm] == holm([dense.p_value, light.p_value])
    assert "where" in header(lines)


def test_pooled_cells_count_each_seed_once():
    (line,) = of(compare(made_rows(), Question("old", ["travel_time_s"], by=())), TIME)
    assert (line.runs, line.pairs, line.where) == (20, 20, "")


@pytest.mark.parametrize(("by", "found"), [(None, 2), ((), 1), (("scenario",), 1)])
def test_a_claim_says_what_is_told_apart(by, found):
    claim = SweepClaim(baseline="old", primary=(TIME,), by=by)
    lines = of(compare(made_rows(), claimed(claim, "old")), TIME)
    assert len(lines) == found
    assert (
        len(of(compare(made_rows(), claimed(claim, "old", ("scenario",))), TIME)) == 1
    )


TIME = "travel_time_s"


def test_repetitions_are_averaged_within_their_seed():
    rows = []
    for repetition, more in enumerate((-2.0, 2.0)):
        for row in made_rows():
            changed = {REPETITION: repetition, TIME: row[TIME] + more}
            rows.append(row | changed)
    many, few = (
        of(compare(given, Question("old", [TIME])), TIME)
        for given in (rows, made_rows())
    )
    for line, single in zip(many, few, strict=True):
        assert (line.runs, line.pairs) == (20, 20)
        assert line.difference.value == pytest.approx(single.difference.value)
        assert line.p_value == pytest.approx(single.p_value)
    assert [cell.name for cell in cells(rows)] == ["density dense", "density light"]


def test_only_the_family_is_corrected():
    rows = made_rows()
    for row in rows:
        row["min_clearance_m"] = row["travel_time_s"] ** 2
    asked = ["travel_time_s", "min_clearance_m"]
    lines = compare(rows, Question("old", asked, family=["travel_time_s"]))
    assert all(line.p_holm is not None for line in of(lines, "travel_time_s"))
    assert all(line.p_value is not None for line in of(lines, "min_clearance_m"))
    assert all(line.p_holm is None for line in of(lines, "min_clearance_m"))


def test_wall_clock_and_constants_are_not_tested():
    rows = made_rows()
    for row in rows:
        row["planning_ms_p50"] = float(row["label"] == "new") + row["seed"]
    lines = compare(rows, Question("old", ["planning_ms_p50", "collided"]))
    for line in of(lines, "planning_ms_p50"):
        assert line.p_value is None
        assert "measures the machine" in line.note
    for line in of(lines, "collided"):
        assert line.p_value is None
        assert line.note == "no pair differs: not tested"


def test_no_event_gives_the_rule_of_three():
    lines = of(compare(made_rows(), Question("old", ["collided"])), "collided")
    assert "below 13.9 % (rule of three)" in as_markdown(lines)


def test_a_planner_that_gives_up_is_not_fast():
    rows = made_rows()
    for row in rows:
        if row["label"] == "new" and row["seed"] < 8 and row[TIME] > 40.0:
            row |= {TIME: None, "arrived": False}
    lines = compare(rows, Question("old", [TIME], family=[TIME], penalty=300.0))
    plain, penalised = of(lines, TIME), of(lines, PENALISED)
    for line, instead in zip(plain, penalised, strict=True):
        assert line.pairs < 20
        assert "arrives less often" in line.note
        assert (line.p_value, line.p_holm) == (None, None)
        assert instead.pairs == 20
        assert instead.difference.value > 60.0
        assert instead.p_holm is not None
        assert "300 s where the ego did not arrive" in instead.note


def test_the_penalty_is_twice_the_longest_time_of_the_cell():
    rows = made_rows()
    longest = max(row[TIME] for row in rows if row["traffic.density"] == "dense")
    gone = next(
        r for r in rows if (r["label"], r["traffic.density"]) == ("new", "dense")
    )
    gone |= {TIME: None, "arrived": False}
    (line,) = of(compare(rows, Question("old", [TIME])), PENALISED)
    assert line.where == "density dense"
    assert f"{2.0 * longest:.4g} s" in line.note


def test_a_baseline_that_never_arrives_is_stated():
    rows = made_rows()
    for row in rows:
        if row["label"] == "old" and row["traffic.density"] == "dense":
            row |= {TIME: None, "arrived": False}
    lines = compare(rows, Question("old", [TIME, "arrived"]))
    dense, light = of(lines, TIME)
    assert dense.note == "old never arrives (0 of 20)"
    assert (dense.pairs, dense.difference, dense.p_value) == (0, None, None)
    assert light.p_value is not None
    assert of(lines, TIME, "old")[0].note == "applies to no run"
    assert of(lines, "arrived")[0].p_value < 0.001
    assert "old never arrives (0 of 20)" in as_csv(lines)


def test_few_seeds_are_said():
    for line in of(compare(made_rows(5), Question("old", [TIME])), TIME):
        assert line.note == "fewer than 6 seeds: not tested"
        assert not line.difference.known


def test_placebo_stands_beside_its_figure():
    rng = np.random.default_rng(1)
    rows = made_rows()
    for row in rows:
        row["behind_delay_mean_s"] = rng.normal(1.0, 0.1)
        row["placebo_delay_mean_s"] = rng.normal(0.0, 0.1)
        row["ahead_delay_mean_s"] = rng.normal(0.5, 0.1)
    asked = ["behind_delay_mean_s", "travel_time_s"]
    lines = compare(rows, Question("old", asked))
    for line in of(lines, "behind_delay_mean_s"):
        assert line.placebo.low < 0.0 < line.placebo.high
        assert line.placebo.high < line.ahead.low < line.ahead.high < line.value.low
    assert all(line.placebo is None for line in of(lines, "travel_time_s"))
    assert {"placebo", "far ahead"} < set(header(lines))


def test_an_unknown_column_to_split_by_is_refused():
    with pytest.raises(ConfigError, match=r"did you mean traffic\.density"):
        compare(made_rows(), Question("old", by=["traffic.densty"]))
