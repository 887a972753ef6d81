"""SUMO's window under a virtual display: the plan is in it."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
CODE = """
import sys
from pathlib import Path

import libsumo
import numpy as np

from experiments.cosim.session import PLAN_COLOUR, PLAN_ID
from experiments.episode import run_episode
from experiments.scenario_file import load_scenario

scenario = load_scenario(
    "straight", overrides=["traffic=none", "simulation.duration_s=0.5"]
)
shapes = []


def on_step(record):
    if record.plan is not None:
        plan = record.plan.trajectory
        shape = np.array(libsumo.polygon.getShape(PLAN_ID))
        assert np.allclose(shape, np.column_stack((plan.x, plan.y)), atol=0.01)
        assert libsumo.polygon.getColor(PLAN_ID) == PLAN_COLOUR
        shapes.append(shape)


run_episode(scenario, out=Path(sys.argv[1]), gui=True, on_step=on_step)
print(f"{len(shapes)} plans drawn")
"""


@pytest.mark.sumo
@pytest.mark.slow
def test_the_plan_is_drawn_in_sumos_window(tmp_path):
    if shutil.which("xvfb-run") is None:
        words = "xvfb-run is not installed"
        if os.environ.get("REARVIEW_NEEDS_BROWSER"):
            pytest.fail(words)
        pytest.skip(words)
    screen = "-screen 0 320x240x24"  # drawn by the processor: small is fast
    command = ["xvfb-run", "-a", "-s", screen, sys.executable, "-c", CODE]
    process = subprocess.Popen(
        [*command, str(tmp_path)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        out, err = process.communicate(timeout=300)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    assert process.returncode == 0, err
    assert "5 plans drawn" in out
