"""What a route may use about a stretch of it.

A route may come back on the other side of a road that it took before, or over the same
junction: what it uses there later is not its own here. So areas are of stretches.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Protocol

from shapely.geometry.base import BaseGeometry

from sumo_nets.drivable_area import drivable_area, narrower_areas, wider_areas
from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import LaneUse
from sumo_nets.net_records import Net

REACH: Final = 25.0  # of a body on a stretch beyond its ends, and of a plan's view [m]


@dataclass(frozen=True, eq=False)
class RouteArea:
    """Where a body on a stretch of the route may be; polygons [m].

    `own` is the lanes of the route's direction and the junctions; `narrower`, the
    narrowest first, what it leaves to others beside; `wider`, the widest last, is with
    oncoming lanes, where nothing else will do.
    """

    own: BaseGeometry
    make_narrower: Callable[[], tuple[BaseGeometry, ...]] = tuple
    make_wider: Callable[[], tuple[BaseGeometry, ...]] = tuple

    @cached_property
    def narrower(self) -> tuple[BaseGeometry, ...]:
        """Made when asked for: few stretches need them."""
        return self.make_narrower()

    @cached_property
    def wider(self) -> tuple[BaseGeometry, ...]:
        """The same."""
        return self.make_wider()

    @property
    def widest(self) -> BaseGeometry:
        """All that may be used if need be."""
        return self.wider[-1] if self.wider else self.own


class RouteAreas(Protocol):
    """The areas along a route."""

    def between(self, begin: float, end: float) -> RouteArea:
        """Return the area of a stretch, given by arc lengths of the route [m]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class OneArea:
    """An area that is the same along all of a route."""

    area: RouteArea

    def between(self, begin: float, end: float) -> RouteArea:  # noqa: ARG002
        """Return the area."""
        return self.area


class AreasOfEdges:
    """The areas along a route through a network.

    Args:
        net: The network.
        uses: The route, edge by edge.
        begins: Where each edge begins, growing [m].
    """

    def __init__(
        self, net: Net, uses: Sequence[LaneUse], begins: Sequence[float]
    ) -> None:
        self._net = net
        self._uses = uses
        self._begins = begins
        self._known: dict[tuple[int, int], RouteArea] = {}

    def between(self, begin: float, end: float) -> RouteArea:
        """Unite what the edges about a stretch have; see `RouteAreas`.

        Raises:
            NetworkError: If the shape of a lane or junction is damaged.
        """
        first = max(bisect_right(self._begins, begin - REACH) - 1, 0)
        # with the edge behind: the junction before it is reached, however far it goes
        last = bisect_left(self._begins, end + REACH) + 1
        found = self._known.get((first, last))
        if found is None:
            found = _area_of(self._net, self._uses[first:last])
            self._known[first, last] = found
        return found


def _area_of(net: Net, uses: Sequence[LaneUse]) -> RouteArea:
    """Unite what a few edges have."""

    def named(make: Callable[[], Any]) -> Any:
        try:
            return make()
        except NetworkError as error:
            raise NetworkError(f"{net.file}: {error}") from error

    own = named(lambda: drivable_area(net, uses))
    return RouteArea(
        own,
        lambda: named(lambda: narrower_areas(net, uses, own)),
        lambda: named(lambda: wider_areas(net, uses, own)),
    )
