"""Pages read run folders: they load neither SUMO nor what drives episodes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FORBIDDEN = ("libsumo", "traci", "experiments.cosim", "experiments.episode")
CODE = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*sys.modules)
"""


@pytest.mark.parametrize(
    "module",
    [
        "experiments.report.run.page",
        "experiments.report.sweep.page",
        "experiments.report.figures.save",
        "experiments.report.figures.video",
    ],
)
def test_pages_and_figures_load_no_simulation(module):
    done = subprocess.run(
        [sys.executable, "-c", CODE, module],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = done.stdout.split()
    assert module in loaded
    assert [name for name in loaded if name.startswith(FORBIDDEN)] == []
