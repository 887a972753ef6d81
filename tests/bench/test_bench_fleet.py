"""One step of a simulation with many egos, on one core."""

from importlib.util import find_spec

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.drive import run_scenario

pytestmark = [
    pytest.mark.bench,
    pytest.mark.sumo,
    pytest.mark.skipif(find_spec("libsumo") is None, reason="SUMO is not installed"),
]

# Three lanes full of vehicles at the first step, about 160.
FULL = ("traffic.own_veh_per_h=9000", "simulation.warmup_s=150")
ENTERING = 5  # steps in which vehicles are taken over, which costs more than driving


def drive(folder, n_egos):
    """Drive for six seconds; (steps,)."""
    steps = []
    scenario = load_scenario(
        "motorway",
        overrides=(
            *FULL,
            "simulation.duration_s=6",
            "egos.penetration=null",
            f"egos.count={n_egos}",
        ),
    )
    run_scenario(scenario, out=folder, on_step=steps.append)
    return steps[ENTERING:]


@pytest.fixture(scope="module", autouse=True)
def warm(tmp_path_factory):
    drive(tmp_path_factory.mktemp("warm"), 20)


@pytest.mark.parametrize("n_egos", [20, 80, 160])
def test_a_step_with_many_egos(benchmark, tmp_path, n_egos):
    steps = benchmark.pedantic(drive, args=(tmp_path, n_egos), rounds=1)
    driven = np.median([len(step.egos) for step in steps])
    assert driven >= 0.9 * n_egos
    vehicles = np.median([len(step.snapshot.users.ids) for step in steps])
    benchmark.extra_info["egos"] = float(driven)
    benchmark.extra_info["vehicles"] = float(vehicles)
    cpu = [1e3 * step.cpu_s for step in steps]
    benchmark.extra_info["step_cpu_ms_p50"] = float(np.median(cpu))
    benchmark.extra_info["step_cpu_ms_min"] = float(np.min(cpu))
