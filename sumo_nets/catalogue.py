"""The road networks of the package, and networks of users.

The four roads of the cruise planner have the same cross-section: two carriageways of
three lanes of 10/3 m, right-hand traffic, 50 km/h. The ego's reference line is the
centre line of the middle lane; scenario road s = 0 lies `LEAD_IN` after the begin of
that line. The one-way roads for lane changes have lanes of 3.5 m and 60 km/h; there
the reference line is the lane that the ego starts in. The one-way roads for dense
obstacles are one carriageway of the first kind.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from math import pi
from types import MappingProxyType

from sumo_nets.build import net_path
from sumo_nets.centre_line import Segment, arc, clothoid, line
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import check_complete
from sumo_nets.network import Network, Stream, Turn

# Road for background traffic behind the place where scenarios begin [m].
LEAD_IN = 100.0


def networks() -> Mapping[str, Network]:
    """List the networks of the package by name."""
    records = (
        _straight(),
        _curved(),
        _intersection(),
        _u_shaped(),
        _one_way("lane_change", 3, 0, "straight one-way road of 1.8 km, two lanes"),
        _one_way(
            "lane_change_three", 3, 1, "straight one-way road of 1.8 km, three lanes"
        ),
        _one_way("lane_change_curved", 9, 0, "winding one-way road, two lanes"),
        _one_way(
            "lane_change_end", 2, 1, "straight one-way road, the right lane of two ends"
        ),
        _dense(),
        _dense_curved(),
        *_crossroads(),
        *_for_many_egos(),
        _crossing(),
        _lane_drop(),
        _on_ramp(),
        _town(),
    )
    return MappingProxyType({record.name: record for record in records})


def network(name: str) -> Network:
    """Get a network of the package.

    Raises:
        NetworkError: If there is no such network, or its file is damaged.
    """
    known = networks()
    if name not in known:
        raise NetworkError(f'no network "{name}"; there are {", ".join(sorted(known))}')
    record = known[name]
    check_complete(record.net_file)
    return record


def _road(name: str, segments: tuple[Segment, ...], description: str) -> Network:
    """Describe a road without junctions; `segments` without the lead-in.

    A road with bends has one edge for each segment, numbered in travel direction.
    """
    numbers = range(1, len(segments) + 1) if len(segments) > 1 else ("",)
    own = tuple(f"own{number}" for number in numbers)
    oncoming = tuple(f"oncoming{number}" for number in numbers)
    return Network(
        name=name,
        net_file=net_path(name),
        route=own,
        lane=1,
        streams=(
            Stream("own", (Turn(own, 1.0),)),
            Stream("oncoming", (Turn(oncoming, 1.0),)),
        ),
        description=description,
        segments=(line(LEAD_IN), *segments),
    )


def _one_way(name: str, n_edges: int, lane: int, description: str) -> Network:
    """Describe a one-way road for lane changes; `lane` is the reference line."""
    edges = tuple(f"own{n}" for n in range(1, n_edges + 1)) if n_edges > 1 else ("own",)
    return Network(
        name=name,
        net_file=net_path(name),
        route=edges,
        lane=lane,
        streams=(Stream("own", (Turn(edges, 1.0),)),),
        description=description,
    )


def _obstacle_road(
    name: str, segments: tuple[Segment, ...], description: str
) -> Network:
    """Describe a road for dense obstacles: one carriageway of a road, no oncoming."""
    road = _road(name, segments, description)
    own = tuple(stream for stream in road.streams if stream.name == "own")
    return replace(road, streams=own)


def _dense() -> Network:
    """Describe the straight road for dense obstacles."""
    return _obstacle_road("dense", (line(500.0),), "straight one-way road of 600 m")


def _dense_curved() -> Network:
    """Describe the winding road for dense obstacles."""
    wide, sharp = 1.0 / 50.0, 1.0 / 40.0
    segments = (
        line(40.0),
        clothoid(20.0, 0.0, wide),
        arc(40.0, wide),
        clothoid(40.0, wide, -wide),
        arc(40.0, -wide),
        clothoid(40.0, -wide, sharp),
        arc(40.0, sharp),
        clothoid(40.0, sharp, -sharp),
        arc(40.0, -sharp),
        clothoid(20.0, -sharp, 0.0),
        line(140.0),
    )
    description = "winding one-way road of 600 m, radii of 50 m and 40 m"
    return _obstacle_road("dense_curved", segments, description)


def _straight() -> Network:
    """Describe the straight road."""
    return _road("straight", (line(400.0),), "straight road of 400 m")


def _curved() -> Network:
    """Describe the S-shaped road."""
    k = 1.0 / 60.0
    segments = (
        line(15.0),
        clothoid(15.0, 0.0, k),
        arc(40.0, k),
        clothoid(30.0, k, -k),
        arc(40.0, -k),
        clothoid(15.0, -k, 0.0),
        line(200.0),
    )
    return _road("curved", segments, "left and right bend of 60 m radius")


def _u_shaped() -> Network:
    """Describe the U-shaped road."""
    segments = (line(40.0), arc(20.0 * pi, 1.0 / 20.0), line(250.0))
    return _road("u_shaped", segments, "bend of 180 degrees to the left, radius 20 m")


def _intersection() -> Network:
    """Describe the signalised intersection."""
    clockwise = ("west", "north", "east", "south")

    def turns(arm: str) -> tuple[Turn, ...]:
        """Return the turns from `arm`; half of the traffic turns left."""
        place = clockwise.index(arm)
        shares = ((1, 0.5), (2, 0.35), (3, 0.15))  # left, straight on, right
        return tuple(
            Turn((f"{arm}_in", f"{clockwise[(place + step) % 4]}_out"), share)
            for step, share in shares
        )

    return Network(
        name="intersection",
        net_file=net_path("intersection"),
        route=("west_in", "north_out"),
        lane=1,
        streams=(
            Stream("own", turns("west")),
            Stream("oncoming", turns("east")),
            Stream("cross_n", turns("north")),
            Stream("cross_s", turns("south")),
        ),
        description="left turn of 15 m radius at traffic lights, one arm at a time",
        segments=(
            line(LEAD_IN),
            line(40.0),
            arc(7.5 * pi, 1.0 / 15.0),
            line(250.0),
        ),
    )


def _for_many_egos() -> tuple[Network, ...]:
    """Describe the roads on which traffic with many egos is measured."""
    circle = tuple(f"ring{number}" for number in range(8))
    ramp = Stream("cross_ramp", (Turn(("ramp", "own2", "own3"), 1.0),))
    merge = _one_way("merge_ramp", 3, 0, "motorway of two lanes with a ramp")
    ring = _one_way("ring", 1, 0, "circle of 230 m, one lane")
    return (
        _one_way("motorway", 1, 1, "straight motorway of 5 km, three lanes"),
        _one_way("bottleneck", 2, 1, "motorway of 2.6 km, one of three lanes ends"),
        replace(merge, streams=(*merge.streams, ramp)),
        replace(ring, route=circle, streams=(Stream("own", (Turn(circle, 1.0),)),)),
    )


# counter-clockwise, as traffic goes round a roundabout
ARMS = ("east", "north", "west", "south")


def _crossroads() -> tuple[Network, ...]:
    """Describe the junctions where vehicles give way to each other."""
    without_north = ("east", "west", "south")
    return (
        _junction(
            "t_junction",
            "south",
            "west",
            "left turn onto a main road: give way",
            without_north,
        ),
        _junction(
            "stop_sign", "south", "north", "straight over a main road from a stop sign"
        ),
        _junction(
            "all_way_stop", "west", "north", "left turn where every arm has a stop sign"
        ),
        _junction(
            "right_before_left",
            "south",
            "north",
            "straight on where the right goes first",
        ),
        _junction(
            "unprotected_left",
            "west",
            "north",
            "left turn at signals, across oncoming traffic",
        ),
        _junction(
            "left_hand",
            "south",
            "east",
            "right turn onto a main road where traffic keeps to the left: give way",
            without_north,
        ),
        _junction(
            "roundabout", "south", "north", "half round a roundabout of 22 m radius"
        ),
    )


def _junction(
    name: str,
    begin: str,
    end: str,
    description: str,
    arms: tuple[str, ...] = ARMS,
) -> Network:
    """Describe a junction of two-way roads; all arms have traffic in all directions."""

    def way(first: str, second: str) -> tuple[str, ...]:
        """Return the edges from one arm to another."""
        ring: tuple[str, ...] = ()
        if name == "roundabout":
            place, steps = (
                ARMS.index(first),
                (ARMS.index(second) - ARMS.index(first)) % 4,
            )
            corners = [ARMS[(place + step) % 4] for step in range(steps + 1)]
            ring = tuple(f"ring_{a}_{b}" for a, b in pairwise(corners))
        return (f"{first}_in", *ring, f"{second}_out")

    def stream(title: str, arm: str) -> Stream:
        """Return the traffic from an arm, the same to all others."""
        others = [other for other in arms if other != arm]
        return Stream(title, tuple(Turn(way(arm, other), 1.0) for other in others))

    opposite = ARMS[(ARMS.index(begin) + 2) % 4]
    streams = [stream("own", begin)]
    if opposite in arms:
        streams.append(stream("oncoming", opposite))
    sides = [arm for arm in arms if arm not in (begin, opposite)]
    streams += [stream(f"cross_{arm[0]}", arm) for arm in sides]
    return Network(
        name=name,
        net_file=net_path(name),
        route=way(begin, end),
        lane=0,
        streams=tuple(streams),
        description=description,
    )


def _crossing() -> Network:
    """Describe the street with crossings for people on foot."""
    ahead, back = ("west_in", "street_in"), ("street_out", "west_out")
    side, east = ("south_out", "south_in"), ("east_out", "east_in")
    return Network(
        name="crossing",
        net_file=net_path("crossing"),
        route=(*ahead, side[0]),
        lane=1,  # lane 0 is the pavement
        streams=(
            Stream("own", (Turn((*ahead, east[0]), 1.0), Turn((*ahead, side[0]), 1.0))),
            Stream("oncoming", (Turn((east[1], *back), 1.0),)),
            Stream("cross_s", (Turn((side[1], *back), 1.0),)),
        ),
        description="zebra crossing of a street, then a right turn over another",
    )


def _lane_drop() -> Network:
    """Describe the road whose right lane ends; the ego enters on that one."""
    return Network(
        name="lane_drop",
        net_file=net_path("lane_drop"),
        route=("wide", "narrow"),
        lane=0,
        streams=(Stream("own", (Turn(("wide", "narrow"), 1.0),)),),
        description="two lanes become one, and the ego's is the one that ends",
    )


def _on_ramp() -> Network:
    """Describe the ramp that joins a road of two lanes."""
    main = ("main_in", "beside", "main_out")
    ramp = ("ramp", "beside", "main_out")
    return Network(
        name="on_ramp",
        net_file=net_path("on_ramp"),
        route=ramp,
        lane=0,
        streams=(
            Stream("own", (Turn(ramp, 1.0),)),
            Stream("cross_m", (Turn(main, 1.0),)),
        ),
        description="ramp onto a road of two lanes, whose lane ends after 220 m",
    )


# Junctions of the tour through the town: column and row of its grid.
TOUR = (
    *("00", "10", "20", "21", "31", "41", "42", "32", "33"),
    *("23", "22", "21", "11", "01", "02", "12", "13"),
)


@lru_cache(maxsize=1)
def _town() -> Network:
    """Describe the town, with a tour over junctions of all its kinds."""
    tour = tuple(f"{a}_{b}" for a, b in pairwise(TOUR))
    found = Network.from_file(net_path("town"), tour, 0)
    words = "tour of 2.3 km over 17 junctions of a town, of all kinds"
    return replace(found, description=words)
