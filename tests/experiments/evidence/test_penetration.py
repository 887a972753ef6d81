"""The document about many egos says what the rows of its sweeps hold."""

import json

import pytest
import yaml

from experiments.comparison.results import rebuild
from experiments.evidence.penetration import SHOWN, document, main
from experiments.metrics import columns
from tests.experiments.report.run_folders import write_sweep

CLAIM = {"baseline": "cruise", "primary": ["all_mean_speed_mps"]}


@pytest.fixture
def sweep(tmp_path):
    """Return a folder in which `old` is 2 m/s slower than `cruise` on every seed."""
    folder = write_sweep(tmp_path / "penetration_ring", seeds=6)
    content = yaml.safe_load((folder / "sweep.yaml").read_text())
    content |= {"name": "penetration_ring", "claim": CLAIM}
    (folder / "sweep.yaml").write_text(yaml.safe_dump(content))
    for file in folder.rglob("metrics.json"):
        row = json.loads(file.read_text())
        manifest = json.loads(file.with_name("manifest.json").read_text())
        slow = manifest["sweep"]["label"] == "old"
        seed = row[columns.SEED]
        speed = 10.0 + 0.1 * seed - slow * (2.0 + 0.1 * (-1) ** seed)
        file.write_text(json.dumps({**row, "all_mean_speed_mps": speed}))
    rebuild(folder)
    return folder


def cells(text):
    """Return the cells of the table by metric and drivers."""
    lines = [line.split("|")[1:-1] for line in text.splitlines()]
    rows = [[cell.strip() for cell in line] for line in lines if len(line) == 6]
    return {tuple(row[:2]): row[2:] for row in rows}


def test_means_differences_and_changes_are_those_of_the_rows(sweep):
    text = document([sweep])
    assert "## penetration_ring\n" in text
    assert "48 runs, 6 seeds; 5 runs with an ego that failed." in text
    assert "Published: Stern et al. 2018" in text
    found = cells(text)
    name = "mean speed, all [m/s]"
    assert found[name, "cruise"][0] == "10.25"
    assert found[name, "old"][:2] == ["8.25", "-2.000"]
    low, high = map(float, found[name, "old"][2].split(" to "))
    assert -2.15 < low < -2.05
    assert low + high == pytest.approx(-4.0, abs=2e-3)
    assert found[name, "old"][3] == "-20 %"


def test_a_metric_that_applies_to_no_run_has_no_line(sweep):
    assert "flow_veh_per_h" in SHOWN
    assert ("flow [veh/h]", "old") not in cells(document([sweep]))


def test_a_sweep_without_a_claim_is_one_line(tmp_path, capsys):
    folder = write_sweep(tmp_path / "made", seeds=1)
    assert main([str(folder), "-o", str(tmp_path / "page.md")]) == 2
    assert "its sweep has no claim; allowed: one with it" in capsys.readouterr().err
    assert not (tmp_path / "page.md").exists()
