"""What SUMO's own traffic does in a field of obstacles, without an ego."""

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.lanes import all_lanes
from experiments.cosim.sumo.obstacle_vehicles import ID_PREFIX, place, twins
from experiments.world_setup.layout import make_layout
from experiments.world_setup.traffic import make_demand
from sumo_nets.demand import write_demand

libsumo = pytest.importorskip("libsumo")

pytestmark = pytest.mark.sumo

FEW_SMALL = tuple(
    f"obstacles.field.{key}" for key in ("radii_m=[0.71]", "gap_m=15", "count=10")
)


def through(tmp_path, *overrides):
    """Let 300 vehicles an hour depart for 200 s; how many, and how many got through."""
    traffic = ("traffic.own_veh_per_h=300", *overrides)
    scenario = load_scenario("dense", seed=1, overrides=traffic)
    layout = make_layout(scenario)
    routes = tmp_path / "traffic.rou.xml"
    demand = make_demand(scenario, layout)
    vehicles = write_demand(layout.network, demand, 1, 0.0, 200.0, routes)
    command = ["sumo", "-n", layout.network.net_file, "-r", routes, "--seed", "1"]
    command += ["--step-length", "0.1", "--time-to-teleport", "-1", "--no-step-log"]
    libsumo.start([*map(str, command), "--lanechange.duration", "2.5", "--no-warnings"])
    try:
        place(libsumo, twins(layout.road.obstacles, all_lanes(libsumo)), "ego")
        arrived = []
        for _ in range(4000):
            libsumo.simulationStep()
            arrived += libsumo.simulation.getArrivedIDList()
    finally:
        libsumo.close()
    return len(vehicles), sum(not name.startswith(ID_PREFIX) for name in arrived)


def test_traffic_passes_few_small_obstacles(tmp_path):
    departed, arrived = through(tmp_path, *FEW_SMALL)
    assert departed >= 10
    assert arrived >= 0.8 * departed


def test_no_traffic_passes_the_four_sizes(tmp_path):
    _, arrived = through(tmp_path)
    assert arrived == 0
