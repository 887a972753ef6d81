"""Lanes of a route do not cross lines that the network closes to changes."""

import pytest

from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net

LANE = (
    '<lane id="{edge}_{k}" index="{k}" speed="13" length="99"{lines} '
    'shape="{x0},{y} {x1},{y}"/>'
)


def network(folder, **lines):
    """Three edges of two lanes; from the last but one only its left lane leads on."""
    text = '<net version="1.20">'
    for number, edge in enumerate("abc"):
        text += f'<edge id="{edge}" from="n{number}" to="n{number + 1}">'
        for k in (0, 1):
            own = lines.get(edge, "") if k == 0 else ""
            x = {"x0": 100 * number, "x1": 100 * number + 99.8}
            text += LANE.format(edge=edge, k=k, lines=own, y=3.2 * k, **x)
        text += "</edge>"
    for source, target, lanes in (("a", "b", (0, 1)), ("b", "c", (1,))):
        for k in lanes:
            text += (
                f'<connection from="{source}" to="{target}" fromLane="{k}" '
                f'toLane="{k}" dir="s" state="M"/>'
            )
    file = folder / "n.net.xml"
    file.write_text(text + "</net>")
    return read_net(file)


SOLID = ' changeLeft="emergency"'


@pytest.mark.parametrize(
    ("lines", "begins"),
    [({"b": SOLID}, 0), ({"a": SOLID}, 0), ({"a": SOLID, "b": SOLID}, 1)],
)
def test_lanes_change_where_the_line_is_open(tmp_path, lines, begins):
    """With solid lines everywhere the route begins in the lane that leads on."""
    uses = choose_lanes(network(tmp_path, **lines), ("a", "b", "c"), 0)
    found = {x.left.edge.id: (x.entered.index, x.left.index) for x in uses}
    assert found["b"][1] == 1
    for edge, (entered, left) in found.items():
        crosses = entered < left and edge in lines
        assert not crosses
    if begins:
        assert uses[0].entered.index == begins
