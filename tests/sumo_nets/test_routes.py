from itertools import pairwise

import numpy as np
import pytest

from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import read_net
from sumo_nets.route_check import check_route
from sumo_nets.routes import fastest_route, length_of, onward_edges, random_route
from tests.sumo_nets.generated import generate


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    return read_net(generate(folder, "--grid", "--grid.number=4", "--seed=3"))


def times(net, begin):
    """Relax all edges until nothing changes (Bellman and Ford)."""
    edges = net.roads
    best = {begin: 0.0}
    for _ in edges:
        for edge in edges:
            for after in onward_edges(edge):
                if edge.id in best:
                    time = length_of(after) / after.lanes[0].speed
                    known = best.get(after.id, np.inf)
                    best[after.id] = min(known, best[edge.id] + time)
    return best


def test_fastest_route_takes_the_least_time(grid):
    ids = sorted(edge.id for edge in grid.roads)
    best = times(grid, ids[0])
    assert len(best) > 30
    for end in ids[1::5]:
        route = fastest_route(grid, [ids[0], end])
        check_route(grid, route)
        assert (route[0], route[-1]) == (ids[0], end)
        edges = [grid.edges[edge] for edge in route[1:]]
        took = sum(length_of(edge) / edge.lanes[0].speed for edge in edges)
        assert took == pytest.approx(best[end])


def test_fastest_route_goes_by_its_places(grid):
    ids = sorted(edge.id for edge in grid.roads)
    route = fastest_route(grid, [ids[0], ids[20], ids[9]])
    check_route(grid, route)
    assert ids[20] in route


def test_way_that_does_not_exist_is_refused(grid):
    with pytest.raises(NetworkError, match='no edge "nowhere"'):
        fastest_route(grid, ["A0A1", "nowhere"])


def test_random_routes_are_drivable_long_and_the_seed_s_own(grid):
    routes = [random_route(grid, np.random.default_rng(k), 300.0) for k in range(20)]
    again = [random_route(grid, np.random.default_rng(k), 300.0) for k in range(20)]
    assert routes == again
    assert len(set(routes)) > 10
    for route in routes:
        check_route(grid, route)
        assert len(set(route)) == len(route) >= 3
        edges = [grid.edges[edge] for edge in route]
        assert sum(map(length_of, edges)) >= 300.0
        assert all(a.start != b.end for a, b in pairwise(edges))


def test_network_without_room_for_a_route_is_refused(grid):
    with pytest.raises(NetworkError, match="no route of 100000 m"):
        random_route(grid, np.random.default_rng(0), 1e5)
    with pytest.raises(NetworkError, match="no edge of 500 m"):
        random_route(grid, np.random.default_rng(0), 300.0, 500.0)
