"""SUMO as a world.

One simulation per process: libsumo holds a single one, and a second start would
silently replace the first.
"""

import math
from collections.abc import Set

from experiments.cosim.records import TrafficState
from experiments.cosim.road import Road
from experiments.cosim.sumo import frames
from experiments.cosim.sumo import obstacle_vehicles as obstacles
from experiments.cosim.sumo.closed_lanes import close_to_traffic
from experiments.cosim.sumo.control_modes import KEEP_ROUTE_EXACT, NO_CHECKS
from experiments.cosim.sumo.ego_entry import EGO_ID, EGO_ROUTE, Departure, departures
from experiments.cosim.sumo.ego_insertion import insert, replace_vehicle
from experiments.cosim.sumo.ghost_vehicle import GHOST, Ghost
from experiments.cosim.sumo.gui import Pace, draw_plan, follow
from experiments.cosim.sumo.lane_change_guard import LaneChangeGuard, abreast
from experiments.cosim.sumo.lanes import Strip, all_lanes, edge_lanes, route_strips
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.movements import MovementReader
from experiments.cosim.sumo.route_window import RouteWindow
from experiments.cosim.sumo.settings import (
    EGO_TYPE,
    VIEW_RADIUS,
    SumoSettings,
)
from experiments.cosim.sumo.start import (
    check_ego_type,
    ready_libsumo,
    refusals_of,
    start,
)
from experiments.cosim.sumo.sumo_errors import sumo_errors
from experiments.cosim.sumo.traffic_drivers import TrafficDrivers
from experiments.cosim.sumo.traffic_lights import check_stop_lines, read_signals
from experiments.cosim.sumo.vehicle_reader import VehicleReader
from experiments.cosim.waiting_lines import is_before_line
from experiments.errors import SimulationError
from planner.interface import Indicator
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import CartesianState, Trajectory
from planner.ways import Ways


class SumoWorld:
    """A SUMO network with its traffic, and the ego moved through it.

    SUMO starts in `enter`; `close` ends it. Every error of SUMO, also one of a missing
    system library, comes out as a `SimulationError`.
    """

    def __init__(self, settings: SumoSettings) -> None:
        self._settings = settings
        self._vehicle = settings.task.vehicle
        self._sumo: Libsumo | None = None
        self._ghost: Ghost | None = None
        self._window: RouteWindow | None = None
        self._guard: LaneChangeGuard | None = None
        self._drivers: TrafficDrivers | None = None
        self._indicator = Indicator.NONE
        self._others: RoadUsers | None = None  # as last observed
        self._ego_front = (math.nan, math.nan)
        self._front_s: float | None = None  # along the path, once it is known
        self._reader: VehicleReader | None = None
        self._movements: MovementReader | None = None
        self._hidden: set[str] = set()  # SUMO's vehicles that are not traffic
        self._steps = 0
        self._entry_steps = 0
        self._reported_collisions = 0
        self._pace = Pace(settings.step)

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._settings.step

    @property
    def road(self) -> Road:
        """The ego's road; its obstacles as they are, not as SUMO sees them."""
        return self._settings.road

    @property
    def entry_steps(self) -> int:
        """Steps after the warm-up in the last of which the ego entered."""
        return self._entry_steps

    @property
    def reported_collisions(self) -> int:
        """Steps in which SUMO itself saw the ego collide, for tests of our own check.

        SUMO misses overlaps across lane lines and reports some that are not there.
        """
        return self._reported_collisions

    def enter(self) -> CartesianState:
        """Run the warm-up and insert the ego where SUMO finds a safe gap for it.

        Returns:
            The rear axle on the reference path, with the speed SUMO allowed.

        Raises:
            ConfigError: If SUMO refuses the user's own demand.
            SimulationError: If SUMO does not start, or finds no gap in time.
        """
        settings = self._settings
        sumo, entering = self._set_up()
        with sumo_errors(sumo, "inserting the ego"):
            if settings.taken is None:
                reader = self._reading()
                self._entry_steps = insert(sumo, settings, entering, reader)
                self._take_over(sumo)
                if settings.gui:
                    follow(sumo, EGO_ID)
                ego = self._at_start(float(sumo.vehicle.getSpeed(EGO_ID)))
            else:
                ego = self._replace(sumo, settings.taken)
        edge = 0 if settings.taken is not None else entering[0].edge
        with sumo_errors(sumo, "reading the lanes"):
            ahead = settings.route[edge:]
            window = RouteWindow(sumo, EGO_ID, EGO_ROUTE, ahead)
            self._window = window if window.is_needed else None
            strips = [Strip(x) for x in route_strips(sumo, ahead)]
            if settings.ghost:
                self._ghost = Ghost(sumo, EGO_ID, EGO_ROUTE, EGO_TYPE, strips)
        if settings.lane_change_guard:
            self._guard = LaneChangeGuard(sumo)
        if self._drivers is not None:
            self._drivers.meet_ego()
        self._ego_front = frames.front_from_rear_axle(ego, self._vehicle)[:2]
        return ego

    def check_files(self) -> None:
        """Let SUMO read all its files, without a step.

        Raises:
            ConfigError: If SUMO refuses the user's own demand.
            SimulationError: If SUMO does not start.
        """
        try:
            self._start()
        finally:
            self.close()

    def observe(self) -> TrafficState:
        """Read every vehicle within the view radius of the ego, sorted by id.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo, reader = self._running(), self._reading()
        with sumo_errors(sumo, "reading the traffic"):
            self._others = reader.near(self._ego_front, VIEW_RADIUS)
            looks = reader.looks(self._others.ids)
            signals = read_signals(sumo, self.road.stop_lines, {})
        drivers = self._drivers
        return TrafficState(
            self._steps * self.step,
            self._others,
            signals,
            self._ghost_state(),
            looks=looks,
            erring=() if drivers is None else drivers.erring,
            log_weight=None if drivers is None else drivers.log_weight,
        )

    def movements(
        self, near: Set[int], vehicles: RoadUsers
    ) -> tuple[tuple[Foe, ...], Ways]:
        """Read who is on the way over the ego's junctions, and all vehicles' ways.

        Args:
            near: Places in the road's list of the junctions that are looked at.
            vehicles: As just observed.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        if self._movements is None:
            self._movements = MovementReader(sumo, self.road.junctions)
        with sumo_errors(sumo, "reading the junctions"):
            return self._movements.read(near, vehicles)

    def advance(self, ego: CartesianState) -> CartesianState:
        """Put the ego at `ego` and let SUMO move all others one step on.

        The others still react to the ego's pose before: SUMO applies the new one at
        the end of the step.

        Returns:
            Where the ego is then: `ego`.

        Raises:
            SimulationError: If SUMO fails or the state is not finite.
        """
        sumo = self._running()
        if not all(map(math.isfinite, (ego.x, ego.y, ego.heading, ego.speed))):
            # SUMO accepts NaN silently and goes on with it.
            raise SimulationError(f"the ego cannot be moved to {ego}")
        *front, angle = frames.front_from_rear_axle(ego, self._vehicle)
        x, y = self._ego_front = (front[0], front[1])
        with sumo_errors(sumo, "moving the ego"):
            if self._window is not None and self._window.update() and self._ghost:
                self._ghost.follow(self._window.route_id)
            if self._ghost is not None:
                held = self._is_before_line(ego.speed)
                x, y = self._ghost.update(
                    ego, self._vehicle, self._ego_front, before_line=held
                )
            # A negative speed would hand the ego back to SUMO's driver.
            sumo.vehicle.setSpeed(EGO_ID, max(ego.speed, 0.0))
            sumo.vehicle.moveToXY(EGO_ID, "", -1, x, y, angle, KEEP_ROUTE_EXACT)
            if self._guard is not None and self._others is not None:
                beside = abreast(ego, self._vehicle, self._others)
                self._guard.update(beside, self._others.ids)
            self._move_drivers()
            sumo.simulationStep()
            if sumo.simulation.getCollidingVehiclesNumber():
                self._count_collision(sumo)
        if self._settings.gui:
            self._pace.keep()
        self._steps += 1
        return ego

    def _is_before_line(self, speed: float) -> bool:
        """Check whether the ego is before a line of its road, or stands at it."""
        road = self.road
        if not (road.stop_lines or road.junctions):
            return False
        self._front_s, _ = road.path.project_one(*self._ego_front, self._front_s)
        return is_before_line(road, self._front_s, speed)

    def _move_drivers(self) -> None:
        """Do to the traffic's drivers what is done before a step."""
        if self._drivers is None:
            return
        has_ghost = self._ghost is not None and self._ghost.pose is not None
        self._drivers.update(
            self._steps * self.step,
            self._ego_front if math.isfinite(self._ego_front[0]) else None,
            (EGO_ID, GHOST + EGO_ID) if has_ghost else (EGO_ID,),
            self._indicator,
        )

    def indicate(self, indicator: Indicator) -> None:
        """Show what the ego indicates from now on."""
        self._indicator = indicator

    def show_plan(self, plan: Trajectory) -> None:
        """Draw a plan in SUMO's window, replacing the one before.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        with sumo_errors(sumo, "drawing the plan"):
            draw_plan(sumo, plan)

    def close(self) -> None:
        """End the simulation; allowed at any time and more than once.

        A simulation with a window stays until its process ends: libsumo 1.28 blocks
        forever now and then when it is to close one.
        """
        sumo, self._sumo, self._ghost = self._sumo, None, None
        self._reader = self._movements = None
        if sumo is not None and sumo.isLoaded() and not self._settings.gui:
            with sumo_errors(sumo, "closing"):
                sumo.close()

    def _at_start(self, speed: float) -> CartesianState:
        """Return the ego's state at its start, with a speed [m/s]."""
        return self._settings.task.state_at_start(self.road.path, speed)

    def _running(self) -> Libsumo:
        """Return the simulation, which must have been started."""
        if self._sumo is None:
            raise SimulationError("the simulation is not running: call enter() first")
        return self._sumo

    def _reading(self) -> VehicleReader:
        """Return the reader of a simulation that is set up."""
        if self._reader is None:
            raise SimulationError("the simulation is not set up: call enter() first")
        return self._reader

    def _set_up(self) -> tuple[Libsumo, list[Departure]]:
        """Start SUMO, place the obstacles, run the warm-up, return the departures."""
        settings = self._settings
        sumo = self._start()
        with sumo_errors(sumo, "setting up"):
            route_lanes = [edge_lanes(sumo, edge) for edge in settings.route]
            entering = departures(sumo, settings, route_lanes)
            for one in entering:
                sumo.route.add(one.route, list(settings.route[one.edge :]))
            self._hidden = {EGO_ID, GHOST + EGO_ID, *self._place_obstacles(sumo)}
            self._reader = VehicleReader(
                sumo, self._hidden, left_hand=self.road.lanes.left_hand
            )
            self._drivers = TrafficDrivers(sumo, settings, self._hidden)
            check_ego_type(sumo, self._vehicle)
            check_stop_lines(sumo, self.road.stop_lines)
        with refusals_of(settings.demand), sumo_errors(sumo, "warming up"):
            if settings.warm_up > 0.0:
                sumo.simulationStep(settings.begin + settings.warm_up)
        return sumo, entering

    def _start(self) -> Libsumo:
        """Start SUMO on the settings' files."""
        sumo = ready_libsumo(self._settings.net_file)
        # From here on close() has something to end, also after a failed start.
        self._sumo = sumo
        start(sumo, self._settings)
        return sumo

    def _place_obstacles(self, sumo: Libsumo) -> frozenset[str]:
        """Make the obstacles visible to SUMO's traffic; return the names they get."""
        static, closed = self.road.obstacles, self._settings.closed
        if closed.disallowed:
            close_to_traffic(sumo, closed.lanes)
        if not static.ids or not closed.twins:
            return frozenset()
        found = obstacles.twins(static, all_lanes(sumo))
        return obstacles.place(sumo, found, EGO_ROUTE)

    def _replace(self, sumo: Libsumo, name: str) -> CartesianState:
        """Put the ego in the place of a vehicle; see `replace_vehicle`."""
        ego, self._entry_steps = replace_vehicle(
            sumo, self._settings, name, self._take_over
        )
        return ego

    def _take_over(self, sumo: Libsumo) -> None:
        """Switch SUMO's own driver off."""
        sumo.vehicle.setSpeedMode(EGO_ID, NO_CHECKS)
        sumo.vehicle.setLaneChangeMode(EGO_ID, 0)

    def _ghost_state(self) -> CartesianState | None:
        """Return the pose of the ghost's centre."""
        pose = self._ghost.pose if self._ghost is not None else None
        return None if pose is None else pose.centre()

    def _count_collision(self, sumo: Libsumo) -> None:
        """Count the step if SUMO reports the ego with a real body."""
        for collision in sumo.simulation.getCollisions():
            pair = {collision.collider, collision.victim}
            if EGO_ID in pair and GHOST + EGO_ID not in pair:
                self._reported_collisions += 1
                return
