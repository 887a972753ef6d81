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

SEED = "5"  # its last cycles have more than 40 vehicles and 10 conflicts
BUSY = (40, 10)  # vehicles, conflicts
FIRST = 5  # cycles that are not counted: kernels are loaded


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Drive through the town, in a process of its own."""
    folder = tmp_path_factory.mktemp("town")
    command = [sys.executable, "-m", "experiments", "run", "town", "--json"]
    done = subprocess.run(
        [*command, "--seed", SEED, "--out", str(folder)],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    row = json.loads(done.stdout.splitlines()[-1])
    return Path(row["folder"]), round(row["duration_s"] / 0.1)


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
    scenes = list(Recorded.read(folder).scenes(steps - 1))
    times = np.array(
        benchmark.pedantic(replan, args=(scenes,), rounds=1, warmup_rounds=0)
    )
    busy = [len(x.vehicles.ids) >= BUSY[0] and len(x.foes) >= BUSY[1] for x in scenes]
    assert sum(busy) > 20
    for name, counted in (("", times[FIRST:]), ("busy_", times[busy])):
        benchmark.extra_info[f"{name}cycles"] = counted.size
        benchmark.extra_info[f"{name}cpu_ms_p50"] = float(np.median(counted))
        benchmark.extra_info[f"{name}cpu_ms_p99"] = float(np.quantile(counted, 0.99))
