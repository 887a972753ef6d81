"""One step of a simulation with many egos, on one core."""

from importlib.util import find_spec

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.drive import run_scenario
from sumo_nets.build import net_path

pytestmark = [
    pytest.mark.bench,
    pytest.mark.sumo,
    pytest.mark.skipif(find_spec("libsumo") is None, reason="SUMO is not installed"),
]

# Three lanes full of vehicles at the first step, about 160; on a longer road 400.
FULL = ("traffic.own_veh_per_h=9000", "simulation.warmup_s=150")
LONG_FULL = ("traffic.own_veh_per_h=9000", "simulation.warmup_s=385")
ENTERING = 5  # steps in which vehicles are taken over, which costs more than driving


def drive(folder, n_egos, *overrides, planner=None):
    """Drive for six seconds; (steps,)."""
    steps = []
    scenario = load_scenario(
        "motorway",
        planner=planner,
        overrides=(
            *overrides,
            "simulation.duration_s=6",
            "egos.penetration=null",
            f"egos.count={n_egos}",
        ),
    )
    run_scenario(scenario, out=folder, on_step=steps.append)
    return steps[ENTERING:]


@pytest.fixture(scope="module", autouse=True)
def warm(tmp_path_factory):
    for planner in ("cruise", "lane_change"):
        drive(tmp_path_factory.mktemp("warm"), 20, *FULL, planner=planner)


@pytest.fixture(scope="module")
def long_motorway(tmp_path_factory):
    """Return the override that makes the straight motorway 11 km long."""
    network = tmp_path_factory.mktemp("long") / "long.net.xml"
    text = net_path("motorway").read_text(encoding="utf-8")
    network.write_text(text.replace("5000.00", "11000.00"), encoding="utf-8")
    return f"network={{file: {network}, from: own, to: own}}"


def note(benchmark, steps):
    """Keep how many drive, and the CPU time of a step."""
    vehicles = np.median([len(step.snapshot.users.ids) for step in steps])
    cpu = [1e3 * step.cpu_s for step in steps]
    benchmark.extra_info["egos"] = float(np.median([len(step.egos) for step in steps]))
    benchmark.extra_info["vehicles"] = float(vehicles)
    benchmark.extra_info["step_cpu_ms_p50"] = float(np.median(cpu))
    benchmark.extra_info["step_cpu_ms_min"] = float(np.min(cpu))


@pytest.mark.parametrize("n_egos", [20, 80, 160])
def test_a_step_with_many_egos(benchmark, tmp_path, n_egos):
    steps = benchmark.pedantic(drive, args=(tmp_path, n_egos, *FULL), rounds=1)
    note(benchmark, steps)
    assert benchmark.extra_info["egos"] >= 0.9 * n_egos


def test_a_step_with_200_egos_among_200_others(benchmark, tmp_path, long_motorway):
    args = (tmp_path, 200, *LONG_FULL, long_motorway)
    steps = benchmark.pedantic(drive, args=args, rounds=1)
    note(benchmark, steps)
    assert benchmark.extra_info["egos"] >= 195
    assert benchmark.extra_info["vehicles"] >= 390


def test_a_step_with_50_egos_that_change_lanes(benchmark, tmp_path):
    steps = benchmark.pedantic(
        drive,
        args=(tmp_path, 50, *FULL),
        kwargs={"planner": "lane_change"},
        rounds=1,
    )
    note(benchmark, steps)
    assert benchmark.extra_info["egos"] >= 45
