"""The table at the end of `rearview run`."""

import io
from types import SimpleNamespace

from rich.console import Console

from experiments.cli.outcome_table import print_outcome
from experiments.metrics.catalogue import IN_TERMINAL
from experiments.metrics.row import metric_row
from tests.experiments.traces import cruising


def test_metrics_status_and_folder_are_printed():
    outcome = SimpleNamespace(
        row=metric_row(cruising(51)),
        ending=SimpleNamespace(status="arrived", reason="arrived at t = 5.0 s"),
        folder="runs/a",
    )
    file = io.StringIO()
    print_outcome(outcome, Console(file=file, width=100, highlight=False))
    lines = file.getvalue().splitlines()
    rows = [[c.strip() for c in line.split("│")[1:-1]] for line in lines if "│" in line]
    assert [row[0] for row in rows] == [
        metric.label for metric in IN_TERMINAL if "candidates" not in metric.label
    ]  # nothing was planned
    assert ["mean speed", "10.0", "m/s"] in rows
    assert ["min TTC", "-", "s"] in rows
    assert lines[0] == "s · p · seed 0"
    assert lines[-2:] == ["arrived: at t = 5.0 s", "run folder: runs/a"]
