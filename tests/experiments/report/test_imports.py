"""Pages read run folders: they load neither SUMO nor what drives episodes."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
FORBIDDEN = ("libsumo", "traci", "experiments.cosim", "experiments.episode")
PAGES = (
    "experiments.report.run.page",
    "experiments.report.sweep.page",
    "experiments.report.figures.save",
    "experiments.report.figures.video",
)
CODE = """
import importlib, sys
for module in sys.argv[1:]:
    importlib.import_module(module)
    print(*sys.modules)
"""


def test_pages_and_figures_load_no_simulation():
    done = subprocess.run(
        [sys.executable, "-c", CODE, *PAGES],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    for module, line in zip(PAGES, done.stdout.splitlines(), strict=True):
        loaded = line.split()
        assert module in loaded
        found = [name for name in loaded if name.startswith(FORBIDDEN)]
        assert found == [], f"{module}, or one before it"
