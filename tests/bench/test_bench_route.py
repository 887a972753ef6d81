"""One cycle of the route planner, over a whole drive through the town."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from experiments.episode.replan import Recorded
from planner import route
from planner.scene import Scene

pytestmark = [
    pytest.mark.bench,
    pytest.mark.sumo,
    pytest.mark.skipif(find_spec("libsumo") is None, reason="SUMO is not installed"),
]

# Some of its cycles have more than 40 vehicles and 10 conflicts.
DRIVE = ("--seed", "5", "--set", "traffic.cross_veh_per_h=160")
BUSY = (40, 10)  # vehicles, conflicts
LEAST_BUSY = 10  # of such cycles
STEP = 0.1  # of the scenario [s]
FIRST = 5  # cycles that are not counted: kernels are loaded


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Drive through the town, in a process of its own."""
    folder = tmp_path_factory.mktemp("town")
    command = [sys.executable, "-m", "experiments", "run", "town", "--json"]
    done = subprocess.run(
        [*command, *DRIVE, "--out", str(folder)],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    row = json.loads(done.stdout.splitlines()[-1])
    return Path(row["run_folder"]), round(row["travel_time_s"] / STEP)


def replan(scenes: list[Scene]) -> list[float]:
    """Plan cycle after cycle; CPU time of each [ms]."""
    planner, memory, times = route.proposed(), None, []
    for scene in scenes:
        started = process_time()
        result = planner.plan(scene, memory)
        times.append(1e3 * (process_time() - started))
        memory = result.memory
    return times


def test_cycles_of_the_route_planner(benchmark, drive):
    folder, steps = drive
    scenes = list(Recorded.read(folder).scenes(steps - FIRST))
    times = np.array(
        benchmark.pedantic(replan, args=(scenes,), rounds=1, warmup_rounds=0)
    )
    busy = [len(x.vehicles.ids) >= BUSY[0] and len(x.foes) >= BUSY[1] for x in scenes]
    assert sum(busy) >= LEAST_BUSY
    counted = times[FIRST:]
    benchmark.extra_info["cpu_ms_p50"] = float(np.median(counted))
    benchmark.extra_info["cpu_ms_p99"] = float(np.quantile(counted, 0.99))
    benchmark.extra_info["busy_cpu_ms_p50"] = float(np.median(times[busy]))
    benchmark.extra_info["busy_cpu_ms_max"] = float(times[busy].max())
