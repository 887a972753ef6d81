"""A generated town with SUMO's own demand: cars, bicycles, buses, people on foot."""

import numpy as np

from sumo_nets.net_reader import read_net
from sumo_nets.routes import random_route
from tests.sumo_nets.generated import generate

TYPES = """<vType id="car" vClass="passenger"/>
<vType id="bicycle" vClass="bicycle" maxSpeed="5.5"/>
<vType id="bus" vClass="bus"/>
"""


def make_town(
    folder, n_vehicles=1000, n_buses=20, n_persons=100, *, size=8, seconds=300
):
    """Generate network, stops and demand; returns (network, .sumocfg, routes).

    A tenth of the vehicles are bicycles. The routes are those of the vehicles, by
    number.
    """
    net_file = generate(
        folder, "--grid", f"--grid.number={size}", "--grid.length=200", "-L2",
        "--default-junction-type=traffic_light", "--tls.default-type=actuated",
        "--sidewalks.guess", "--crossings.guess",
    )  # fmt: skip
    net, rng = read_net(net_file), np.random.default_rng(1)
    routes = [random_route(net, rng, 900.0, 100.0) for _ in range(n_vehicles)]
    departs = np.sort(rng.uniform(0.0, seconds, n_vehicles)).round(2)
    stops = [net.edges[routes[k][1]].drivable_lanes[0] for k in range(n_buses)]
    lines = [
        f'<busStop id="stop{k}" lane="{lane.id}" startPos="40" endPos="70"/>'
        for k, lane in enumerate(stops)
    ]
    (folder / "stops.add.xml").write_text(
        "<additional>\n" + "\n".join(lines) + "\n</additional>\n"
    )
    lines = []
    for k, (route, depart) in enumerate(zip(routes, departs, strict=True)):
        bus = k < n_buses
        kind = "bus" if bus else "bicycle" if k % 10 == 0 else "car"
        stop = f'<stop busStop="stop{k}" duration="10"/>' if bus else ""
        edges = " ".join(route)
        lines.append(
            f'<vehicle id="v{k}" type="{kind}" depart="{depart}" departLane="best">'
            f'<route edges="{edges}"/>{stop}</vehicle>'
        )
        if k < n_persons:
            lines.append(
                f'<person id="p{k}" depart="{depart}"><walk edges="{edges}"/></person>'
            )
    (folder / "town.rou.xml").write_text(
        "<routes>\n" + TYPES + "\n".join(lines) + "\n</routes>\n"
    )
    config = folder / "town.sumocfg"
    config.write_text(
        "<configuration><input>"
        f'<net-file value="{net_file.name}"/><route-files value="town.rou.xml"/>'
        '<additional-files value="stops.add.xml"/></input>'
        '<time><begin value="0"/></time></configuration>'
    )
    return net_file, config, routes
