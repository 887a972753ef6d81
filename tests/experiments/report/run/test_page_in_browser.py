"""The page of a run in a real browser: what is drawn, and what hands can do."""

import csv
import io
import json
import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from experiments.episode.run_folder import OutputOptions
from experiments.metrics.events import events
from experiments.metrics.moments import moments
from experiments.report.run.page import save_run_page
from experiments.report.run_reader import numbers
from experiments.trace.files import read_trace
from experiments.trace.schema import Kind, column
from planner.interface import PlanStats
from planner.scene import Obstacles
from tests.experiments.report.browser import (
    fits,
    frames_in_half_a_second,
    settle,
    until,
    violations,
    watch_shifts,
)
from tests.experiments.report.conftest import NARROW, WIDE
from tests.experiments.report.run_folders import HOSTILE, driven_trace, write_run

pytestmark = [pytest.mark.slow, pytest.mark.browser]

EGO = (0, 114, 178)  # colours of the light theme
OBSTACLE = (74, 74, 74)
OBSTACLES = Obstacles(
    ("wall",), *(np.array([v]) for v in (30.0, 2.0, 0.3, 4.0, 1.5, 0.0))
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    write_run(folder, with_fallbacks(driven_trace(91, obstacles=OBSTACLES)))
    save_run_page(folder)
    return folder


def with_fallbacks(trace):
    """Two stretches without a fresh plan: events to go to."""
    said = np.ma.filled(trace.steps["plan_status"], None).tolist()
    said[20:25] = ["full_stop"] * 5
    said[60:63] = ["emergency_braking"] * 3
    steps = {**trace.steps, "plan_status": column(said, Kind.TEXT)}
    return replace(trace, steps=steps)


def step_of(page):
    return page.evaluate("window.rearview.player.step")


def pixels(page):
    """The scene as (height, width, 3)."""
    settle(page)
    page.evaluate("document.querySelector('.zoom').style.visibility = 'hidden'")
    shot = page.locator("#scene").screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def blob(image, colour):
    """Centre (x, y) and number of the pixels of a colour."""
    rows, columns = np.nonzero(np.abs(image - colour).max(axis=2) <= 4)
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5]), rows.size


def placed(camera, x, y):
    """Where a place in metres should be on the screenshot."""
    return np.array(
        [
            camera["width"] / 2 + (x - camera["x"]) * camera["scale"],
            camera["height"] / 2 - (y - camera["y"]) * camera["scale"],
        ]
    )


def test_ego_and_obstacle_are_drawn_where_the_trace_has_them(run, show):
    page = show(run / "report.html").page
    trace = read_trace(run)
    offset = trace.fact("length_m") / 2 - trace.fact("rear_overhang_m")
    page.locator("#whole").click()
    page.locator("#plan").uncheck()
    for step in (0, 33, 90):
        page.evaluate(f"window.rearview.player.goToStep({step})")
        image = pixels(page)
        camera = page.evaluate(
            "(({x, y, scale, width, height}) => ({x, y, scale, width, height}))"
            "(window.rearview.camera)"
        )
        x, y, heading = (
            numbers(trace.steps[key])[step] for key in ("x_m", "y_m", "heading_rad")
        )
        centre, size = blob(image, EGO)
        middle = x + offset * math.cos(heading), y + offset * math.sin(heading)
        assert np.abs(centre - placed(camera, *middle)).max() < 1.5
        area = trace.fact("length_m") * trace.fact("width_m") * camera["scale"] ** 2
        assert 0.6 * area < size < 1.1 * area  # edges are blended, the front is a bar
    centre, size = blob(image, OBSTACLE)
    assert np.abs(centre - placed(camera, 30.0, 2.0)).max() < 1.5
    assert 0.6 < size / (4.0 * 1.5 * camera["scale"] ** 2) < 1.1


def test_it_plays_at_the_speed_chosen_and_stops_at_the_end(run, show):
    page = show(run / "report.html").page
    page.locator("#speed").select_option("2")
    before = page.evaluate("[performance.now(), window.rearview.player.t]")
    page.locator("#play").click()
    assert page.locator("#play").inner_text() == "Pause"
    page.wait_for_timeout(1500)
    after = page.evaluate("[performance.now(), window.rearview.player.t]")
    rate = (after[1] - before[1]) / (after[0] - before[0]) * 1e3
    assert 1.2 < rate < 2.05
    page.locator("#speed").select_option("8")
    until(page, "window.rearview.player.step === 90")
    until(page, "document.getElementById('play').textContent === 'Play'")
    assert page.locator("#clock").inner_text() == "9.0 of 9.0 s"


def test_slider_charts_and_facts_follow_one_clock(run, show):
    page = show(run / "report.html").page
    page.locator("#time").fill("45")
    settle(page)
    trace = read_trace(run)
    speed = f"{numbers(trace.steps['speed_mps'])[45]:.2f}"
    assert page.locator("#fact-speed").inner_text() == f"{speed} m/s"
    assert page.locator("figure.chart output").first.inner_text() == speed
    assert page.locator("#fact-blocker").inner_text() == "car.1"
    assert page.locator("#removed").inner_text().split() == [
        *("kept", "30"),
        *("collision", "8"),
        *("road", "2"),
    ]
    chart = page.locator(".chart-box").nth(3)
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    left, right = box["x"] + 46, box["x"] + box["width"] - 10
    page.mouse.move(left + 0.2 * (right - left), box["y"] + 50)
    settle(page)
    assert page.locator("figure.chart output").nth(3).inner_text().startswith("t = 1.8")
    assert step_of(page) == 45, "hovering does not move the clock"
    page.mouse.down()
    page.mouse.move(left + 0.8 * (right - left), box["y"] + 50, steps=4)
    page.mouse.up()
    settle(page)
    assert step_of(page) == 72
    assert page.locator("#time").input_value() == "72"
    cursor = page.locator(".cursor").first.bounding_box()["x"]
    box = page.locator(".chart-box").first.bounding_box()
    share = (cursor - box["x"] - 46) / (box["width"] - 56)
    assert share == pytest.approx(0.8, abs=0.01)


def test_events_lead_through_the_run(run, show):
    page = show(run / "report.html").page
    settle(page)
    found = events(read_trace(run))
    assert page.locator("#events button").count() == len(found) > 2
    assert page.locator("#marks i").count() == len(found)
    steps = sorted({event.step for event in found if event.step > 0})
    for step in steps:
        page.keyboard.press(".")
        settle(page)
        assert step_of(page) == step
        current = page.locator("#events button[aria-current]")
        last = [event for event in found if event.step <= step][-1]
        assert current.inner_text().endswith(last.text)
    page.keyboard.press(",")
    assert step_of(page) == steps[-2]
    page.locator("#event-after").click()
    assert step_of(page) == steps[-1]
    page.locator("#events button").first.click()
    assert step_of(page) == found[0].step
    page.keyboard.press("Home")
    page.keyboard.press(",")
    assert step_of(page) == 0, "there is no event before the first"


def test_a_metric_leads_to_its_moment(run, show):
    page = show(run / "report.html").page
    settle(page)
    for name, step in moments(read_trace(run)).items():
        page.keyboard.press("Home")
        page.locator(f"tr[title={name}] a").click()
        settle(page)
        assert step_of(page) == step, name
    page.locator("tr[title=min_clearance_m] a").click()  # the same address again
    settle(page)
    assert step_of(page) == moments(read_trace(run))["min_clearance_m"]


def test_a_moment_a_picture_and_data_can_be_taken_along(run, show):
    page = show(run / "report.html").page
    page.evaluate(
        "Object.defineProperty(navigator, 'clipboard', { value: {"
        " writeText: (text) => { window.copied = text; return Promise.resolve(); } } })"
    )
    page.locator("#time").fill("42")
    page.locator("#names").check()
    page.locator("#link").click()
    address = page.evaluate("window.copied")
    assert address.endswith("report.html#t=4.2&show=names")
    assert page.locator("#link").inner_text() == "copied"

    def saved(button):
        with page.expect_download() as download:
            page.locator(button).click()
        return Path(download.value.path()).read_bytes()

    picture = np.asarray(Image.open(io.BytesIO(saved("#png"))).convert("RGB")).astype(
        int
    )
    assert blob(picture, EGO)[1] > 100
    rows = list(csv.reader(io.StringIO(saved("#csv").decode())))
    speed = rows[0].index("speed [m/s]")
    np.testing.assert_allclose(
        [float(row[speed]) for row in rows[1:]],
        numbers(read_trace(run).steps["speed_mps"]),
        atol=1e-3,
    )
    drawn = ElementTree.fromstring(saved("#svg").decode())
    assert "speed [m/s]" in [node.text for node in drawn.iter()]


def test_colours_the_camera_and_the_ruler(run, show):
    page = show(run / "report.html").page
    page.locator("#time").fill("30")
    plain = pixels(page)
    for name in ("braking", "speed", "type"):
        page.locator("#colour").select_option(name)
        changed = np.abs(pixels(page) - plain).max() > 50
        assert changed == (name != "braking"), "nobody brakes here"
        assert page.locator(f"#legend-{name}").is_visible()
    fills = page.evaluate(
        "[-4, -1, 0, 1].map((acceleration) =>"
        " rearview.scene.fillOf({ acceleration }, 'braking'))"
    )
    assert len(set(fills)) == 4
    page.locator("#colour").select_option("plain")
    page.keyboard.press("u")
    settle(page)
    ahead = page.evaluate(
        "(() => { const {scene, camera, player} = window.rearview;"
        "const ego = scene.egoAt(player.t);"
        "return camera.toScreen(ego.x + 20 * Math.cos(ego.heading),"
        " ego.y + 20 * Math.sin(ego.heading)); })()"
    )
    camera = page.evaluate("[rearview.camera.width, rearview.camera.height]")
    assert ahead[0] == pytest.approx(camera[0] / 2, abs=20)
    assert ahead[1] < camera[1] / 2 - 100
    turned = page.evaluate(
        "(() => { const {camera} = window.rearview;"
        "return camera.toScreen(...camera.toWorld(123, 45)); })()"
    )
    assert turned == pytest.approx([123, 45])
    box = page.locator("#scene").bounding_box()
    page.keyboard.press("m")
    page.mouse.move(box["x"] + 200, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 320, box["y"] + 100, steps=3)
    page.mouse.up()
    length = page.evaluate(
        "(() => { const [a, b] = rearview.ruler.ends;"
        "return Math.hypot(a[0] - b[0], a[1] - b[1]); })()"
    )
    scale = page.evaluate("rearview.camera.scale")
    assert length == pytest.approx(120 / scale, rel=0.02)
    assert page.locator("#follow").is_checked(), "measuring does not pan"
    assert page.locator("#measured").inner_text() == f"{length:.2f} m"
    page.keyboard.press("Enter")  # the keys do it too: here ...
    page.keyboard.press("d")  # ... 60 pixels on ...
    settle(page)
    page.keyboard.press("Enter")  # ... to there
    page.keyboard.press("d")
    settle(page)
    assert page.locator("#measured").inner_text() == f"{60 / scale:.2f} m"
    page.keyboard.press("m")
    settle(page)
    assert page.locator("#measured").is_hidden()


def test_panels_are_resized_by_hand_and_by_keys(run, show):
    page = show(run / "report.html").page
    settle(page)
    height = "document.querySelector('.scene-box').offsetHeight"
    width = "document.querySelector('.events').offsetWidth"
    before = page.evaluate(f"[{height}, {width}, window.rearview.camera.width]")
    page.locator("#taller").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.locator("#wider").focus()
    page.keyboard.press("ArrowLeft")
    settle(page)
    settle(page)
    after = page.evaluate(f"[{height}, {width}, window.rearview.camera.width]")
    assert after[0] == pytest.approx(before[0] + 40, abs=2)
    assert after[1] == pytest.approx(before[1] + 20, abs=2)
    assert after[2] == pytest.approx(before[2] - 20, abs=2), "the scene follows"
    assert step_of(page) == 0, "these keys are those of the bars"
    box = page.locator("#taller").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 5)
    page.mouse.down()
    page.mouse.move(box["x"] + 200, box["y"] - 45, steps=3)
    page.mouse.up()
    assert page.evaluate(height) == pytest.approx(before[0] - 10, abs=2)
    page.locator("#taller").dblclick()
    assert page.evaluate(height) == pytest.approx(before[0], abs=1)


def test_indicators_types_and_what_the_ego_believes(tmp_path, show):
    trace = driven_trace(31)
    n = len(trace.vehicles["index"])
    looks = [(0, "car.0", "bus", ""), (0, "car.1", "passenger", "left")]
    looks += [(10, "car.0", "bus", "right"), (20, "car.1", "passenger", "")]
    names = ("index", "id", "kind", "indicator")
    kinds = (Kind.COUNT, Kind.TEXT, Kind.TEXT, Kind.TEXT)
    table = zip(names, kinds, zip(*sorted(looks), strict=True), strict=True)
    seen = np.ma.getdata(trace.vehicles["id"]) != "car.2"
    believed = {key: trace.vehicles[key][seen] for key in trace.perceived}
    believed["x_m"] = believed["x_m"] + 0.5
    trace = replace(
        trace,
        looks={name: column(values, kind) for name, kind, values in table},
        perceived=believed,
    )
    assert n == 93
    folder = write_run(tmp_path / "run", trace)
    page = show(save_run_page(folder)).page
    settle(page)
    shown = page.evaluate(
        "[0, 1.5, 2.5].map((t) => rearview.scene.bodies(t).map((b) => b.indicator))"
    )
    assert shown == [[0, 2, 0], [1, 2, 0], [1, 0, 0]]
    types = page.evaluate(
        "rearview.scene.bodies(0).map((b) => rearview.scene.fillOf(b, 'type'))"
    )
    assert types[0] != types[1] == types[2]
    assert page.evaluate("rearview.scene.believed(3).map(({ id }) => id)") == [
        "car.0",
        "car.1",
    ]
    with_beliefs = pixels(page)
    page.keyboard.press("b")
    assert np.abs(pixels(page) - with_beliefs).max() > 50
    assert page.locator("figure.chart", has_text="perception error").count() == 1


def test_a_film_of_a_span_is_saved(run, show):
    page = show(run / "report.html").page
    page.locator("#speed").select_option("8")
    page.locator("#time").fill("60")
    with page.expect_download() as download:
        page.locator("#film").click()
        assert page.locator("#film").inner_text() == "end of the film"
    film = Path(download.value.path()).read_bytes()
    assert download.value.suggested_filename == "made_up_cruise_seed_3.webm"
    assert film[:4] == b"\x1aE\xdf\xa3"
    assert step_of(page) == 90, "it ends where the run does"
    assert page.locator("#film").inner_text() == "film from here"


def test_a_link_may_name_a_moment(run, show):
    page = show(run / "report.html").page
    address = (run / "report.html").resolve().as_uri()
    page.goto("data:,")
    page.goto(f"{address}#t=4.2&show=names,nonsense")
    settle(page)
    assert step_of(page) == 42
    assert page.locator("#names").is_checked()


def test_zoom_pan_and_follow(run, show):
    page = show(run / "report.html").page
    settle(page)
    camera = "[window.rearview.camera.scale, window.rearview.camera.x]"
    scale, x = page.evaluate(camera)
    page.locator("#zoom-in").click()
    assert page.evaluate(camera)[0] == pytest.approx(1.5 * scale)
    box = page.locator("#scene").bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 100)
    page.mouse.wheel(0, 400)
    settle(page)
    assert page.evaluate(camera)[0] == pytest.approx(1.5 * scale / math.e, rel=1e-3)
    assert page.locator("#follow").is_checked()
    scale, x = page.evaluate(camera)
    page.mouse.down()
    page.mouse.move(box["x"] + 400, box["y"] + 100, steps=5)
    page.mouse.up()
    assert not page.locator("#follow").is_checked()
    assert page.evaluate(camera)[1] == pytest.approx(x - 100 / scale)
    under = "window.rearview.camera.toWorld(300, 100)"
    before = page.evaluate(under)
    page.mouse.move(box["x"] + 300, box["y"] + 100)
    page.mouse.wheel(0, -200)
    settle(page)
    pixel = 1.0 / page.evaluate(camera)[0]  # a mouse moves by whole ones
    np.testing.assert_allclose(page.evaluate(under), before, atol=pixel)
    page.locator("#follow").check()
    page.locator("#time").fill("60")
    settle(page)
    ego = page.evaluate("window.rearview.scene.egoAt(window.rearview.player.t).x")
    assert page.evaluate(camera)[1] == pytest.approx(ego)


def test_hovering_a_body_says_what_it_is(run, show):
    page = show(run / "report.html").page
    settle(page)
    box = page.locator("#scene").bounding_box()
    for name, place in (("ego", "egoAt(0)"), ("car.2", "bodies(0)[2]")):
        x, y = page.evaluate(
            f"(() => {{ const {{x, y}} = window.rearview.scene.{place};"
            "return window.rearview.camera.toScreen(x, y); })()"
        )
        page.mouse.move(box["x"] + x + 1, box["y"] + y + 1)
        assert page.locator("#hint").inner_text().startswith(f"{name}: ")
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    assert page.locator("#hint").is_hidden()


def test_the_keyboard_alone_will_do(run, show):
    page = show(run / "report.html").page
    settle(page)
    press = page.keyboard.press
    press("ArrowRight")
    press("ArrowRight")
    assert step_of(page) == 2
    press("Shift+ArrowRight")
    press("ArrowLeft")
    assert step_of(page) == 11
    press("End")
    assert step_of(page) == 90
    press("Home")
    assert step_of(page) == 0
    press("]")
    assert page.evaluate("window.rearview.player.speed") == 2
    press("Space")
    until(page, "window.rearview.player.step > 2")
    press("Space")
    assert not page.evaluate("window.rearview.player.playing")
    scale = page.evaluate("window.rearview.camera.scale")
    press("+")
    assert page.evaluate("window.rearview.camera.scale") == pytest.approx(1.25 * scale)
    for key, name in (("p", "plan"), ("g", "ghost"), ("n", "names"), ("f", "follow")):
        before = page.evaluate(f"window.rearview.shown.{name}")
        press(key)
        assert page.evaluate(f"window.rearview.shown.{name}") is not before
    reached = set()
    for _ in range(40):
        press("Tab")
        reached.add(page.evaluate("document.activeElement.id"))
        outline = "getComputedStyle(document.activeElement).outlineStyle"
        if page.evaluate("document.activeElement !== document.body"):
            assert page.evaluate(outline) != "none"
    for name in ("zoom-in", "whole", "play", "back", "on", "speed", "time", "follow"):
        assert name in reached
    page.locator("#play").focus()
    press("Space")  # the button's own, once and not twice
    assert page.evaluate("window.rearview.player.playing")


def test_first_paint_and_thirty_frames_a_second_at_a_hundred_vehicles(tmp_path, show):
    folder = write_run(tmp_path / "run", driven_trace(301, n_cars=100))
    page = show(save_run_page(folder)).page
    settle(page)
    until(page, "performance.getEntriesByType('paint').length > 0")
    paint = page.evaluate("performance.getEntriesByType('paint')[0].startTime")
    assert paint < 2000
    page.locator("#play").click()
    assert frames_in_half_a_second(page, 4) >= 15


def test_hostile_names_run_nothing_and_are_shown_as_they_are(tmp_path, show):
    stats = PlanStats(reason=HOSTILE, removed={HOSTILE: 1}, blocker=HOSTILE)
    trace = driven_trace(9, name=HOSTILE, stats=stats)
    folder = write_run(tmp_path / "run", trace, scenario=HOSTILE, reason=HOSTILE)
    page = show(save_run_page(folder)).page
    page.locator("#names").check()
    settle(page)
    assert page.evaluate("window.hacked") is None
    assert page.locator("#fact-reason").inner_text() == HOSTILE
    assert page.locator("#fact-blocker").inner_text() == HOSTILE
    assert HOSTILE in page.locator("h1").inner_text()
    assert page.locator("img").count() == 0


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_off_or_overlaps(run, show, size, scheme):
    page = show(run / "report.html", size, scheme).page
    settle(page)
    assert fits(page, size)
    selector = "button, select, input, label, h1, h2, figure, #clock, summary"
    boxes = page.evaluate(
        """selector => [...document.querySelectorAll(selector)].map(node => {
          const {left, top, right, bottom} = node.getBoundingClientRect();
          return {name: node.id || node.textContent.trim().slice(0, 30),
                  left, top, right, bottom, inside: node.closest('label') !== null
                    && node.tagName !== 'LABEL'};
        }).filter(box => box.right > box.left)""",
        selector,
    )
    for index, box in enumerate(boxes):
        assert box["left"] >= 0, box
        assert box["right"] <= size["width"], box
        for other in boxes[:index]:
            if box["inside"] or other["inside"]:
                continue
            apart = (
                box["left"] >= other["right"] - 0.5
                or other["left"] >= box["right"] - 0.5
                or box["top"] >= other["bottom"] - 0.5
                or other["top"] >= box["bottom"] - 0.5
            )
            assert apart, (box, other)


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(run, show, size, scheme):
    page = show(run / "report.html", size, scheme).page
    settle(page)
    for summary in page.locator("summary").all():
        summary.click()
    assert violations(page) == []


@pytest.mark.sumo
@pytest.mark.parametrize(
    "name",
    ["straight", "curved", "intersection", "u_shaped", "lane_change", "dense"],
)
def test_pages_of_runs_on_each_road(tmp_path, show, name):
    scenario = load_scenario(name, overrides=["simulation.duration_s=12"])
    output = OutputOptions(keeps_candidates=True)
    folder = run_episode(scenario, out=tmp_path, output=output).folder
    page = show(save_run_page(folder)).page
    page.locator("#time").fill("60")
    if page.locator("#candidates").count():
        page.locator("#candidates").check()
    if name == "lane_change":
        words = page.locator("#graph").get_attribute("aria-label")
        assert words.startswith("s-T graph: ")
        assert " m in " in words
    if name == "dense":
        assert "sides " in page.locator("#fact-reason").inner_text()
    image = pixels(page)
    centre, _ = blob(image, EGO)
    middle = np.array([image.shape[1], image.shape[0]]) / 2
    assert np.abs(centre - middle).max() < 2.5, "the camera follows the ego"
    page.locator("#play").click()
    until(page, "window.rearview.player.step > 65")


@pytest.mark.parametrize("size", [WIDE, NARROW])
def test_nothing_jumps_while_the_page_plays(tmp_path, show, size):
    run = write_run(tmp_path / "run", changing_trace())
    save_run_page(run)
    page = show(run / "report.html", size=size).page
    settle(page)
    watch_shifts(page)
    heights = set()
    for step in range(40):
        page.evaluate(f"window.rearview.player.goToStep({step})")
        settle(page)
        heights.add(page.evaluate("document.documentElement.scrollHeight"))
        tops = page.evaluate(
            "[...document.querySelectorAll('.charts, .chart, .summary, #removed, "
            ".facts tr')].map((e) => e.getBoundingClientRect().top)"
        )
        if step == 0:
            first = tops
        assert tops == first, step
    assert len(heights) == 1
    assert page.evaluate("window.shifts") == []


def changing_trace():
    """Every step says something else, at any length; the first cycle compiles."""
    trace = driven_trace(41)
    words = ["", "short", "a reason that needs a few lines in any column " * 3]
    checks = [{"collision": 8}, {"road": 2, "limit": 3}, {}]
    cells = [
        (words[k % 3], json.dumps(checks[k % 3]), f"car.{10 ** (k % 9)}")
        for k in range(41)
    ]
    steps = dict(trace.steps)
    for number, key in enumerate(("reason", "removed", "nearest")):
        steps[key] = column([cell[number] for cell in cells], Kind.TEXT)
    steps["blocker"] = column(
        [None, "a.very.long.name.of.a.vehicle." * 2] * 20 + [None], Kind.TEXT
    )
    timing = dict(trace.timing)
    times = np.ma.filled(timing["planning_ms"], np.nan)
    times[0] = 335728.57
    timing["planning_ms"] = column(times, Kind.NUMBER)
    return replace(trace, steps=steps, timing=timing)


def test_an_axis_has_more_than_one_label(run, show):
    page = show(run / "report.html").page
    for low, high in ((-4.1, 4.1), (0, 1), (-45, 8), (0, 0.0123), (-0.9, 0.95), (3, 8)):
        labels = page.evaluate(f"window.rearview.ticks({low}, {high}, 4)")
        assert 3 <= len(labels) <= 11
        assert all(low - 1e-9 <= label <= high + 1e-9 for label in labels)
