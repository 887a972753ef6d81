"""SUMO's window under a virtual display: the plan is in it."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CODE = """
import os
import sys
from pathlib import Path

import libsumo
import numpy as np

from experiments.cosim.sumo.gui import PLAN_COLOUR, PLAN_ID
from experiments.episode.run import run_episode
from experiments.config.scenario_file import load_scenario

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
print(f"{len(shapes)} plans drawn", flush=True)
os._exit(0)  # as the command line does
"""


def under_a_display(*command):
    """Run a command under a virtual display; gives status, stdout and stderr."""
    if shutil.which("xvfb-run") is None:
        words = "xvfb-run is not installed"
        if os.environ.get("REARVIEW_NEEDS_BROWSER"):
            pytest.fail(words)
        pytest.skip(words)
    screen = "-screen 0 320x240x24"  # drawn by the processor: small is fast
    process = subprocess.Popen(
        ["xvfb-run", "-a", "-s", screen, sys.executable, *command],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        out, err = process.communicate(timeout=200)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    return process.returncode, out, err


@pytest.mark.sumo
@pytest.mark.slow
def test_the_plan_is_drawn_in_sumos_window(tmp_path):
    status, out, err = under_a_display("-c", CODE, str(tmp_path))
    assert status == 0, err
    assert "5 plans drawn" in out


@pytest.mark.sumo
@pytest.mark.slow
def test_the_command_comes_to_its_end(tmp_path):
    words = ["-m", "experiments", "run", "straight", "--gui", "--set", "traffic=none"]
    short = ["--set", "simulation.duration_s=1", "--out", str(tmp_path)]
    status, out, err = under_a_display(*words, *short)
    assert status == 1, err
    assert "timeout: s = " in out
    (page,) = tmp_path.glob("*/report.html")
    assert f"report: {page}" in out
