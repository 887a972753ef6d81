"""Pictures of runs: what they show, and what happens without a run to show."""

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline

from experiments.cli.app import app
from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from experiments.errors import ResultsError
from experiments.report.figures.page_layout import page_for
from experiments.report.figures.save import draw_run, save_figure
from experiments.report.figures.time_series import fallback_steps, waiting_steps
from experiments.report.figures.top_view import offset_line, rectangle
from experiments.report.run_reader import read_run
from experiments.trace.road_map import map_around, read_map, write_map
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from sumo_nets.build import net_path

OWN = "tests.experiments.constant_speed_planner:make"
ROOT = Path(__file__).parents[4]
ROAD = """\
name: road
world: kinematic
road: {segments: [[line, 300]]}
ego: {goal_m: 60}
obstacles:
  - {s_m: 40, l_m: 4, radius_m: 0.5}
  - {s_m: 50, l_m: -4, length_m: 3, width_m: 1}
vehicles: [{s_m: 30, l_m: -3, speed_mps: 5}]
"""


def make_run(folder: Path, *overrides: str) -> Path:
    file = folder / "road.yaml"
    file.write_text(ROAD)
    scenario = load_scenario(str(file), planner=OWN, overrides=overrides)
    return run_episode(scenario, out=folder / "runs").folder


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return make_run(tmp_path_factory.mktemp("figure"))


def panels(figure: Figure) -> dict[str, Axes]:
    return {axes.get_ylabel(): axes for axes in figure.axes}


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("a.png", b"\x89PNG"),
        pytest.param("a.svg", b"<?xml", marks=pytest.mark.slow),
        pytest.param("a.PDF", b"%PDF", marks=pytest.mark.slow),
    ],
)
def test_format_by_suffix_and_the_same_bytes_again(run, tmp_path, name, begin):
    contents = []
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
        file = save_figure(run, tmp_path / folder / name)
        assert [p.name for p in (tmp_path / folder).iterdir()] == [name]
        contents.append(file.read_bytes())
    assert contents[0] == contents[1]
    assert contents[0].startswith(begin)


def test_figure_goes_into_the_run_folder_without_a_file(tmp_path):
    folder = make_run(tmp_path)
    assert save_figure(folder) == folder / "figure.png"
    assert (folder / "figure.png").stat().st_size > 10_000


def test_every_axis_has_a_unit_and_text_stays_text(run, tmp_path):
    file = save_figure(run, tmp_path / "a.svg")
    root = ElementTree.parse(file).getroot()
    texts = {
        "".join(node.itertext()).strip() for node in root.iter() if "text" in node.tag
    }
    for axis in ("x [m]", "y [m]", "time [s]", "speed [m/s]", "acceleration [m/s²]"):
        assert axis in texts
    assert {"lateral offset [m]", "clearance [m]"} <= texts
    assert any("arrived: at t = 4.4 s" in text for text in texts)


def test_curves_are_the_recorded_ones(run):
    record = read_run(run)
    found = panels(draw_run(record))
    steps = record.trace.steps
    for name, column in (
        ("speed [m/s]", "speed_mps"),
        ("lateral offset [m]", "l_m"),
        ("clearance [m]", "clearance_m"),
    ):
        drawn = [np.asarray(line.get_ydata()) for line in found[name].get_lines()]
        assert any(
            y.size == steps[column].size and np.array_equal(y, steps[column])
            for y in drawn
        ), name
    least = min(steps["clearance_m"])
    assert found["clearance [m]"].texts[0].get_text() == f"{least:.2f} m"


def test_bodies_stand_where_the_trace_says(run):
    record = read_run(run)
    view = panels(draw_run(record))["y [m]"]
    outlines = [Outline(patch.get_xy()) for patch in view.patches]
    rear_axle = (record.trace.steps["x_m"][0], record.trace.steps["y_m"][0])
    ahead, behind = (rear_axle[0] + 3.7, 0.0), (rear_axle[0] - 1.1, 0.0)
    small = [o for o in outlines if np.ptp(o.vertices[:, 0]) < 6.0]
    assert any(o.contains_point(rear_axle) and o.contains_point(ahead) for o in small)
    assert not any(o.contains_point(behind) for o in small)
    assert any(o.contains_point((40.4, 4.0)) for o in small), "the disc"
    assert any(o.contains_point((51.4, -4.4)) for o in small), "the box"
    assert any(o.contains_point((30.0, -3.0)) for o in small), "the vehicle at first"


def test_moments_are_spread_over_the_way_not_over_the_time(run):
    record = read_run(run)
    x = record.trace.steps["x_m"]
    assert record.moments[0] == 0
    shares = [(x[m] - x[0]) / (x[-1] - x[0]) for m in record.moments]
    assert shares == pytest.approx([0.0, 0.3, 0.6, 0.9], abs=0.03)


def test_the_legend_lists_what_the_figure_shows(run):
    def labels(shown):
        (legend,) = draw_run(shown).legends
        return {text.get_text() for text in legend.texts}

    record = read_run(run)
    trace = record.trace
    bodies = {"other vehicle", "obstacle"}
    assert len(trace.obstacles["id"])
    assert len(trace.vehicles["id"])
    assert labels(record) >= bodies | {"plan", "road edge"}
    empty = {
        name: {key: values[:0] for key, values in getattr(trace, name).items()}
        for name in ("obstacles", "vehicles")
    }
    assert not labels(replace(record, trace=replace(trace, **empty))) & bodies
    far = {**trace.vehicles, "x_m": trace.vehicles["x_m"] + 1000.0}
    moved = labels(replace(record, trace=replace(trace, vehicles=far)))
    assert moved & bodies == {"obstacle"}


def test_a_run_of_one_step_can_be_drawn(tmp_path):
    folder = make_run(tmp_path, "planner.settings.raise_at=0")
    record = read_run(folder)
    assert len(record.trace.steps["index"]) == 1
    assert save_figure(folder).is_file()


def test_marks_of_waiting_and_of_stale_plans(run):
    record = read_run(run)
    assert not waiting_steps(record).any()
    assert not fallback_steps(record).any()


@given(
    x=st.floats(-50, 50),
    y=st.floats(-50, 50),
    heading=st.floats(-4, 4),
    length=st.floats(0.0, 9.0),
    width=st.floats(0.0, 3.0),
    radius=st.floats(0.1, 2.0),
)
def test_grown_rectangle_keeps_its_distance(x, y, heading, length, width, radius):
    points = rectangle(x, y, heading, length, width, radius)
    cos, sin = math.cos(heading), math.sin(heading)
    along = np.abs((points[:, 0] - x) * cos + (points[:, 1] - y) * sin) - length / 2
    across = np.abs((points[:, 1] - y) * cos - (points[:, 0] - x) * sin) - width / 2
    gap = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    np.testing.assert_allclose(gap, radius, atol=1e-9)


def test_offset_of_an_arc_is_an_arc():
    angle = np.linspace(0.0, 3.0, 200)
    arc = 20.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    shifted = offset_line(arc, 5.0)  # to the left, towards the centre
    np.testing.assert_allclose(np.hypot(*shifted.T), 15.0, atol=1e-2)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.74, 0.76, 1.0, 2.0, 8.0])
def test_nothing_on_the_page_overlaps(ratio):
    page = page_for(ratio)
    boxes = [page.view, *page.panels, page.bar]
    for index, (left, bottom, width, height) in enumerate(boxes):
        assert width > 0
        assert height > 0
        assert 0 <= left < left + width <= page.width
        assert 0 <= bottom < bottom + height <= page.height
        for other in boxes[:index]:
            apart_x = left >= other[0] + other[2] or other[0] >= left + width
            apart_y = bottom >= other[1] + other[3] or other[1] >= bottom + height
            assert apart_x or apart_y
    assert page.view[3] / page.view[2] == pytest.approx(ratio)


def test_map_of_a_net_holds_its_lanes_and_comes_back(tmp_path):
    path = ReferencePath.from_segments([line(300.0)])
    found = map_around(path, net_path("straight"))
    assert {(lane.edge.rstrip("0123456789_"), lane.index) for lane in found.lanes} >= {
        (edge, index) for edge in ("own", "oncoming") for index in range(3)
    }
    assert map_around(path, None).lanes == ()
    write_map(found, tmp_path)
    back = read_map(tmp_path)
    assert [lane.edge for lane in back.lanes] == [lane.edge for lane in found.lanes]
    for one, other in zip(back.lanes, found.lanes, strict=True):
        np.testing.assert_allclose(one.points, other.points, atol=1e-3)
        assert one.width == other.width


def test_junctions_without_an_outline_are_left_out(tmp_path):
    text = net_path("straight").read_text()
    bare = re.sub(r'(<junction [^>]*) shape="[^"]*"', r"\1", text)
    assert bare != text
    (tmp_path / "bare.net.xml").write_text(bare)
    path = ReferencePath.from_segments([line(300.0)])
    found = map_around(path, tmp_path / "bare.net.xml")
    assert found.junctions == ()
    assert found.lanes


def test_map_leaves_out_what_is_far_away():
    far = ReferencePath.from_segments([line(10.0)], start=(5000.0, 0.0, 0.0))
    assert map_around(far, net_path("straight")).lanes == ()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda file: file.unlink(), "cannot be read: No such file"),
        (lambda file: file.write_text("{"), "cannot be read: Expecting property"),
        (lambda file: file.write_text("[]"), "is damaged"),
        (lambda file: file.write_text('{"schema": 99}'), "version 99; allowed: 1"),
    ],
)
def test_bad_maps(tmp_path, damage, message):
    folder = make_run(tmp_path)
    damage(folder / "map.json")
    with pytest.raises(ResultsError, match=message):
        read_map(folder)


def refusal(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as left:
        app(("figure", *arguments))
    out, err = capsys.readouterr()
    assert left.value.code == 2
    assert out == ""
    assert err.count("\n") == 1
    return err


def test_mistakes_are_one_line(run, tmp_path, capsys, monkeypatch):
    before = sorted(path.name for path in run.iterdir())
    assert "is not a run folder" in refusal(capsys, str(tmp_path))
    assert "there is no such folder" in refusal(capsys, str(tmp_path / "nowhere"))
    assert "is not a run folder" in refusal(capsys, str(run / "trace.parquet"))
    assert "allowed: .png, .svg, .pdf" in refusal(capsys, str(run), "-o", "a.jpg")
    assert "allowed: .png, .svg, .pdf" in refusal(capsys, str(run), "-o", "a")
    nowhere = str(tmp_path / "nowhere" / "a.png")
    assert f"{nowhere}: cannot be written" in refusal(capsys, str(run), "-o", nowhere)
    (tmp_path / "folder.png").mkdir()
    assert "cannot be written" in refusal(
        capsys, str(run), "-o", str(tmp_path / "folder.png")
    )
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    line = refusal(capsys, str(run), "-o", str(tmp_path / "a.png"))
    assert "pip install matplotlib" in line
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]
    assert sorted(path.name for path in run.iterdir()) == before


def test_damaged_run(tmp_path, capsys):
    folder = make_run(tmp_path)
    (folder / "plans.parquet").write_bytes(b"PAR1")
    assert "plans.parquet: cannot be read" in refusal(capsys, str(folder))
    (folder / "plans.parquet").unlink()
    assert "plans.parquet: cannot be read" in refusal(capsys, str(folder))
    assert not (folder / "figure.png").exists()


def test_other_commands_do_not_load_matplotlib(tmp_path):
    modules = "experiments.cli.app, experiments.episode.run"
    code = f"import sys, {modules}, experiments.report.figures.save"
    done = subprocess.run(
        [sys.executable, "-c", code + "; sys.exit('matplotlib' in sys.modules)"],
        cwd=ROOT,
        env={**os.environ},
        check=False,
    )
    assert done.returncode == 0


@pytest.mark.sumo
@pytest.mark.slow
def test_a_sumo_run_shows_lanes_lights_and_traffic(tmp_path):
    scenario = load_scenario("intersection")
    folder = run_episode(scenario, out=tmp_path).folder
    record = read_run(folder)
    assert {lane.edge for lane in record.road_map.lanes} >= {"west_in", "north_out"}
    assert record.road_map.junctions
    assert json.loads((folder / "map.json").read_text())["schema"] == 1
    assert save_figure(folder).is_file()
