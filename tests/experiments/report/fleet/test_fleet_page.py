"""The page of a run with many egos: what it holds, what is drawn, how fast."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from experiments.errors import ResultsError
from experiments.metrics.row import row_without_episode
from experiments.report.fleet.replay import fleet_replay, read_tables
from experiments.report.run.page import save_run_page
from experiments.trace.fleet import (
    FleetTrace,
    fleet_table,
    fleet_tables,
    plans_table,
    timing_table,
    write_fleet,
)
from experiments.trace.road_map import MapLane, RoadMap, read_map, write_map
from experiments.trace.schema import Kind, column
from tests.experiments.report.browser import (
    frames_in_half_a_second,
    settle,
    until,
    violations,
)
from tests.experiments.report.conftest import NARROW, WIDE
from tests.experiments.report.run_folders import HOSTILE

STEP = 0.1
ROAD = RoadMap(
    tuple(
        MapLane(edge, lane, 3.5, inside, np.array([[x0, 3.5 * lane], [x1, 3.5 * lane]]))
        for edge, x0, x1, inside in (
            ("first", 0.0, 900.0, False),
            (":between_0", 900.0, 1000.0, True),
            ("last", 1000.0, 2000.0, False),
        )
        for lane in range(3)
    )
)


def made_trace(n_vehicles, n_steps, name="own"):
    """Vehicles on three lanes, every second one an ego, at 10 m/s over two edges."""
    vehicle = np.tile(np.arange(n_vehicles), n_steps)
    index = np.repeat(np.arange(n_steps), n_vehicles)
    s = 1800.0 * vehicle / n_vehicles + 10.0 * STEP * index
    lanes = ("first_0", ":between_0_0", "last_0")
    lane = np.searchsorted((900.0, 1000.0), s, side="right")
    zero = np.zeros(s.size)
    group = np.where(vehicle % 2 == 0, 0, -1)
    speed = 10.0 + vehicle % 5
    size = (np.full(s.size, 4.8), np.full(s.size, 1.9))
    table = np.array([s - 2.4, 3.5 * (vehicle % 3), zero, speed, zero, zero, *size])
    ego = group == 0
    ids = [f"{name}.{k}" for k in range(n_vehicles)]
    n = int(ego.sum())
    egos = fleet_table(
        "egos",
        index[ego].tolist(),
        [ids[k] for k in vehicle[ego]],
        [0] * n,
        *([0.0] * n for _ in range(6)),
        ["ok"] * n,
        [1.0] * n,
        [0.0] * n,
        ["[]"] * n,
    )
    x, y = table[0][ego], table[1][ego]
    ahead = np.array([x + 10, y, x + 20, y, x + 30, y]).T
    ends = fleet_table(
        "ego_ends",
        [3, 4],
        [ids[0], ids[2]],
        ["collision", "arrived"],
        [f"touched {HOSTILE}", "arrived"],
    )
    return FleetTrace(
        STEP,
        tuple(ids),
        lanes,
        index,
        vehicle,
        group,
        lane,
        table,
        np.array([s - np.array([0.0, 900.0, 1000.0])[lane], speed, zero, zero]),
        STEP * np.arange(n_steps),
        np.zeros(n_steps, np.int64),
        np.zeros(n_steps),
        np.arange(n_steps),
        egos,
        np.zeros(n),
        ends,
        ahead,
    )


def write_folder(folder, trace):
    folder.mkdir()
    tables = fleet_tables(trace)
    write_fleet(tables, timing_table(trace), plans_table(trace), folder)
    write_map(ROAD, folder)
    about = {"scenario": "many", "planner": "cruise", "seed": 1, "status": "arrived"}
    (folder / "manifest.json").write_text(json.dumps({**about, "reason": HOSTILE}))
    row = row_without_episode("many", "cruise", 1, "arrived")
    (folder / "metrics.json").write_text(json.dumps(row))
    (folder / "config.yaml").write_text(
        "name: many\nplanner: {name: cruise}\negos: {count: 5}\n"
    )
    return folder


def test_an_ego_without_a_plan_in_its_last_step_has_a_page_without_that_plan(tmp_path):
    trace = made_trace(8, 20)
    last = trace.plans.shape[0] - 1
    plans = trace.plans.copy()
    plans[last] = np.nan
    status = trace.egos["plan_status"].tolist()
    status[last] = None
    egos = {**trace.egos, "plan_status": column(status, Kind.TEXT)}
    folder = write_folder(tmp_path / "run", replace(trace, plans=plans, egos=egos))
    assert save_run_page(folder).is_file()
    packed = fleet_replay(*read_tables(folder), read_map(folder), ["cruise"])["plans"]
    for name in ("x1", "y1", "x2", "y2", "x3", "y3"):
        drawn = np.frombuffer(base64.b64decode(packed[name]["data"]), "<f4")
        assert np.flatnonzero(np.isnan(drawn)).tolist() == [last]


def test_places_lie_along_the_way_of_the_vehicle_that_came_farthest(tmp_path):
    trace = made_trace(8, 400)
    folder = write_folder(tmp_path / "run", trace)
    tables, plans = read_tables(folder)
    data = fleet_replay(tables, plans, read_map(folder), ["cruise"])
    low, step = data["way"]["low"], data["way"]["step"]
    codes = np.frombuffer(base64.b64decode(data["way"]["data"]), "<u2")
    s = trace.table[0] + 2.4
    # one vehicle comes over all three edges
    assert low + step * codes == pytest.approx(s, abs=0.1)
    assert [end["id"] for end in data["ends"]] == ["own.0"]


def test_damaged_folders_are_refused_in_one_line(tmp_path):
    folder = write_folder(tmp_path / "run", made_trace(4, 6))
    (folder / "config.yaml").write_text("name: many\n")
    with pytest.raises(ResultsError, match="configuration is damaged"):
        save_run_page(folder)
    other = made_trace(4, 6)
    bad = write_folder(tmp_path / "bad", replace(other, plans=other.plans[:2]))
    with pytest.raises(ResultsError, match="does not fit the table of the egos"):
        save_run_page(bad)


def test_without_plans_and_map_of_earlier_versions_there_is_a_page(tmp_path):
    folder = write_folder(tmp_path / "run", made_trace(4, 6))
    (folder / "fleet_plans.parquet").unlink()
    (folder / "map.json").unlink()
    page = save_run_page(folder).read_text("utf-8")
    assert '"plans":null' in page
    assert "<script>window.hacked" not in page


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["wide", "narrow"])
def test_one_is_chosen_followed_and_found_in_time_and_space(show, tmp_path, size):
    folder = write_folder(tmp_path / "run", made_trace(8, 60))
    page = show(save_run_page(folder), size).page
    until(page, "() => window.rearview !== undefined && rearview.scene.frames > 0")
    assert page.evaluate("() => window.hacked") is None
    page.select_option("#who", label="own.2")
    settle(page)
    assert "own.2: cruise, 12.0 m/s" in page.text_content("#fact")
    x = page.evaluate("() => rearview.camera.x")
    page.click("#on")
    settle(page)
    assert page.evaluate("() => rearview.camera.x") == pytest.approx(x + 1.0, abs=0.05)
    page.click("#events button")
    settle(page)
    assert "own.0" in page.text_content("#fact")
    assert "0.3 s" in page.text_content("#clock")
    box = page.locator("#time-space").bounding_box()
    page.locator("#time-space").click(
        position={"x": box["width"] / 2, "y": box["height"] / 2}
    )
    settle(page)
    assert page.evaluate("() => rearview.player.t") == pytest.approx(2.6, abs=0.8)
    assert page.evaluate("() => rearview.chosen()") >= -1
    assert violations(page) == []


@pytest.mark.slow
@pytest.mark.browser
def test_500_vehicles_are_drawn_30_times_a_second(show, tmp_path):
    folder = write_folder(tmp_path / "run", made_trace(500, 300))
    page = show(save_run_page(folder)).page
    until(page, "() => window.rearview !== undefined && rearview.scene.frames > 0")
    page.click("#play")
    assert frames_in_half_a_second(page, 4.0) >= 15
