"""The part of the ego's route that SUMO knows, where the whole passes a junction twice.

`moveToXY` puts a vehicle on the lane of its route that is nearest, whichever of the
passes over a junction that lane belongs to. On the other pass's lane nobody behind sees
the ego. SUMO therefore gets the part of the route on which no junction comes twice.
"""

from collections.abc import Sequence

from experiments.cosim.sumo.libsumo_api import Libsumo


def window_ends(junctions: Sequence[tuple[str, str]]) -> list[int]:
    """Find how far a route can be known from each of its edges on.

    Args:
        junctions: Of each edge of the route: where it begins and ends.

    Returns:
        For each edge the place after the last edge up to which no junction comes
        twice; at least the next edge is known.
    """
    ends = []
    for first, (begin, _) in enumerate(junctions):
        seen, last = {begin}, first
        while last < len(junctions) and junctions[last][1] not in seen:
            seen.add(junctions[last][1])
            last += 1
        ends.append(min(max(last, first + 2), len(junctions)))
    return ends


class RouteWindow:
    """Tells SUMO the next part of a moved vehicle's route when it reaches an edge.

    Args:
        sumo: The running libsumo module.
        vehicle: The vehicle.
        route_id: SUMO's name of its whole route.
        route: The edges of it that are still to be driven.
        passed: How many edges SUMO knows before these.
    """

    def __init__(
        self,
        sumo: Libsumo,
        vehicle: str,
        route_id: str,
        route: Sequence[str],
        passed: int = 0,
    ) -> None:
        self._sumo = sumo
        self._vehicle = vehicle
        self._route = tuple(route)
        api = sumo.edge
        junctions = [(api.getFromJunction(x), api.getToJunction(x)) for x in route]
        self._ends = window_ends(junctions)
        self._begin = -passed  # place in the route of the first edge that SUMO knows
        self._end = len(self._route)
        self.route_id = route_id  # SUMO's name for what a ghost is to know

    @property
    def is_needed(self) -> bool:
        """Whether the whole route passes a junction twice."""
        return any(end < len(self._route) for end in self._ends)

    def left(self) -> tuple[str, ...]:
        """Return the edges still to be driven, the present one included."""
        index = self._begin + int(self._sumo.vehicle.getRouteIndex(self._vehicle))
        return self._route[max(index, 0) :]

    def beyond(self) -> tuple[str, ...]:
        """Return the edges behind those that SUMO knows."""
        return self._route[self._end :]

    def update(self) -> bool:
        """Tell SUMO another part where the vehicle has reached one.

        Returns:
            Whether it has another part now.
        """
        index = self._begin + int(self._sumo.vehicle.getRouteIndex(self._vehicle))
        if not 0 <= index < len(self._route):
            return False
        if self._ends[index] == self._end:
            return False
        if self._sumo.vehicle.getRoadID(self._vehicle) != self._route[index]:
            return False  # inside a junction
        self._tell(index)
        return True

    def _tell(self, index: int) -> None:
        """Make the route that which begins on an edge."""
        # it begins an edge before: the vehicle's rear may still be there
        before, end = max(index - 1, 0), self._ends[index]
        name = f"{self.route_id.partition('#')[0]}#{index}"
        # others on the same route may have told it
        if name not in self._sumo.route.getIDList():
            self._sumo.route.add(name, list(self._route[before:end]))
        # setRoute would keep the edges that were passed, of which one may be nearest
        self._sumo.vehicle.setRouteID(self._vehicle, name)
        self._begin = index - int(self._sumo.vehicle.getRouteIndex(self._vehicle))
        self._end, self.route_id = end, name
