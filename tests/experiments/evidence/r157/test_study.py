import shlex
from dataclasses import replace

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.config.vehicle_model import ActuatorsConfig, PlantConfig
from experiments.cosim.conflicts import LateralProfile
from experiments.evidence.r157 import study
from experiments.evidence.r157.document import write_study
from experiments.evidence.r157.grids import ConflictPanel, Density, cut_in_panel
from experiments.evidence.r157.planner_runs import RunSettings
from experiments.evidence.r157.summary import KindStudy, headline, preventable_cells
from experiments.evidence.r157.unpreventable import judge_panel
from experiments.world_setup.vehicle_model import model_settings

WHOLE = cut_in_panel(60, 20, Density.THINNED)
PANEL = ConflictPanel(WHOLE.kind, 60, 20, WHOLE.x[::6], WHOLE.y[::4])


class InThisProcess:
    def __init__(self):
        self.pieces = 0

    def map(self, words, function, items):
        found = [function(item) for item in items]
        self.pieces += len(found)
        return found


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return folder, study.run_panel("rss", PANEL, RunSettings(), folder, InThisProcess())


def test_a_finished_panel_is_kept_and_reads_back_the_same(runs):
    folder, made = runs
    work = InThisProcess()
    kept = study.run_panel("rss", PANEL, RunSettings(), folder, work)
    assert work.pieces == 0
    for name in study.COLUMNS:
        np.testing.assert_array_equal(kept.table[name], made.table[name])
    assert [file.name for file in folder.rglob("*.parquet")] == ["60_20_5x3.parquet"]


def test_runs_of_another_setting_are_not_taken(runs):
    folder, _ = runs
    work = InThisProcess()
    quintic = replace(RunSettings(), profile=LateralProfile.QUINTIC)
    study.run_panel("rss", PANEL, quintic, folder, work)
    assert work.pieces == 1  # 15 cells


def test_batches_of_any_size_give_the_same_rows(runs, tmp_path, monkeypatch):
    _, made = runs
    monkeypatch.setattr(study, "BATCH", 4)
    work = InThisProcess()
    again = study.run_panel("rss", PANEL, RunSettings(), tmp_path, work)
    assert work.pieces == 4
    for name in study.COLUMNS:
        np.testing.assert_array_equal(again.table[name], made.table[name])


def test_headline_counts_by_hand(runs):
    _, made = runs
    judged = judge_panel(PANEL)
    human = judged.collided["careful_human"]
    hit = np.isin(made.cells("outcome"), (2, 3))
    found = headline([judged], [made])
    assert (found.collisions, found.cells) == (hit.sum(), 15)
    assert found.preventable == (hit & ~human).sum()
    assert (found.unpreventable, found.survived) == (human.sum(), (human & ~hit).sum())
    cells = preventable_cells([judged], [made], RunSettings())
    assert len(cells) == found.preventable


def test_commands_of_cells_have_the_settings_of_the_runs(runs):
    _, made = runs
    nobody = judge_panel(PANEL)
    nobody.collided["careful_human"][:] = False  # every collision is preventable
    plain = preventable_cells([nobody], [made], RunSettings())
    assert plain
    model, hands = PlantConfig(model="dynamic"), ActuatorsConfig(preset="autoware")
    plant = model_settings(model, hands, None, 2.58)
    settings = RunSettings(profile=LateralProfile.QUINTIC, follower=True, plant=plant)
    varied = preventable_cells([nobody], [made], settings)
    more = " --set conflict.profile=quintic --set conflict.follower=true"
    more += " --set ego.plant=dynamic --set ego.actuators=autoware"
    assert [row["replay"] for row in varied] == [row["replay"] + more for row in plain]
    words = shlex.split(varied[0]["replay"])
    changes = [word for word in words if "=" in word]
    scenario = load_scenario("cut_in", overrides=changes)
    assert scenario.ego.plant is not None
    assert scenario.conflict.follower


def test_page_document_and_pictures_are_written(runs, tmp_path):
    _, made = runs
    kind = KindStudy(PANEL.kind, [judge_panel(PANEL)], {"rss": [made]})
    page = write_study([kind], Density.THINNED, RunSettings(), tmp_path)
    assert "data:image/png;base64," in page.read_text(encoding="utf-8")
    words = (tmp_path / "r157.md").read_text(encoding="utf-8")
    assert "| Ve 60, Vo 20 km/h | 15 |" in words
    assert "equal those of that implementation, cell by cell" in words
    assert (tmp_path / "r157_cut_in_rss.png").stat().st_size > 5000
