"""Which vehicles become egos: each gets a way, a driver and its place on the path."""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from experiments.cosim.ego_driver import EgoDriver, EpisodeOptions
from experiments.cosim.fleet.egos import FleetEgo
from experiments.cosim.fleet.records import HUMAN, FleetSnapshot
from experiments.cosim.fleet.selection import EgoSelection
from experiments.cosim.fleet.ways import EgoWay, NoWayError, WayFinder
from experiments.cosim.fleet.world import FleetWorld
from experiments.cosim.plant import PerfectTracking
from planner.interface import Planner
from planner.reference_path.frenet import state_on_path
from planner.states import CartesianState

log = logging.getLogger(__name__)

TURNED_AT_MOST = 0.3  # from the path, of a vehicle that is taken over [rad]


@dataclass(frozen=True, slots=True)
class FleetGroup:
    """How the egos of a group are driven."""

    planner: Planner | None  # None: by SUMO, and counted apart
    ends_run: bool = False  # a failed ego ends the run instead of being handed back


class Takeover:
    """Makes egos of the vehicles that are selected.

    Args:
        world: Entered before the first call.
        groups: How each is driven.
        selection: Which vehicles belong to them.
        find_way: Lays out the roads.
        options: Of the run.
    """

    def __init__(
        self,
        world: FleetWorld,
        groups: Sequence[FleetGroup],
        selection: EgoSelection,
        find_way: WayFinder,
        options: EpisodeOptions,
    ) -> None:
        self._world = world
        self._drives = groups
        self._selection = selection
        self._find_way = find_way
        # of each ego: what ends a run, and statistics for it, are for one alone
        self._options = replace(options, duration=math.inf, full_statistics=False)
        self.groups: dict[str, int] = {}  # of every vehicle that was seen
        self.refused: dict[str, str] = {}  # type and route of no ego -> why

    def entered(self, snapshot: FleetSnapshot) -> list[FleetEgo]:
        """Take over those of the vehicles that have entered which are egos.

        Raises:
            SimulationError: If the simulator fails.
        """
        taken = []
        for name, lane in zip(snapshot.users.ids, snapshot.lane.tolist(), strict=True):
            if name in self.groups or lane < 0:
                continue
            entered = self._world.describe(name)
            group = self._selection.choose(name, entered.type)
            self.groups[name] = group
            if group == HUMAN or self._drives[group].planner is None:
                continue
            try:
                way = self._find_way(entered, group)
            except NoWayError as error:
                key = f"{entered.type} on {' '.join(entered.route[entered.edge :])}"
                if key not in self.refused:
                    log.warning("%s is no ego: %s", key, error)
                self.refused[key] = str(error)
                self.groups[name] = HUMAN
                self._selection.release(group)
                continue
            state = self._world.take_over(name, way.task.vehicle)
            state = _on_path(way, state)
            driver = self._driver(group, way)
            ego = FleetEgo(name, group, way, driver, state)
            ego.place = driver.place(state, None)
            taken.append(ego)
        return taken

    def renew(self, ego: FleetEgo) -> None:
        """Lay out the next part of an ego's way once its road comes to an end.

        Raises:
            SimulationError: If the simulator fails.
        """
        if ego.s < ego.way.renew_at:
            return
        vehicle = self._world.describe(ego.id)
        try:
            way = self._find_way(vehicle, ego.group)
        except NoWayError:
            return  # inside a junction: on the next edge there is one
        driver = self._driver(ego.group, way)
        place = driver.place(ego.state, None)
        if place is None:
            return
        ego.way, ego.driver, ego.place = way, driver, place

    def _driver(self, group: int, way: EgoWay) -> EgoDriver:
        """Make the driver of an ego."""
        planner, world = self._drives[group].planner, self._world
        assert planner is not None  # noqa: S101 - else nobody is taken over
        return EgoDriver(
            planner,
            PerfectTracking(),
            way.road,
            way.task,
            self._options,
            world.step,
            world.junction_traffic(way.road) if way.road.junctions else None,
        )


def _on_path(way: EgoWay, state: CartesianState) -> CartesianState:
    """Return a state with the path's heading and curvature, at its offset.

    SUMO's vehicles turn at their front bumpers; where one comes in askew it stays so.
    """
    path = way.road.path
    s, l = path.project_one(state.x, state.y, None)
    along = state_on_path(path, s, l, state.speed)
    turned = math.remainder(along.heading - state.heading, 2.0 * math.pi)
    return along if abs(turned) < TURNED_AT_MOST else state
