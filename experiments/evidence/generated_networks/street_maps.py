"""Random street maps in OpenStreetMap's format, drawn as people draw real towns.

What netgenerate does not make is in them: streets that bend between corners, junctions
at odd angles and a few metres apart, dual carriageways, roundabouts, turn lanes that
open before a junction, one-way streets, stop signs.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Final, NamedTuple
from xml.etree import ElementTree

from experiments.storage.atomic_folder import write_atomically

ORIGIN: Final = (48.1, 11.5)  # latitude and longitude of the corner [degrees]
METRE: Final = 1.0 / 111_320.0  # of latitude [degrees]

ROWS, COLUMNS = (3, 5), (3, 5)  # streets each way, least and most
BLOCK: Final = (70.0, 170.0)  # between them [m]
JITTER: Final = 0.22  # of a corner, as a share of the block
GAPS: Final = 0.15  # share of blocks without the street between two corners
BULGE: Final = 0.12  # most that a street bends aside, as a share of its length
BENT: Final = 0.6  # share of the streets that do
APART: Final = (8.0, 14.0)  # the carriageways of a dual one [m]
RING: Final = (11.0, 18.0)  # radius of a roundabout [m]
RING_CORNERS: Final = 12
ROUNDABOUTS: Final = 0.12  # share of the corners
SIGNALS: Final = 0.6  # share of the corners of two main streets
STOPS: Final = 0.3  # share of the side streets, at one of their ends
POCKET: Final = (25.0, 45.0)  # length of turn lanes [m]
TURN_LANES: Final = 0.4  # share of the ways from main streets to signals
ONE_WAY: Final = 0.15  # share of the side streets
DIAGONAL: Final = 4  # rows from which a street leads across the blocks
DUAL: Final = 0.5  # share of the wide streets with two carriageways
NEAR: Final = 30.0  # a side street is this long before its corner, for a sign [m]
SIGN: Final = 0.3  # of that, from the sign to the corner


class Street(NamedTuple):
    """A kind of street."""

    highway: str
    lanes: int  # both ways together
    speed: int  # [km/h]
    is_main: bool


MAIN: Final = (
    Street("primary", 4, 60, is_main=True),
    Street("secondary", 2, 50, is_main=True),
)
SIDE: Final = (
    Street("tertiary", 2, 50, is_main=False),
    Street("residential", 2, 30, is_main=False),
    Street("residential", 1, 30, is_main=False),  # as mapped: nobody counted
)


@dataclass(slots=True)
class _Map:
    """A document that grows."""

    root: ElementTree.Element = field(
        default_factory=lambda: ElementTree.Element("osm", version="0.6")
    )
    nodes: list[tuple[float, float]] = field(default_factory=list)
    ways: list[tuple[list[int], dict[str, str]]] = field(default_factory=list)
    tags: dict[int, dict[str, str]] = field(default_factory=dict)

    def node(self, x: float, y: float, **tags: str) -> int:
        """Add a node; returns its number."""
        self.nodes.append((x, y))
        number = len(self.nodes) - 1
        if tags:
            self.tags[number] = tags
        return number

    def way(self, nodes: list[int], tags: dict[str, str]) -> None:
        """Add a way."""
        self.ways.append((nodes, tags))

    def text(self) -> str:
        """Write the document."""
        scale = METRE / math.cos(math.radians(ORIGIN[0]))
        for number, (x, y) in enumerate(self.nodes, start=1):
            place = {"lat": f"{ORIGIN[0] + METRE * y:.7f}", "id": str(number)}
            place["lon"] = f"{ORIGIN[1] + scale * x:.7f}"
            element = ElementTree.SubElement(self.root, "node", place, version="1")
            _tag(element, self.tags.get(number - 1, {}))
        for number, (nodes, tags) in enumerate(self.ways, start=1):
            element = ElementTree.SubElement(
                self.root, "way", id=str(number), version="1"
            )
            for node in nodes:
                ElementTree.SubElement(element, "nd", ref=str(node + 1))
            _tag(element, tags)
        ElementTree.indent(self.root)
        return ElementTree.tostring(self.root, encoding="unicode") + "\n"


def _tag(element: ElementTree.Element, tags: dict[str, str]) -> None:
    """Add tags to an element."""
    for key, value in tags.items():
        ElementTree.SubElement(element, "tag", k=key, v=value)


class _Corner(NamedTuple):
    """Where streets meet; a roundabout has a node for each direction."""

    x: float
    y: float
    nodes: tuple[int, ...]
    radius: float  # 0 without a roundabout [m]
    signal: bool

    def towards(self, x: float, y: float) -> int:
        """Return the node at which a street from there arrives."""
        if len(self.nodes) == 1:
            return self.nodes[0]
        share = math.atan2(y - self.y, x - self.x) / (2.0 * math.pi)
        return self.nodes[round(share * len(self.nodes)) % len(self.nodes)]


def write_street_map(number: int, file: Path) -> None:
    """Write a map; the same number gives the same bytes."""
    draw, drawn = Random(number), _Map()
    rows, columns = draw.randint(*ROWS), draw.randint(*COLUMNS)
    across = [_street(draw, k) for k in range(rows)]
    along = [_street(draw, k) for k in range(columns)]
    x, y = _places(draw, columns), _places(draw, rows)
    corners = {
        (r, c): _corner(draw, drawn, (x[c], y[r]), (across[r], along[c]))
        for r in range(rows)
        for c in range(columns)
    }
    for r in range(rows):
        for c in range(columns):
            for to, street in (((r, c + 1), across[r]), ((r + 1, c), along[c])):
                if to in corners and draw.random() >= GAPS:
                    _join(draw, drawn, (corners[r, c], corners[to]), street)
    for k, (r, c) in enumerate(corners):  # dead ends lead out of the town
        if r in (0, rows - 1) and k % 2 == 0:
            out = -BLOCK[0] if r == 0 else BLOCK[0]
            _lead_out(draw, drawn, corners[r, c], (0.0, out), along[c])
    if rows >= DIAGONAL:
        _diagonal(draw, drawn, corners)
    write_atomically(file, drawn.text())


def _street(draw: Random, k: int) -> Street:
    """Draw the kind of a street: about every second is a main one."""
    return draw.choice(MAIN if k % 2 == draw.randint(0, 1) else SIDE)


def _places(draw: Random, count: int) -> list[float]:
    """Draw where parallel streets lie [m]."""
    found = [0.0]
    while len(found) < count:
        found.append(found[-1] + draw.uniform(*BLOCK))
    return found


def _corner(
    draw: Random, drawn: _Map, place: tuple[float, float], streets: tuple[Street, ...]
) -> _Corner:
    """Draw where two streets meet, and how."""
    x, y = (v + draw.uniform(-JITTER, JITTER) * BLOCK[0] for v in place)
    if draw.random() < ROUNDABOUTS:
        radius = draw.uniform(*RING)
        angles = [2.0 * math.pi * k / RING_CORNERS for k in range(RING_CORNERS)]
        ring = [
            drawn.node(x + radius * math.cos(a), y + radius * math.sin(a))
            for a in angles
        ]
        tags = {"highway": "tertiary", "junction": "roundabout", "maxspeed": "30"}
        drawn.way([*ring, ring[0]], tags)
        return _Corner(x, y, tuple(ring), radius, signal=False)
    signal = all(s.is_main for s in streets) and draw.random() < SIGNALS
    tags = {"highway": "traffic_signals"} if signal else {}
    return _Corner(x, y, (drawn.node(x, y, **tags),), 0.0, signal=signal)


def _join(
    draw: Random, drawn: _Map, corners: tuple[_Corner, _Corner], street: Street
) -> None:
    """Draw a street between two corners."""
    first, last = corners
    points = _bent(draw, first, last)
    begin, end = first.towards(last.x, last.y), last.towards(first.x, first.y)
    tags = {"highway": street.highway, "maxspeed": str(street.speed)}
    if street.lanes > 1:
        tags["lanes"] = str(street.lanes)
    if street.lanes == MAIN[0].lanes and draw.random() < DUAL:
        _dual(draw, drawn, (begin, points, end), tags, street)
        return
    if not street.is_main and draw.random() < ONE_WAY:
        tags.update({"oneway": "yes", "lanes": "1"})
        inside = [drawn.node(*p) for p in points]
        drawn.way([begin, *inside, end], tags)
        return
    _two_way(draw, drawn, (begin, points, end), tags, (street, last.signal))


def _bent(draw: Random, first: _Corner, last: _Corner) -> list[tuple[float, float]]:
    """Draw the points of a street between its corners, along an arc or straight."""
    dx, dy = last.x - first.x, last.y - first.y
    length = math.hypot(dx, dy)
    aside = draw.uniform(-BULGE, BULGE) * length if draw.random() < BENT else 0.0
    count = draw.randint(2, 5)
    points = []
    for k in range(1, count + 1):
        share = k / (count + 1)
        way = share * length
        if not first.radius + 4.0 < way < length - last.radius - 4.0:
            continue
        off = 4.0 * aside * share * (1.0 - share)
        points.append(
            (
                first.x + share * dx - off * dy / length,
                first.y + share * dy + off * dx / length,
            )
        )
    return points


def _dual(
    draw: Random,
    drawn: _Map,
    line: tuple[int, list[tuple[float, float]], int],
    tags: dict[str, str],
    street: Street,
) -> None:
    """Draw two carriageways that part behind one corner and join before the next."""
    begin, points, end = line
    half = 0.5 * draw.uniform(*APART)
    there = {**tags, "oneway": "yes", "lanes": str(street.lanes // 2)}
    (x0, y0), (x1, y1) = drawn.nodes[begin], drawn.nodes[end]
    length = math.hypot(x1 - x0, y1 - y0)
    aside = (-(y1 - y0) / length * half, (x1 - x0) / length * half)
    for sign in (-1.0, 1.0):
        inside = [
            drawn.node(x + sign * aside[0], y + sign * aside[1]) for x, y in points
        ]
        nodes = [begin, *inside, end]
        drawn.way(nodes if sign < 0.0 else nodes[::-1], there)


def _two_way(
    draw: Random,
    drawn: _Map,
    line: tuple[int, list[tuple[float, float]], int],
    tags: dict[str, str],
    towards: tuple[Street, bool],
) -> None:
    """Draw one carriageway, with turn lanes before a signal, or with a stop sign."""
    begin, points, end = line
    street, signal = towards
    inside = [drawn.node(*p) for p in points]
    (x, y), (x1, y1) = drawn.nodes[inside[-1] if inside else begin], drawn.nodes[end]
    left = math.hypot(x1 - x, y1 - y)
    pocket = draw.uniform(*POCKET)
    if (
        signal
        and street.is_main
        and left > pocket + 15.0
        and draw.random() < TURN_LANES
    ):
        share = 1.0 - pocket / left
        opens = drawn.node(x + share * (x1 - x), y + share * (y1 - y))
        drawn.way([begin, *inside, opens], tags)
        each = street.lanes // 2
        through = "|".join(["left", *["through"] * (each - 1), "through;right"])
        more = {
            "lanes": str(street.lanes + 1),
            "lanes:forward": str(each + 1),
            "lanes:backward": str(each),
            "turn:lanes:forward": through,
        }
        drawn.way([opens, end], {**tags, **more})
        return
    if not street.is_main and left > NEAR and draw.random() < STOPS:
        share = 1.0 - SIGN * NEAR / left
        stop = drawn.node(
            x + share * (x1 - x),
            y + share * (y1 - y),
            highway="stop",
            direction="forward",
        )
        inside.append(stop)
    drawn.way([begin, *inside, end], tags)


def _lead_out(
    draw: Random,
    drawn: _Map,
    corner: _Corner,
    way: tuple[float, float],
    street: Street,
) -> None:
    """Draw a street out of the town."""
    x, y = corner.x + draw.uniform(-30.0, 30.0) + way[0], corner.y + way[1]
    outside = _Corner(x, y, (drawn.node(x, y),), 0.0, signal=False)
    _join(draw, drawn, (outside, corner), street)


def _diagonal(
    draw: Random, drawn: _Map, corners: dict[tuple[int, int], _Corner]
) -> None:
    """Draw a street across the blocks: five and six legs at sharp angles."""
    k = 0
    while (k + 1, k + 1) in corners:
        pair = corners[k, k], corners[k + 1, k + 1]
        _join(draw, drawn, pair, MAIN[1])
        k += 1
