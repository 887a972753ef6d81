"""The page that compares runs, in a real browser."""

import csv
import io
from pathlib import Path

import pytest

from experiments.report.compared.page import save_comparison
from tests.experiments.report.browser import (
    fits,
    frames_in_half_a_second,
    settle,
    until,
    violations,
    watch_shifts,
)
from tests.experiments.report.conftest import HUGE, NARROW, WIDE
from tests.experiments.report.run_folders import driven_trace, write_run

pytestmark = [pytest.mark.slow, pytest.mark.browser]


@pytest.fixture(scope="module")
def comparison(tmp_path_factory):
    """Three planners, 100 vehicles each; the second run ends earlier."""
    parent = tmp_path_factory.mktemp("runs")
    folders = [
        write_run(parent / name, driven_trace(n, n_cars=100), planner=name)
        for name, n in (("cruise", 301), ("mine", 201), ("other", 301))
    ]
    return save_comparison(folders, parent / "comparison.html")[0]


def test_thirty_frames_a_second_with_three_overlaid_planners(comparison, show):
    page = show(comparison).page
    settle(page)
    page.locator("#play").click()
    count = frames_in_half_a_second(page, 4)
    print("frames in the best half second:", count)  # noqa: T201
    assert count >= 15


def test_scene_charts_and_events_follow_one_clock(comparison, show):
    page = show(comparison).page
    settle(page)
    page.keyboard.press("End")
    settle(page)
    assert page.locator("#clock").inner_text() == "30.0 of 30.0 s"
    values = page.locator("figure.chart output").first.inner_text().split(" · ")
    assert len(values) == 3
    assert values[1] == "\u2013", "this run has ended"
    page.keyboard.press("Home")
    first = page.evaluate("rearview.events.find(({step}) => step > 0).step")
    page.keyboard.press(".")
    assert page.evaluate("rearview.player.step") == first
    page.locator("tr[title=min_clearance_m] a").nth(1).click()
    t = page.evaluate("rearview.player.t")
    assert page.url.endswith(f"#t={t:g}")


def test_traffic_and_view_can_be_chosen(comparison, show):
    page = show(comparison).page
    settle(page)
    drawn = "rearview.scene.canvas.toDataURL()"
    before = page.evaluate(drawn)
    for box in page.locator("input[data-traffic]").all():
        box.uncheck()
    settle(page)
    assert page.evaluate(drawn) != before
    page.keyboard.press("b")
    settle(page)
    assert page.evaluate("rearview.shown.apart")
    page.locator("#followed").select_option("1")
    page.locator("#time").fill("250")
    settle(page)
    ego = page.evaluate("rearview.scene.egoAt(20, 1).x")
    assert page.evaluate("rearview.camera.x") == pytest.approx(ego, abs=0.1)
    page.locator("#colour").select_option("speed")
    assert page.locator("#legend-speed").is_visible()


def test_curves_of_all_runs_and_the_moment_can_be_taken_along(comparison, show):
    page = show(comparison).page
    page.evaluate(
        "Object.defineProperty(navigator, 'clipboard', { value: {"
        " writeText: (text) => { window.copied = text; return Promise.resolve(); } } })"
    )
    page.locator("#time").fill("250")
    page.locator("#apart").check()
    page.locator("#link").click()
    assert page.evaluate("window.copied").endswith("#t=25&show=apart")
    with page.expect_download() as download:
        page.locator("#csv").click()
    text = Path(download.value.path()).read_text(encoding="utf-8")
    rows = list(csv.reader(io.StringIO(text)))
    places = [rows[0].index(f"speed: {name} [m/s]") for name in ("cruise", "mine")]
    assert rows[251][places[0]] != ""
    assert rows[251][places[1]] == "", "this run has ended"


@pytest.mark.parametrize(
    ("size", "scheme"),
    [(WIDE, "light"), (NARROW, "dark"), (HUGE, "light")],
    ids=["wide", "narrow", "huge"],
)
def test_it_fits_says_nothing_serious_to_axe_and_stands_still(
    comparison, show, size, scheme
):
    page = show(comparison, size, scheme).page
    settle(page)
    assert fits(page, size)
    watch_shifts(page)
    page.locator("#time").fill("200")
    page.locator("#speed").select_option("8")
    page.locator("#play").click()
    until(page, "rearview.player.step === 300")
    assert page.evaluate("window.shifts") == []
    assert violations(page) == []
