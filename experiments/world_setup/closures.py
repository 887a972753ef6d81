"""Closures: lanes that the listed obstacles close, checked before anything moves."""

import math
from collections.abc import Iterator

import numpy as np

from experiments.config import Obstacle, Scenario
from experiments.config.obstacles import ObstaclesConfig
from experiments.cosim.road import Closure
from experiments.cosim.sumo.settings import ClosedLanes
from experiments.world_setup.road import Layout
from planner.scene import Lanes
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import NetLane
from sumo_nets.network import Network

TAPER = 5.0  # from the barrier to where a lane has its width, and where it is gone [m]
END_TOLERANCE = 2.0  # between the ends of a lane and of the obstacle that closes it [m]
OVERLAP = 0.5  # along the road, from which on an obstacle is in a lane [m]
MARKED = 0.5  # a lane narrower than this is none [m]
SPACING = 1.0  # at which the length of an obstacle is checked for a way round [m]


def closure_of(section: ObstaclesConfig) -> Closure | None:
    """Return the closure that a section of obstacles describes, None without one."""
    if section.closure is None:
        return None
    begin = min(_stretch(obstacle)[0] for obstacle in section.listed)
    distance = math.inf if section.known_from_m is None else section.known_from_m
    return Closure(begin, distance)


def check_closure(scenario: Scenario, layout: Layout) -> None:
    """Check that a closure leaves a way round, and is one.

    Raises:
        ConfigError: If it closes every lane, closes none, or is said to be the end of
            a lane where none ends.
    """
    section, lanes = scenario.obstacles, layout.road.lanes
    if section.closure is None:
        return
    if not lanes.centre.shape[0]:
        problem = "is on a road without marked lanes; allowed: a list of obstacles"
        raise scenario.error(("obstacles", "closure"), problem)
    half = layout.task.vehicle.width / 2.0
    for index, obstacle in enumerate(section.listed):
        key = ("obstacles", "listed", index)
        begin, end, reach = *_stretch(obstacle), _half_width(obstacle)
        closes = False
        for s in np.linspace(
            begin, end, max(math.ceil((end - begin) / SPACING), 1) + 1
        ):
            bodies = [o for o in section.listed if _covers(o, float(s))]
            closed = [
                any(
                    abs(centre - body.l_m) < _half_width(body) + half for body in bodies
                )
                for centre in _lane_centres(lanes, float(s))
            ]
            if all(closed):
                problem = f"no way round at s = {s:.1f} m; allowed: a lane left free"
                raise scenario.error(key, problem)
            closes = closes or any(
                abs(centre - obstacle.l_m) < reach + half
                for centre in _lane_centres(lanes, begin - TAPER)
            )
        if not closes:
            problem = f"closes no lane at s = {begin:.1f} m; allowed: l_m in a lane"
            raise scenario.error(key, problem)
    if section.closure == "lane_end":
        _check_ends(scenario, layout)


def _check_ends(scenario: Scenario, layout: Layout) -> None:
    """Raise unless a lane of the network ends at every obstacle."""
    section, lanes = scenario.obstacles, layout.road.lanes
    if section.known_from_m is not None:
        problem = "is of signs, the end of a lane is on the map; allowed: nothing"
        raise scenario.error(("obstacles", "known_from_m"), problem)
    for obstacle in section.listed:
        begin, _ = _stretch(obstacle)
        before, after = (
            min(
                (abs(c - obstacle.l_m) for c in _lane_centres(lanes, s)),
                default=math.inf,
            )
            for s in (begin - TAPER, begin + TAPER)
        )
        reach = _half_width(obstacle)
        if not before <= reach < after:
            raise scenario.error(
                ("obstacles", "closure"),
                f"is lane_end, but no lane ends at s = {begin:.1f} m, l = "
                f"{obstacle.l_m:g} m; allowed: another network, stopped_vehicle or "
                "disallowed",
            )


def closed_lanes(
    scenario: Scenario, layout: Layout, network: Network, *, told: bool
) -> ClosedLanes:
    """Find the lanes of the network that a closure closes.

    Args:
        scenario: Checked.
        layout: Of the same scenario.
        network: Of the layout.
        told: Whether SUMO's own driver is to be told of them.

    Raises:
        ConfigError: If whole lanes of an edge have to be closed and one is longer than
            the obstacle in it.
    """
    kind = scenario.obstacles.closure
    if kind is None:
        return ClosedLanes()
    if kind == "lane_end":
        return ClosedLanes(twins=False)
    if kind == "stopped_vehicle" and not told:
        return ClosedLanes()
    found: list[str] = []
    for lane, begin, end, l in _lanes_on_path(layout, network):
        for obstacle in scenario.obstacles.listed:
            first, last = _stretch(obstacle)
            within = min(end, last) - max(begin, first)
            if within < OVERLAP or abs(l - obstacle.l_m) > _half_width(obstacle):
                continue
            if begin < first - END_TOLERANCE or end > last + END_TOLERANCE:
                raise _too_long(scenario, lane, (begin, end), kind)
            found.append(lane.id)
    disallowed = kind == "disallowed"
    return ClosedLanes(tuple(dict.fromkeys(found)), disallowed, twins=not disallowed)


def _too_long(
    scenario: Scenario, lane: NetLane, stretch: tuple[float, float], kind: str
) -> Exception:
    """Build the error about a lane that an obstacle closes only in part."""
    key = ("obstacles", "closure")
    begin, end = stretch
    where = f"lane {lane.id}, which goes from s = {begin:.1f} m to {end:.1f} m"
    if kind == "disallowed":
        problem = f"is disallowed, but the obstacle closes only a part of {where}"
        allowed = "edges that begin and end with the obstacle, or stopped_vehicle"
    else:
        problem = (
            f"SUMO's driver can be told of whole lanes only, not of a part of {where}"
        )
        allowed = (
            "edges that begin and end with the obstacle, or planner sumo_as_shipped"
        )
    return scenario.error(key, f"{problem}; allowed: {allowed}")


def _lanes_on_path(
    layout: Layout, network: Network
) -> Iterator[tuple[NetLane, float, float, float]]:
    """Yield the lanes of the route with their begin, end and offset on the path [m]."""
    net, path = read_net(network.net_file), layout.road.path
    for edge in network.route:
        for lane in net.edges[edge].drivable_lanes:
            s, l = path.project(lane.points[:, 0], lane.points[:, 1])
            if np.isfinite(s).all():
                yield lane, float(s[0]), float(s[-1]), float(np.median(l))


def _lane_centres(lanes: Lanes, s: float) -> list[float]:
    """Return the offsets of the lanes at a place [m]."""
    centres, widths = lanes.at(s)
    return [float(c) for c in centres[widths > MARKED]]


def _stretch(obstacle: Obstacle) -> tuple[float, float]:
    """Return the arc lengths from where to where an obstacle reaches [m]."""
    half = _half_extent(obstacle, 0.0)
    return obstacle.s_m - half, obstacle.s_m + half


def _half_width(obstacle: Obstacle) -> float:
    """Return half of an obstacle's extent across the road [m]."""
    return _half_extent(obstacle, math.pi / 2.0)


def _half_extent(obstacle: Obstacle, axis: float) -> float:
    """Return half of an obstacle's extent along an axis at an angle to the road [m]."""
    if obstacle.radius_m is not None:
        return obstacle.radius_m
    along = (obstacle.length_m or 0.0) * abs(math.cos(obstacle.heading_rad - axis))
    across = (obstacle.width_m or 0.0) * abs(math.sin(obstacle.heading_rad - axis))
    return (along + across) / 2.0


def _covers(obstacle: Obstacle, s: float) -> bool:
    """Tell whether an obstacle reaches over a place of the road."""
    begin, end = _stretch(obstacle)
    return begin <= s <= end
