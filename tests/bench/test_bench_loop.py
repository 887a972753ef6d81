"""The closed loop with everything in it, and how long it takes to begin."""

import json
import os
import subprocess
import sys
import time
from importlib.util import find_spec

import numpy as np
import pytest

from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.kinematic_world import (
    KinematicWorld,
    ScriptedVehicle,
    constant_bounds,
)
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.road import EgoTask, Road, Start
from planner import cruise
from planner.vehicle import Vehicle
from tests.planner.scenes import Disc, discs, straight

pytestmark = pytest.mark.bench

N_STEPS = 120
TASK = EgoTask(Vehicle(), 590.0, 13.9, Start(10.0, 0.0, 10.0))


def busy_world():
    """Three lanes, thirty vehicles, five obstacles."""
    path = straight(600.0)
    rng = np.random.default_rng(2)
    vehicles = tuple(
        ScriptedVehicle(
            f"car.{k}",
            s=25.0 + 18.0 * (k // 2),
            l=(3.5, -3.5)[k % 2],
            speed=float(rng.uniform(7.0, 12.0) * (-1.0 if k % 4 == 0 else 1.0)),
        )
        for k in range(30)
    )
    rows = [Disc(60.0 + 45.0 * k, (-1) ** k * 1.0, 0.4) for k in range(5)]
    road = Road(path, constant_bounds(path, 5.25), obstacles=discs(path, rows))
    return KinematicWorld(road, TASK, vehicles)


def drive():
    steps = []
    options = EpisodeOptions(duration=0.1 * N_STEPS)
    run_loop(
        busy_world(),
        cruise.proposed(),
        PerfectTracking(),
        TASK,
        options,
        steps.append,
    )
    return steps


def test_closed_loop_without_a_simulator(benchmark):
    steps = benchmark.pedantic(drive, rounds=5, warmup_rounds=1)
    assert len(steps) > 20
    benchmark.extra_info["vehicles"] = 30
    benchmark.extra_info["steps"] = len(steps)
    planning = [step.planning.cpu_ms for step in steps if step.planning is not None]
    benchmark.extra_info["planning_cpu_ms_p50"] = float(np.median(planning))
    if benchmark.stats is not None:  # none with --benchmark-disable
        median = benchmark.stats.stats.median
        benchmark.extra_info["steps_per_s"] = len(steps) / median


def rearview(folder, scenario, *options, cache=None):
    """Run one episode in a process of its own; (results row, seconds)."""
    environment = dict(os.environ)
    # as users have it: else all modules would be compiled anew at every start
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = str(cache)
    command = [sys.executable, "-m", "experiments", "run", scenario, "--json"]
    started = time.perf_counter()
    done = subprocess.run(
        [*command, "--out", str(folder), *options],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - started
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout.splitlines()[-1]), seconds


@pytest.mark.sumo
@pytest.mark.skipif(find_spec("libsumo") is None, reason="SUMO is not installed")
@pytest.mark.parametrize("scenario", ["straight", "intersection"])
def test_closed_loop_in_sumo(benchmark, tmp_path, scenario):
    row, _ = benchmark.pedantic(
        rearview, args=(tmp_path, scenario), rounds=1, warmup_rounds=0
    )
    for name in ("status", "steps_per_s", "planning_cpu_ms_p50", "planning_cpu_ms_p99"):
        benchmark.extra_info[name] = row[name]


ONE_STEP = ("--set", "simulation.duration_s=0.1")


def test_start_to_the_first_step_cold(benchmark, tmp_path):
    """Everything is compiled: the cache is empty."""
    cache = tmp_path / "cache"
    cache.mkdir()
    _, seconds = benchmark.pedantic(
        rearview,
        args=(tmp_path, "thesis_straight", "--planner", "cruise", *ONE_STEP),
        kwargs={"cache": cache},
        rounds=1,
    )
    assert any(cache.rglob("*.kernel"))
    benchmark.extra_info["seconds"] = seconds


def test_start_to_the_first_step_warm(benchmark, tmp_path):
    cache = tmp_path / "cache"
    cache.mkdir()
    arguments = (tmp_path, "thesis_straight", "--planner", "cruise", *ONE_STEP)
    rearview(*arguments, cache=cache)
    _, seconds = benchmark.pedantic(
        rearview, args=arguments, kwargs={"cache": cache}, rounds=3
    )
    benchmark.extra_info["seconds"] = seconds
