"""SUMO as a world with many egos: vehicles of its demand that are moved by us."""

import math
from collections.abc import Callable, Mapping, Set
from typing import cast

import numpy as np

from experiments.cosim.fleet.records import EnteredVehicle, FleetSnapshot
from experiments.cosim.records import Signal
from experiments.cosim.right_of_way import JunctionTraffic
from experiments.cosim.road import Road
from experiments.cosim.sumo import frames
from experiments.cosim.sumo.control_modes import (
    KEEP_ROUTE_EXACT,
    NO_CHECKS,
    OWN_CHECKS,
    OWN_LANE_CHANGES,
    OWN_SPEED,
)
from experiments.cosim.sumo.ghost_vehicle import Ghost
from experiments.cosim.sumo.lane_change_guard import LaneChangeGuard, abreast_of_any
from experiments.cosim.sumo.lanes import Strip, route_strips
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.movements import MovementReader
from experiments.cosim.sumo.route_window import RouteWindow
from experiments.cosim.sumo.settings import FleetSettings
from experiments.cosim.sumo.start import ready_libsumo, refusals_of, start
from experiments.cosim.sumo.sumo_errors import sumo_errors
from experiments.cosim.sumo.traffic_lights import read_signals
from experiments.cosim.sumo.vehicle_reader import VehicleReader
from experiments.errors import SimulationError
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle, centre_from_rear_axle
from planner.ways import Ways

GHOST_ROUTE = "route@ghost"  # before a number


class SumoFleetWorld:
    """A SUMO network with its traffic, of which egos are taken over one by one.

    SUMO starts in `enter`; `close` ends it.
    """

    def __init__(self, settings: FleetSettings, *, left_hand: bool) -> None:
        self._settings = settings
        self._left_hand = left_hand
        self._sumo: Libsumo | None = None
        self._reader: VehicleReader | None = None
        self._guard: LaneChangeGuard | None = None
        self._hidden: set[str] = set()  # the ghosts
        self._ghosts: dict[str, Ghost] = {}
        self._windows: dict[str, RouteWindow] = {}  # of egos that need one
        self._bodies: dict[str, Vehicle] = {}  # of the egos
        self._moved: dict[str, CartesianState] = {}  # where the egos are
        self._users: RoadUsers | None = None  # as last observed
        # of a route its name for ghosts, and its lanes
        self._ways: dict[tuple[str, ...], tuple[str, list[Strip]]] = {}
        self._junctions: dict[int, _RoadJunctions] = {}
        self._letters: dict[str, str] = {}  # of the traffic lights in this step
        self._lane_numbers: dict[str, int] = {}
        self._steps = 0

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._settings.step

    @property
    def lanes(self) -> tuple[str, ...]:
        """Names of the lanes by their numbers."""
        return tuple(self._lane_numbers)

    def enter(self) -> None:
        """Start SUMO and run the warm-up.

        Raises:
            ConfigError: If SUMO refuses the user's own demand.
            SimulationError: If SUMO does not start.
        """
        settings = self._settings
        sumo = ready_libsumo(settings.net_file)
        self._sumo = sumo  # from here on close() has something to end
        start(sumo, settings)
        with refusals_of(settings.demand), sumo_errors(sumo, "warming up"):
            sumo.simulationStep(settings.begin + settings.warm_up)
        self._reader = VehicleReader(sumo, self._hidden, left_hand=self._left_hand)
        if settings.lane_change_guard:
            self._guard = LaneChangeGuard(sumo)

    def observe(self) -> FleetSnapshot:
        """Read every vehicle, sorted by id, then everybody on foot.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        with sumo_errors(sumo, "reading the traffic"):
            users = cast(VehicleReader, self._reader).near((0.0, 0.0), math.inf)
            users = self._with_true_places(users)
            numbers = self._read_numbers(sumo, users.ids)
            pending = len(sumo.simulation.getPendingVehicles())
        self._users = users
        self._letters.clear()
        lane, position, wished, fuel, co2 = numbers
        return FleetSnapshot(
            self._steps * self.step,
            users,
            lane.astype(np.int64),
            position,
            wished,
            fuel,
            co2,
            pending,
        )

    def _with_true_places(self, users: RoadUsers) -> RoadUsers:
        """Return road users with the egos where they are.

        SUMO may have one elsewhere: before a line, or on the lanes beside which it
        swings out; its ghost is where it is then, which egos do not see.
        """
        rows = [k for k, name in enumerate(users.ids) if name in self._moved]
        if not rows:
            return users
        table = users.table.copy()
        for k in rows:
            ego, body = self._moved[users.ids[k]], self._bodies[users.ids[k]]
            table[:2, k] = centre_from_rear_axle(ego, body)
            table[2, k] = ego.heading
        return RoadUsers.from_table(users.ids, table)

    def _read_numbers(self, sumo: Libsumo, ids: tuple[str, ...]) -> FloatArray:
        """Read lane, position on it, wished speed, fuel and CO2 of vehicles, (5, n)."""
        api, rows, known = sumo.vehicle, [], self._lane_numbers
        there = set(api.getIDList())
        for name in ids:
            if name not in there:  # on foot
                rows.append((-1.0, 0.0, 0.0, 0.0, 0.0))
                continue
            lane = api.getLaneID(name)
            number = known.setdefault(lane, len(known)) if lane else -1
            rows.append(
                (
                    number,
                    api.getLanePosition(name) if lane else 0.0,
                    min(api.getAllowedSpeed(name), api.getMaxSpeed(name)),
                    api.getFuelConsumption(name),
                    api.getCO2Emission(name),
                )
            )
        return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(-1, 5).T)

    def describe(self, name: str) -> EnteredVehicle:
        """Describe a vehicle on the road.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        api, window = sumo.vehicle, self._windows.get(name)
        with sumo_errors(sumo, f"reading the vehicle {name}"):
            route, edge = tuple(api.getRoute(name)), int(api.getRouteIndex(name))
            if window is not None:  # SUMO knows a part of it
                route, edge = window.left(), 0
            return EnteredVehicle(
                name,
                str(api.getTypeID(name)),
                route,
                edge,
                int(api.getLaneIndex(name)),
                float(api.getLength(name)),
                float(api.getWidth(name)),
                float(api.getMaxSpeed(name)),
                float(api.getAccel(name)),
            )

    def take_over(self, name: str, body: Vehicle) -> CartesianState:
        """Switch SUMO's driver of a vehicle off.

        Args:
            name: Its id.
            body: Of the ego; as long and wide as the vehicle.

        Returns:
            Its rear axle.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        api = sumo.vehicle
        with sumo_errors(sumo, f"taking over {name}"):
            api.setSpeedMode(name, NO_CHECKS)
            api.setLaneChangeMode(name, 0)
            passed = int(api.getRouteIndex(name))
            ahead = tuple(api.getRoute(name))[passed:]
            route, strips = self._way(sumo, ahead)
            window = RouteWindow(sumo, name, route, ahead, passed)
            if window.is_needed:
                self._windows[name] = window
            if self._settings.ghost:
                ghost = Ghost(sumo, name, route, str(api.getTypeID(name)), strips)
                self._ghosts[name] = ghost
                self._hidden.add(ghost.id)
            x, y = api.getPosition(name)
            angle, speed = float(api.getAngle(name)), float(api.getSpeed(name))
        self._bodies[name] = body
        x, y, heading = frames.rear_axle_from_front(x, y, angle, body)
        return CartesianState(x, y, heading, 0.0, speed, 0.0)

    def _way(self, sumo: Libsumo, edges: tuple[str, ...]) -> tuple[str, list[Strip]]:
        """Return a route's name for ghosts, and its lanes."""
        if edges not in self._ways:
            strips = [Strip(x) for x in route_strips(sumo, edges)]
            route = f"{GHOST_ROUTE}{len(self._ways)}"
            sumo.route.add(route, edges)  # that of a vehicle is its own
            self._ways[edges] = route, strips
        return self._ways[edges]

    def hand_back(self, name: str) -> None:
        """Give a vehicle back to SUMO's driver, with the whole of its way.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        with sumo_errors(sumo, f"handing {name} back"):
            window = self._windows.get(name)
            if window is not None:
                sumo.vehicle.setRoute(name, list(window.left()))
            self._forget(name)
            sumo.vehicle.setSpeedMode(name, OWN_CHECKS)
            sumo.vehicle.setLaneChangeMode(name, OWN_LANE_CHANGES)
            sumo.vehicle.setSpeed(name, OWN_SPEED)

    def take_out(self, name: str) -> None:
        """Remove an ego that has arrived.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        with sumo_errors(sumo, f"removing {name}"):
            self._forget(name)
            sumo.vehicle.remove(name)

    def forget(self, name: str) -> None:
        """Note that SUMO itself has removed an ego."""
        sumo = self._running()
        with sumo_errors(sumo, f"removing the ghost of {name}"):
            self._forget(name)

    def _forget(self, name: str) -> None:
        """Remove the ghost of a vehicle that is no ego any more."""
        del self._bodies[name]
        self._moved.pop(name, None)
        self._windows.pop(name, None)
        ghost = self._ghosts.pop(name, None)
        if ghost is not None:
            ghost.remove()
            self._hidden.discard(ghost.id)

    def signals(self, road: Road) -> tuple[Signal, ...]:
        """Read the traffic lights of a road, each once a step.

        Raises:
            SimulationError: If SUMO fails.
        """
        if not road.stop_lines:
            return ()
        sumo = self._running()
        with sumo_errors(sumo, "reading the traffic lights"):
            return read_signals(sumo, road.stop_lines, self._letters)

    def junction_traffic(self, road: Road) -> JunctionTraffic:
        """Return what knows the movements over a road's junctions."""
        if id(road) not in self._junctions:
            self._junctions[id(road)] = _RoadJunctions(
                self._running(), road, self._beyond
            )
        return self._junctions[id(road)]

    def _beyond(self, name: str) -> tuple[str, ...]:
        """Return the edges of a vehicle's route that SUMO does not know yet."""
        window = self._windows.get(name)
        return () if window is None else window.beyond()

    def ghost(self, name: str) -> CartesianState | None:
        """Return the centre of an ego's ghost; None without one."""
        ghost = self._ghosts.get(name)
        pose = None if ghost is None else ghost.pose
        return None if pose is None else pose.centre()

    def advance(
        self, egos: Mapping[str, CartesianState], waiting: Set[str] = frozenset()
    ) -> None:
        """Put all egos where they go, and let SUMO move all others one step on.

        Args:
            egos: Rear axles by id, of all that were taken over.
            waiting: Those that are before a line of their road.

        Raises:
            SimulationError: If SUMO fails or a state is not finite.
        """
        sumo = self._running()
        api = sumo.vehicle
        with sumo_errors(sumo, "moving the egos"):
            for name, ego in egos.items():
                body = self._bodies[name]
                if not all(map(math.isfinite, (ego.x, ego.y, ego.heading, ego.speed))):
                    raise SimulationError(f"{name} cannot be moved to {ego}")
                x, y, angle = frames.front_from_rear_axle(ego, body)
                ghost, window = self._ghosts.get(name), self._windows.get(name)
                if window is not None and window.update() and ghost is not None:
                    ghost.follow(window.route_id)
                if ghost is not None:
                    held = name in waiting
                    x, y = ghost.update(ego, body, (x, y), before_line=held)
                # a negative speed would hand the ego back to SUMO's driver
                api.setSpeed(name, max(ego.speed, 0.0))
                api.moveToXY(name, "", -1, x, y, angle, KEEP_ROUTE_EXACT)
            self._guard_egos(egos)
            sumo.simulationStep()
        self._moved.update(egos)
        self._steps += 1

    def _guard_egos(self, egos: Mapping[str, CartesianState]) -> None:
        """Keep SUMO's vehicles abreast of egos from changing lanes."""
        users = self._users
        if self._guard is None or users is None:
            return
        rows = np.empty((len(egos), 4))
        for k, (name, ego) in enumerate(egos.items()):
            body = self._bodies[name]
            rows[k, :2] = centre_from_rear_axle(ego, body)
            rows[k, 2:] = ego.heading, body.length
        marked = np.flatnonzero(abreast_of_any(rows, users.table))
        beside = {users.ids[k] for k in marked} - egos.keys()
        self._guard.update(beside, (x for x in users.ids if x not in egos))

    def close(self) -> None:
        """End the simulation; allowed at any time and more than once."""
        sumo, self._sumo = self._sumo, None
        self._ghosts.clear()
        self._windows.clear()
        self._junctions.clear()
        if sumo is not None and sumo.isLoaded():
            with sumo_errors(sumo, "closing"):
                sumo.close()

    def _running(self) -> Libsumo:
        """Return the simulation, which must have been started."""
        if self._sumo is None:
            raise SimulationError("the simulation is not running: call enter() first")
        return self._sumo


class _RoadJunctions:
    """The movements over the junctions of one road."""

    def __init__(
        self, sumo: Libsumo, road: Road, beyond: Callable[[str], tuple[str, ...]]
    ) -> None:
        self._sumo = sumo
        self._reader = MovementReader(sumo, road.junctions, beyond)
        self.road = road  # kept, so that its id stays its own

    def movements(
        self, near: Set[int], vehicles: RoadUsers
    ) -> tuple[tuple[Foe, ...], Ways]:
        """Read the foes at junctions, and the ways of vehicles."""
        with sumo_errors(self._sumo, "reading the junctions"):
            return self._reader.read(near, vehicles)
