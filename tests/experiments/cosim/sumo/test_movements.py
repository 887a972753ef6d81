"""Vehicles at junctions: distances against SUMO's own, ways against what is driven."""

from contextlib import contextmanager

import libsumo
import numpy as np
import pytest
import shapely

from experiments.cosim.sumo.movements import MovementReader
from experiments.cosim.sumo.vehicle_reader import PERSON, VehicleReader
from experiments.world_setup.road import sumo_road
from planner.prediction import constant_speed
from planner.vehicle import Vehicle
from planner.ways import NO_WAY, along_ways
from sumo_nets.catalogue import Network, network
from tests.experiments.road_users import road_users
from tests.sumo_nets.generated import generate

pytestmark = pytest.mark.sumo

STEP = 0.1


@pytest.fixture
def crossing(tmp_path):
    """Start the crossing with two vehicles; the one called ego has the ego's way."""

    def start(name, other):
        net = network(name)
        routes = tmp_path / "r.rou.xml"
        routes.write_text(
            '<routes><vType id="car" length="4" width="1.8" sigma="0" speedDev="0"/>'
            '<vehicle id="ego" type="car" depart="0">'
            f'<route edges="{" ".join(net.route)}"/></vehicle>'
            '<vehicle id="foe" type="car" depart="1" departSpeed="max">'
            f'<route edges="{" ".join(other)}"/></vehicle></routes>'
        )
        command = ["sumo", "-n", str(net.net_file), "-r", str(routes)]
        libsumo.start([*command, "--step-length", str(STEP), "--no-step-log"])
        road = sumo_road(net, Vehicle())
        reader = VehicleReader(libsumo, {"ego"})
        return road, reader, MovementReader(libsumo, road.junctions)

    yield start
    if libsumo.isLoaded():
        libsumo.close()


def found(reader, movements, number=0):
    users = reader.near((0.0, 0.0), 1000.0)
    foes, ways = movements.read({number}, users)
    return users, foes, ways


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("right_before_left", ("east_in", "west_out")),
        ("right_before_left", ("north_in", "east_out")),
        ("stop_sign", ("west_in", "east_out")),
        ("all_way_stop", ("south_in", "north_out")),
    ],
)
def test_distances_are_those_that_sumo_measures(crossing, name, other):
    """`getJunctionFoes` gives each foe's distance to the zone as SUMO draws it."""
    _, reader, movements = crossing(name, other)
    compared = 0
    for _ in range(250):
        libsumo.simulationStep()
        if "ego" not in libsumo.vehicle.getIDList():
            continue
        theirs = libsumo.vehicle.getJunctionFoes("ego", 500.0)
        users, foes, _ = found(reader, movements)
        if not (foes and theirs and "foe" in users.ids):
            continue
        lane = libsumo.vehicle.getLaneID("foe")
        if not lane.startswith(":"):
            left = libsumo.lane.getLength(lane) - libsumo.vehicle.getLanePosition("foe")
            assert foes[0].to_line == pytest.approx(left)
        # SUMO's zones are those of bare lanes: ours begin earlier, by less than a car
        distance = theirs[0][2]
        if distance > 0.0:
            assert -1.0 < distance - foes[0].entry < 5.0
            compared += 1
    assert compared > 30


@contextmanager
def on_a_grid(folder, vehicles):
    """Drive vehicles on a grid, past whose junction B1 a road leads."""
    file = generate(folder, "--grid", "--grid.number=3", "--grid.length=60")
    routes = folder / "r.rou.xml"
    routes.write_text(f"<routes>{vehicles}</routes>")
    road = sumo_road(Network("", file, ("A1B1", "B1C1"), 0, (), ""), Vehicle())
    libsumo.start(["sumo", "-n", str(file), "-r", str(routes), "--step-length", "0.1"])
    try:
        yield road, VehicleReader(libsumo, set())
    finally:
        libsumo.close()


def test_distances_shrink_as_a_vehicle_drives_also_in_junctions_before(tmp_path):
    foe = (
        '<vehicle id="foe" depart="0" departSpeed="max">'
        '<route edges="C2B2 B2B1 B1B0"/></vehicle>'
    )
    with on_a_grid(tmp_path, foe) as (road, reader):
        movements = MovementReader(libsumo, road.junctions)
        entries, speeds, lanes = [], [], []
        while len(entries) < 250 and (not entries or entries[-1] > 0.0):
            libsumo.simulationStep()
            _, foes, _ = found(reader, movements)
            entries += [foe.entry for foe in foes]
            speeds += [foe.speed for foe in foes]
            lanes += [libsumo.vehicle.getLaneID("foe") for _ in foes]
    assert any(lane.startswith(":B2") for lane in lanes)
    driven = STEP * np.array(speeds[1:])
    assert np.abs(np.diff(entries) + driven).max() < 0.3


@pytest.mark.parametrize("beyond", [(), ("B1B0",)])
def test_an_ego_of_which_sumo_knows_a_part_is_met_behind_it(tmp_path, beyond):
    """It goes on over the junction of another ego, where its own route comes twice."""
    other = '<vehicle id="other" depart="0"><route edges="C2B2 B2B1"/></vehicle>'
    with on_a_grid(tmp_path, other) as (road, reader):
        known = {"other": beyond}
        movements = MovementReader(libsumo, road.junctions, known.__getitem__)
        for _ in range(20):
            libsumo.simulationStep()
        _, foes, _ = found(reader, movements)
    assert bool(foes) is bool(beyond)
    assert all(foe.vehicle == "other" and 50.0 < foe.to_line < 120.0 for foe in foes)


def test_a_way_is_where_the_vehicle_drives(crossing):
    road, reader, movements = crossing("right_before_left", ("north_in", "west_out"))
    times = STEP * np.arange(31)
    predictions, driven = {}, {}
    for k in range(260):
        libsumo.simulationStep()
        users, _, ways = found(reader, movements)
        if "foe" not in users.ids:
            continue
        row = users.ids.index("foe")
        driven[k] = (float(users.x[row]), float(users.y[row]))
        plain = constant_speed(road.path, users, times)
        made = along_ways(plain, road.path, users, ways, times, brake=False)
        line = np.column_stack([made.x[row], made.y[row]])
        predictions[k] = line
    assert len(driven) > 100
    for k, line in predictions.items():
        for later in range(k, k + 30, 5):
            if later in driven and np.hypot(*np.subtract(driven[later], driven[k])) > 1:
                place = shapely.Point(driven[later])
                near = shapely.LineString(line).distance(place)
                ahead = np.hypot(*(line[-1] - line[0]))
                if np.hypot(*np.subtract(driven[later], line[0])) < ahead:
                    # SUMO draws a car back from its front: in a turn it cuts in
                    assert near < 1.0


def test_people_on_foot_have_no_way(crossing):
    _, _, movements = crossing("t_junction", ("west_in", "east_out"))
    libsumo.simulationStep()
    walker = road_users((f"{PERSON}p", 0.0, 0.0, 0.0, 1.2, 0.0), length=0.3, width=0.5)
    foes, ways = movements.read({0}, walker)
    assert foes == ()
    assert ways.way.tolist() == [NO_WAY]


def test_those_with_the_ego_s_right_of_way_are_told_apart(crossing):
    _, reader, movements = crossing("t_junction", ("west_in", "east_out"))
    for _ in range(60):
        libsumo.simulationStep()
    _, foes, _ = found(reader, movements)
    assert [(foe.vehicle, foe.goes_first, foe.gives_way) for foe in foes] == [
        ("foe", True, False)
    ]
