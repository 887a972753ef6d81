"""Run folders and folders of sweeps, written by hand: no episode is driven."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from experiments.config.sweep import Sweep
from experiments.metrics.row import metric_row
from experiments.sweep.folder import run_folder
from experiments.trace.files import write_trace
from experiments.trace.road_map import RoadMap, write_map
from experiments.trace.schema import Trace
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.scene import Obstacles
from planner.states import CartesianState, Trajectory
from tests.experiments.traces import STEP, record, trace_of

HOSTILE = "\"><script>window.hacked=1</script></script><img src=x onerror='hacked=2'>"


def plan_from(ego: CartesianState, stats: PlanStats) -> PlanResult:
    """Straight on with the present speed for three seconds."""
    t = STEP * np.arange(31)
    zero = np.zeros(31)
    x = ego.x + ego.speed * t
    trajectory = Trajectory(
        t, x, zero + ego.y, zero, zero, zero + ego.speed, zero, x, zero
    )
    return PlanResult(PlanStatus.OK, trajectory, None, stats)


def driven_trace(
    n_steps: int,
    n_cars: int = 3,
    *,
    name: str = "car",
    stats: PlanStats | None = None,
    obstacles: Obstacles | None = None,
) -> Trace:
    """The ego speeds up along a straight road between slower cars."""
    stats = stats or PlanStats(
        candidates=40,
        survivors=30,
        removed={"collision": 8, "road": 2},
        costs={"jerk": 0.5, "total": 1.25},
        blocker=f"{name}.1",
    )
    records = []
    for k in range(n_steps):
        t = k * STEP
        ego = CartesianState(
            5 * t + 0.02 * t**2, 0.5 * math.sin(t), 0, 0, 5 + 0.04 * t, 0
        )
        cars = [
            (f"{name}.{i}", 20 + 9 * (i // 2) + 4 * t, -3.5 if i % 2 else 3.5, 0, 4, 0)
            for i in range(n_cars)
        ]
        made = record(
            k, ego, cars=cars, plan=plan_from(ego, stats), clearance=3 + math.cos(t)
        )
        records.append(made)
    records[-1] = replace(records[-1], plan=None, planning=None)
    return trace_of(records, obstacles=obstacles)


def write_run(folder: Path, trace: Trace, **about: object) -> Path:
    """Write the folder of a run."""
    folder.mkdir(parents=True, exist_ok=True)
    write_trace(trace, folder)
    write_map(RoadMap(), folder)
    facts = {
        "scenario": "made_up",
        "planner": "cruise",
        "seed": 3,
        "status": "arrived",
        "reason": "arrived at t = 9.0 s",
        "versions": {"python": "3.11", "libsumo": None},
        "git": {"commit": "0123abc", "dirty": True},
        "command": "rearview run runs/made_up/config.yaml --out runs",
        "wall_s": 1.5,
        **about,
    }
    (folder / "manifest.json").write_text(json.dumps(facts))
    (folder / "metrics.json").write_text(json.dumps(metric_row(trace)))
    (folder / "config.yaml").write_text("name: made_up\nsimulation: {step_s: 0.1}\n")
    return folder


ROAD_SWEEP = {
    "name": "made",
    "purpose": "To be looked at.",
    "scenarios": ["straight", "curved"],
    "planners": ["cruise", {"name": "cruise_conventional", "label": "old"}],
    "axes": {"grid": {"ego.target_speed_mps": [8.0, 11.0]}},
    "seeds": {"first": 0, "count": 5},
}


def write_sweep(folder: Path, seeds: int = 5, *, reason: str = "touched own.3") -> Path:
    """Write the folder of a sweep: 8 runs a seed, every tenth of them a collision."""
    (folder / "runs").mkdir(parents=True)
    asked = Sweep.model_validate(
        {**ROAD_SWEEP, "seeds": {"first": 0, "count": max(seeds, 1)}}, strict=False
    )
    content = asked.model_dump(mode="json", exclude_none=True)
    (folder / "sweep.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    row = metric_row(driven_trace(3))
    number = 0
    for seed in range(seeds):
        for scenario in ("straight", "curved"):
            for label in ("cruise", "old"):
                for speed in (8.0, 11.0):
                    one = (scenario, label, seed, speed)
                    _write_result(folder, number, one, row, reason)
                    number += 1
    return folder


def _write_result(folder, number, one, row, reason):
    """Write the folder of a run without a trace."""
    scenario, label, seed, speed = one
    failed = number % 10 == 7
    run_id = f"{(number * 2654435761) % 2**32:08x}{number:08x}"
    own = run_folder(folder, run_id)
    own.mkdir(parents=True)
    status = "collision" if failed else "arrived"
    about = {
        "scenario": scenario,
        "planner": "cruise",
        "seed": seed,
        "run_id": run_id,
        "status": status,
        "reason": f"{reason} at t = {seed + 1}.5 s" if failed else "arrived",
        "trace_kept": False,
        "trace_hash": "0",
        "attempts": 1,
        "wall_s": 1.0,
        "command": f"rearview rerun {folder} {run_id}",
        "sweep": {"label": label, "point": {"ego.target_speed_mps": speed}},
    }
    spread = math.sin(number)
    metrics = {
        **row,
        "scenario": scenario,
        "seed": seed,
        "status": status,
        "arrived": not failed,
        "collisions": int(failed),
        "travel_time_s": None if failed else 300.0 / speed + spread,
        "min_clearance_m": 0.0 if failed else 1.0 + 0.5 * spread,
        "planning_ms_p99": 20.0 + 15.0 * spread,
        "planning_ms_max": 80.0 + 60.0 * spread,
    }
    (own / "manifest.json").write_text(json.dumps(about))
    (own / "metrics.json").write_text(json.dumps(metrics))
    (own / "config.yaml").write_text("simulation: {step_s: 0.1}\n")
