"""The page of a sweep in a real browser: choosing, hovering, following links."""

import shutil

import numpy as np
import pytest

from experiments.comparison.results import rows
from experiments.report.sweep.page import save_run_pages, save_sweep_page
from experiments.sweep.folder import run_folder
from experiments.trace.files import write_trace
from experiments.trace.road_map import RoadMap, write_map
from tests.experiments.report.browser import fits, violations
from tests.experiments.report.conftest import NARROW, WIDE
from tests.experiments.report.run_folders import (
    HOSTILE,
    driven_trace,
    write_sweep,
)
from tests.experiments.report.sweep.test_page import with_settings

pytestmark = [pytest.mark.slow, pytest.mark.browser]


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    folder = write_sweep(tmp_path_factory.mktemp("sweeps") / "made", seeds=5)
    trace = driven_trace(5)
    for row in rows(folder):
        own = run_folder(folder, row["run_id"])
        write_trace(trace, own)
        write_map(RoadMap(), own)
    save_run_pages(folder)
    save_sweep_page(folder)
    return folder


def mean_arrivals(folder):
    """Percent arrived by planner, then by target speed."""
    table = rows(folder)
    found = []
    for label in ("cruise", "old"):
        for speed in (8.0, 11.0):
            arrived = [
                row["arrived"]
                for row in table
                if (row["label"], row["ego.target_speed_mps"]) == (label, speed)
            ]
            found.append(f"{100 * sum(arrived) / len(arrived):.0f} %")
    assert len(set(found)) > 1
    return found


def test_points_lead_to_the_page_of_their_run(sweep, show):
    page = show(sweep / "report.html").page
    canvas = page.locator("#scatter")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    point = page.evaluate("window.rearview.scatter.points[7]")
    page.mouse.move(box["x"] + point["px"], box["y"] + point["py"])
    hint = page.locator("#scatter-hint").inner_text()
    assert "travel time" in hint
    assert "seed" in hint
    page.mouse.click(box["x"] + point["px"], box["y"] + point["py"])
    run_id = page.evaluate(f"window.rearview.sweep.ids[{point['row']}]")
    assert page.locator("#chosen-id").inner_text() == run_id
    assert run_id in page.locator("#chosen-command").inner_text()
    page.locator("#chosen-link").click()
    page.wait_for_url(f"**/{run_id}/report.html")
    assert page.locator("#play").inner_text() == "Play"


def test_failures_lead_to_their_run(sweep, show):
    page = show(sweep / "report.html").page
    page.locator("summary").first.click()
    link = page.locator("li a").first
    place = link.get_attribute("href")
    assert link.inner_text() == "page"
    link.click()
    page.wait_for_url(f"**/{place}")


def test_the_arrow_keys_go_from_run_to_run(sweep, show):
    page = show(sweep / "report.html").page
    page.locator("#scatter").focus()
    seen = []
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
        seen.append(page.locator("#chosen-id").inner_text())
    assert seen[0] == seen[2] != seen[1]
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "chosen-link"


def test_what_is_chosen_is_drawn(sweep, show):
    page = show(sweep / "report.html").page
    label = page.locator("#distribution").get_attribute("aria-label")
    assert "travel time [s]" in label
    assert "curved · old median" in label
    page.locator("#distribution-metric").select_option("min_clearance_m")
    label = page.locator("#distribution").get_attribute("aria-label")
    assert "min clearance [m]" in label
    page.locator("#heat-x").select_option(label="ego.target_speed_mps")
    page.locator("#heat-y").select_option(label="planner")
    page.locator("#heat-metric").select_option("arrived")
    cells = page.locator("#heat td").all_inner_texts()
    assert cells == mean_arrivals(sweep)
    page.locator("#planning-metric").select_option("planning_ms_max")
    items = page.locator("#planning-words li").all_inner_texts()
    late = sum(row["planning_ms_max"] > 100.0 for row in rows(sweep))
    assert late > 0
    assert sum(int(item.split(" in ")[1].split()[0]) for item in items) == late


def test_filters_hold_for_every_plot(sweep, show):
    page = show(sweep / "report.html").page
    assert page.locator("#filtered").inner_text() == "all 40 runs"
    page.locator("#filter-0").select_option("curved")
    page.locator("#filter-2").select_option("11")
    assert page.locator("#filtered").inner_text() == "10 of 40 runs"
    kept = [
        row
        for row in rows(sweep)
        if (row["scenario"], row["ego.target_speed_mps"]) == ("curved", 11.0)
    ]
    arrived = [row for row in kept if row["arrived"]]
    assert page.evaluate("rearview.scatter.points.length") == 10
    lacking = page.locator("#lacking").inner_text()
    assert lacking == f"{len(kept) - len(arrived)} without a value, at the border"
    own = [row["travel_time_s"] for row in arrived if row["label"] == "old"]
    means = page.locator("#means").get_attribute("aria-label")
    assert f"old {np.mean(own):.1f} of {len(own)}" in means
    page.locator("#filter-1").select_option("old")
    assert "no pairs" in page.locator("#pairs").get_attribute("aria-label")


def test_settings_of_planners_are_filters_and_part_no_pairs(tmp_path, show):
    folder = write_sweep(tmp_path / "made", seeds=3)
    with_settings(folder)
    page = show(save_sweep_page(folder)).page
    page.locator("#pairs-metric").select_option("min_clearance_m")
    label = page.locator("#pairs").get_attribute("aria-label")
    assert label.count("of 6 pairs") == 2, "one for each scenario"
    page.locator("#filter-3").select_option("3.5")
    assert page.locator("#filtered").inner_text() == "12 of 24 runs"
    page.locator("#heat-x").select_option(label="gap")
    assert page.locator("#heat th[scope=col]").all_inner_texts()[1:] == ["2", "3.5"]


def test_pairs_are_differences_on_common_seeds(sweep, show):
    page = show(sweep / "report.html").page
    page.locator("#filter-0").select_option("straight")
    page.locator("#pairs-metric").select_option("min_clearance_m")
    label = page.locator("#pairs").get_attribute("aria-label")
    value = {
        (r["label"], r["seed"], r["ego.target_speed_mps"]): r["min_clearance_m"]
        for r in rows(sweep)
        if r["scenario"] == "straight"
    }
    pairs = [
        value["old", seed, speed] - value["cruise", seed, speed]
        for label, seed, speed in value
        if label == "old"
    ]
    assert f"old {np.mean(pairs):.2f} of 10 pairs" in label


def test_a_chosen_run_can_be_replayed_over_others(sweep, show):
    page = show(sweep / "report.html").page
    page.locator("#scatter").focus()
    chosen = []
    for _ in range(2):
        page.keyboard.press("ArrowRight")
        chosen.append(page.locator("#chosen-id").inner_text())
    row = {row["run_id"]: row for row in rows(sweep)}
    own = row[chosen[1]]
    words = page.locator("#overlay-command").inner_text().split()
    assert words[:2] == ["rearview", "compare-runs"]
    keys = ("scenario", "seed", "ego.target_speed_mps")
    assert [row[name]["label"] for name in words[3:]] == ["cruise", "old"]
    assert all(row[name][key] == own[key] for name in words[3:] for key in keys)
    assert page.locator("#overlay-two-command").inner_text().split()[3:] == chosen


def test_intervals_are_those_of_student(sweep, show):
    from scipy import stats

    page = show(sweep / "report.html").page
    for freedom in (1, 5, 9, 10, 15, 30, 200):
        found = page.evaluate(f"rearview.studentT({freedom})")
        assert found == pytest.approx(stats.t.ppf(0.975, freedom), rel=2e-3)


def test_a_sweep_with_one_planner_has_no_plots_without_meaning(tmp_path, show):
    folder = write_sweep(tmp_path / "made", seeds=3)
    for row in rows(folder):
        if (row["label"], row["scenario"]) != ("cruise", "curved"):
            shutil.rmtree(run_folder(folder, row["run_id"]))
    page = show(save_sweep_page(folder)).page
    assert page.locator("#pairs-part").is_hidden()
    assert page.locator("#heat-part").is_hidden()
    assert page.locator("#filters select").count() == 1


def test_hostile_reasons_run_nothing(tmp_path, show):
    folder = write_sweep(tmp_path / "made", seeds=5, reason=HOSTILE)
    page = show(save_sweep_page(folder)).page
    page.locator("#scatter").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("window.hacked") is None
    assert page.locator("img").count() == 0
    assert "hacked" in page.locator("td.wide").first.inner_text()


def test_a_sweep_without_runs_is_a_whole_page(tmp_path, show):
    folder = write_sweep(tmp_path / "made", seeds=0)
    page = show(save_sweep_page(folder)).page
    assert "There are no runs" in page.locator(".notice").inner_text()


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_off_and_axe_finds_nothing(sweep, show, size, scheme):
    page = show(sweep / "report.html", size, scheme).page
    assert fits(page, size)
    for summary in page.locator("summary").all():
        summary.click()
    page.locator("#scatter").focus()
    page.keyboard.press("ArrowRight")
    assert violations(page) == []
