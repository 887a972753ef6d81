"""Which of the lanes along its route an ego is on, edge by edge."""

from collections.abc import Sequence

from experiments.cosim.sumo.lanes import LANE_GAP, Strip

LOOK_AHEAD = 4  # strips in which the ego may turn up next


class RoutePlace:
    """The place of an ego among the strips of its route.

    Args:
        strips: All lanes of each edge on the ego's way, also inside junctions, in the
            order of travel.
    """

    def __init__(self, strips: Sequence[Strip]) -> None:
        self._strips = tuple(strips)
        self._at = 0  # where the ego was last seen

    @property
    def strip(self) -> Strip:
        """Where the ego was last seen."""
        return self._strips[self._at]

    @property
    def road(self) -> Strip:
        """The same, or the road before the junction that the ego is in."""
        return self._strips[self._road()]

    def locate(self, front: tuple[float, float]) -> bool:
        """Find the strip that the ego is on, from the last one on, if it is on one.

        Args:
            front: Centre of its front bumper [m].
        """
        for beyond in (0.0, LANE_GAP):
            for index, strip in enumerate(self.ahead(), start=self._at):
                if strip.lane_of(*front, beyond) is not None:
                    self._at = index
                    return True
        return False

    def ahead(self) -> tuple[Strip, ...]:
        """Return the strips in which the ego may be now."""
        return self._strips[self._at : self._at + LOOK_AHEAD]

    def go_back_to_road(self) -> None:
        """Note that the ego is not in the junction, but on the road before it."""
        self._at = self._road()

    def road_behind(self, front: tuple[float, float]) -> tuple[Strip, float] | None:
        """Return the road before the ego's junction, and the way driven since [m].

        Args:
            front: Centre of its front bumper [m].

        Returns:
            None for an ego on a road.
        """
        driven, place = self.strip.lanes[0].project(*front)[0], self._at
        while place > 0 and self._strips[place].inside_junction:
            place -= 1
            if self._strips[place].inside_junction:
                driven += self._strips[place].lanes[0].length
        return None if place == self._at else (self._strips[place], driven)

    def _road(self) -> int:
        """Return the place of the last road up to where the ego is."""
        place = self._at
        while place > 0 and self._strips[place].inside_junction:
            place -= 1
        return place
