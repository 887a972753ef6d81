"""The document about populations says what samples and rows hold."""

import numpy as np
import pytest
import yaml

from experiments.errors import ConfigError
from experiments.evidence.populations import document as page
from experiments.evidence.populations.ranking import POPULATION, RELAXATION
from experiments.evidence.populations.traffic import TrafficSample
from experiments.metrics import columns
from experiments.metrics.row import row_without_episode
from sumo_nets.driver_population import POPULATIONS
from tests.experiments.report.run_folders import ROAD_SWEEP, write_sweep

FIRST, SECOND = list(POPULATIONS)[:2]
SEEDS = 12


@pytest.fixture(autouse=True)
def sampled(monkeypatch):
    """Let every population drive alike: gaps of 1 and 3 s, 20 m/s, 2 brakings."""

    def sample(population, seed, density):
        gaps, speeds = np.array([0.9, 3.0, 3.0, 3.0]), np.full(4, 20.0)
        times = np.array([0.1, np.inf, np.inf, np.inf])
        return TrafficSample(gaps, times, speeds, 2, 50.0)

    monkeypatch.setattr(page, "sample_traffic", sample)


def row(population, label, seed, travel, status="arrived"):
    return {
        **row_without_episode("straight", label, seed, status),
        POPULATION: population,
        RELAXATION: 0.0,
        "label": label,
        "arrived": status == "arrived",
        columns.TRAVEL_TIME: travel,
        columns.VERDICT: None if status == "arrived" else "ego at fault",
    }


def made(monkeypatch, tmp_path, found):
    monkeypatch.setattr(page, "rows", lambda folder: found)
    (tmp_path / "sweep.yaml").write_text(yaml.safe_dump(ROAD_SWEEP))
    return page.document(tmp_path, seeds=2)


def scattered(means, seeds=SEEDS):
    rng = np.random.default_rng(0)
    return [
        row(population, label, 5000 + seed, mean + float(rng.normal()))
        for population, planners in means.items()
        for label, mean in planners.items()
        for seed in range(seeds)
    ]


def test_the_traffic_is_summed_over_its_seeds(monkeypatch, tmp_path):
    text = made(monkeypatch, tmp_path, scattered({FIRST: {"a": 50.0, "b": 60.0}}))
    rows = [x for x in text.splitlines() if x.startswith(f"| dense | {FIRST} |")]
    cells = [cell.strip() for cell in rows[0].split("|")[3:-1]]
    # 4 brakings in 100 km; a quarter of the gaps is below 1 s, and of the TTC small
    assert cells[3] == "25.0%"
    assert cells[5] == "25.00%"
    assert cells[6:] == ["4.0", "20.0", "100"]
    assert len([x for x in text.splitlines() if x.startswith("| dense |")]) == len(
        POPULATIONS
    )


def test_planners_that_change_places_are_named(monkeypatch, tmp_path):
    means = {FIRST: {"a": 50.0, "b": 60.0}, SECOND: {"a": 60.0, "b": 50.0}}
    text = made(monkeypatch, tmp_path, scattered(means))
    assert f"Sweep `made`: 48 runs finished, {SEEDS} seeds." in text
    first, second = sorted((FIRST, SECOND))
    better = FIRST if (first, second) == (FIRST, SECOND) else SECOND
    words = [x for x in text.splitlines() if x.startswith("- ")]
    assert len(words) == 1
    assert "better than" in words[0]
    assert better in words[0]


def test_no_change_of_places_and_too_few_seeds_are_said(monkeypatch, tmp_path):
    means = {FIRST: {"a": 50.0, "b": 60.0}, SECOND: {"a": 50.0, "b": 60.0}}
    assert "No two planners change places" in made(
        monkeypatch, tmp_path, scattered(means)
    )
    few = made(monkeypatch, tmp_path, scattered(means, seeds=2))
    assert "Too few seeds for intervals" in few


def test_arrivals_and_faults_are_counted(monkeypatch, tmp_path):
    found = scattered({FIRST: {"a": 50.0, "b": 60.0}})
    found[0] = row(FIRST, "a", 5000, None, "collision")
    text = made(monkeypatch, tmp_path, found)
    line = next(x for x in text.splitlines() if x.startswith(f"| {FIRST} | 11 of 12 ("))
    assert line.count("at fault") == 1
    assert "12 of 12" in line
    none = next(x for x in text.splitlines() if x.startswith(f"| {SECOND} | -"))
    assert none == f"| {SECOND} | - | - |"


def test_a_sweep_without_populations_is_refused(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=1)
    with pytest.raises(ConfigError, match=r"is no sweep over traffic\.drivers"):
        page.document(folder, seeds=1)
