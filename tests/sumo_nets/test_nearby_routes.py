import pytest

from sumo_nets.demand import Demand, vehicles_for
from sumo_nets.nearby_routes import crossing_routes, turning_routes
from sumo_nets.net_reader import read_net
from sumo_nets.network import Network
from sumo_nets.route_check import check_route
from tests.sumo_nets.generated import generate

ROUTE = ("A1B1", "B1C1", "C1D1")


@pytest.fixture(scope="module")
def net(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    return read_net(generate(folder, "--grid", "--grid.number=4", "--grid.length=150"))


def test_every_other_road_into_the_junctions_crosses_or_turns(net):
    found = crossing_routes(net, ROUTE)
    assert set(found) == {"B0B1", "B2B1", "C1B1", "C0C1", "C2C1", "D1C1"}
    for arm, routes in found.items():
        assert len(routes) == 3  # on, to the left, to the right
        for route in routes:
            check_route(net, route)
            assert arm in route
    assert {route[1] for route in found["B0B1"]} == {"B1A1", "B1B2", "B1C1"}


def test_traffic_leaves_the_route_at_each_junction(net):
    ends = {route[-2:] for route in turning_routes(net, ROUTE)}
    assert {first for first, _ in ends} == {"B1B0", "B1B2", "C1C0", "C1C2"}


def test_flow_of_crossing_roads_is_that_of_the_demand(net):
    network = Network.from_file(net.file, ROUTE)
    network.check()
    demand = Demand(own_veh_per_h=600.0, cross_veh_per_h=400.0)
    vehicles = vehicles_for(network, demand, 1, 0.0, 1800.0)
    arms = {x.name for x in network.streams if x.name.startswith("cross_")}
    assert len(arms) == 4  # the other two are oncoming
    for arm in arms:
        count = sum(x.id.startswith(f"{arm}.") for x in vehicles)
        assert 150 < count < 250
    own = [x.route for x in vehicles if x.id.startswith("own.")]
    assert 0.55 < own.count(ROUTE) / len(own) < 0.85
