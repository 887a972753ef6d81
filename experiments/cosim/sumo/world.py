"""SUMO as a world.

One simulation per process: libsumo holds a single one, and a second start would
silently replace the first.
"""

import math
from collections.abc import Sequence, Set
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType

import numpy as np

from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.road import Road
from experiments.cosim.sumo import frames
from experiments.cosim.sumo import obstacle_vehicles as obstacles
from experiments.cosim.sumo.closed_lanes import close_to_traffic
from experiments.cosim.sumo.cooperation import Cooperation
from experiments.cosim.sumo.driver_errors import DriverErrors
from experiments.cosim.sumo.ego_entry import (
    EGO_ID,
    EGO_ROUTE,
    Departure,
    departures,
    entry_speed,
    stands_free,
)
from experiments.cosim.sumo.ghost_vehicle import (
    GHOST,
    KEEP_ROUTE_EXACT,
    NO_CHECKS,
    Ghost,
)
from experiments.cosim.sumo.lane_change_guard import LaneChangeGuard, abreast
from experiments.cosim.sumo.lanes import Strip, all_lanes, edge_lanes, route_strips
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.movements import MovementReader
from experiments.cosim.sumo.relaxation import Relaxation
from experiments.cosim.sumo.route_window import RouteWindow
from experiments.cosim.sumo.settings import (
    EGO_TYPE,
    VIEW_RADIUS,
    SumoSettings,
    command_line,
)
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.cosim.sumo.vehicle_reader import VehicleReader
from experiments.cosim.waiting_lines import is_before_line
from experiments.errors import EntryError, SimulationError
from planner.interface import Indicator
from planner.reference_path.frenet import state_on_path
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import CartesianState, Trajectory
from planner.ways import Ways
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import check_complete

SLOWEST_ENTRY = 1.0  # at which the ego always may enter [m/s]
PLAN_ID = "rearview.plan"  # of the line drawn in SUMO's window
PLAN_COLOUR = (213, 94, 0, 255)  # as in all pictures
PLAN_LAYER = 200  # above the vehicles
PLAN_WIDTH = 0.4  # [m]


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
        self._errors: DriverErrors | None = None
        self._relaxation: Relaxation | None = None
        self._cooperation: Cooperation | None = None
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
        self._shown_at = -math.inf  # when the last step was shown [s]

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
            SimulationError: If SUMO does not start, or finds no gap in time.
        """
        settings = self._settings
        sumo, entering = self._set_up()
        with sumo_errors(sumo, "inserting the ego"):
            if settings.taken is None:
                self._insert(sumo, entering)
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
        if settings.relaxation > 0.0:
            self._relaxation = Relaxation(sumo, settings.relaxation)
        if settings.cooperation is not None:
            self._cooperation = Cooperation(
                sumo,
                settings.cooperation,
                EGO_ID,
                frozenset(self._hidden),
                left_hand=self.road.lanes.left_hand,
            )
        self._ego_front = frames.front_from_rear_axle(ego, self._vehicle)[:2]
        return ego

    def observe(self) -> TrafficState:
        """Read every vehicle within the view radius of the ego, sorted by id.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo, reader = self._running(), self._reading()
        with sumo_errors(sumo, "reading the traffic"):
            self._others = reader.near(self._ego_front, VIEW_RADIUS)
            looks = reader.looks(self._others.ids)
            signals = self._read_signals(sumo)
        time = self._steps * self.step
        errors = self._errors
        erring = () if errors is None else errors.present()
        ghost = self._ghost_state()
        return TrafficState(
            time,
            self._others,
            signals,
            ghost,
            looks=looks,
            erring=erring,
            log_weight=None if errors is None else errors.log_weight,
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
            self._move_drivers(sumo)
            sumo.simulationStep()
            if sumo.simulation.getCollidingVehiclesNumber():
                self._count_collision(sumo)
        if self._settings.gui:
            self._keep_pace()
        self._steps += 1
        return ego

    def _is_before_line(self, speed: float) -> bool:
        """Check whether the ego is before a line of its road, or stands at it."""
        road = self.road
        if not (road.stop_lines or road.junctions):
            return False
        self._front_s, _ = road.path.project_one(*self._ego_front, self._front_s)
        return is_before_line(road, self._front_s, speed)

    def _move_drivers(self, sumo: Libsumo) -> None:
        """Let drivers err, cooperate, and relax after a cut-in, before a step."""
        if self._errors is not None:
            ego = self._ego_front if math.isfinite(self._ego_front[0]) else None
            self._errors.update(float(sumo.simulation.getTime()), ego)
        if self._relaxation is not None:
            has_ghost = self._ghost is not None and self._ghost.pose is not None
            leaders = (EGO_ID, GHOST + EGO_ID) if has_ghost else (EGO_ID,)
            self._relaxation.update(self._steps * self.step, leaders)
        if self._cooperation is not None:
            self._cooperation.update(self._steps * self.step, self._indicator)

    def indicate(self, indicator: Indicator) -> None:
        """Show what the ego indicates from now on."""
        self._indicator = indicator

    def _keep_pace(self) -> None:
        """Wait so that a step takes as long as it lasts."""
        now = monotonic()
        due = self._shown_at + self.step
        if now < due:
            sleep(due - now)
        self._shown_at = max(now, due)

    def show_plan(self, plan: Trajectory) -> None:
        """Draw a plan in SUMO's window, replacing the one before.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo = self._running()
        points = list(zip(plan.x.tolist(), plan.y.tolist(), strict=True))
        with sumo_errors(sumo, "drawing the plan"):
            if PLAN_ID in sumo.polygon.getIDList():
                sumo.polygon.setShape(PLAN_ID, points)
            else:
                look = PLAN_COLOUR, False, "plan", PLAN_LAYER, PLAN_WIDTH
                sumo.polygon.add(PLAN_ID, points, *look)

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
            if settings.errors is not None:
                self._errors = DriverErrors(sumo, settings.errors, self._hidden)
            self._check_ego_type(sumo)
            self._check_stop_lines(sumo)
        with sumo_errors(sumo, "warming up"):
            if settings.warm_up > 0.0:
                sumo.simulationStep(settings.begin + settings.warm_up)
        return sumo, entering

    def _start(self) -> Libsumo:
        """Start SUMO on the settings' files."""
        sumo = ready_libsumo(self._settings.net_file)
        # From here on close() has something to end, also after a failed start.
        self._sumo = sumo
        with sumo_errors(sumo, "starting"):
            sumo.start(command_line(self._settings))
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

    def _check_ego_type(self, sumo: Libsumo) -> None:
        """Raise if the ego's SUMO type has another size."""
        types, name = sumo.vehicletype, EGO_TYPE
        size = (types.getLength(name), types.getWidth(name))
        vehicle = self._vehicle
        if not np.allclose(size, (vehicle.length, vehicle.width), atol=1e-3):
            raise SimulationError(
                f"vehicle type {name!r} measures {size[0]:g} x {size[1]:g} m, "
                f"the ego {vehicle.length:g} x {vehicle.width:g} m"
            )

    def _check_stop_lines(self, sumo: Libsumo) -> None:
        """Raise if a traffic light does not have the letter of a stop line."""
        for line in self.road.stop_lines:
            state = sumo.trafficlight.getRedYellowGreenState(line.signal)
            if not 0 <= line.link < len(state):
                raise SimulationError(
                    f"traffic light {line.signal!r} has links 0 to {len(state) - 1}, "
                    f"no {line.link}"
                )

    def _insert(self, sumo: Libsumo, entering: Sequence[Departure]) -> None:
        """Wait until SUMO finds safe gaps for all of them, then take the ego over."""
        settings, ego = self._settings, entering[0]
        if ego.speed is not None:
            # The scenario decides how fast the ego enters, not the lane's limit.
            self._allow(sumo, ego.speed, ego.lane.id)
        fastest = float(sumo.vehicletype.getMaxSpeed(EGO_TYPE))
        if ego.speed is None:
            most = min(fastest, max(entry_speed(settings), SLOWEST_ENTRY))
            sumo.vehicletype.setMaxSpeed(EGO_TYPE, most)
        self._ego_front = frames.front_from_rear_axle(
            self._at_start(0.0), self._vehicle
        )[:2]
        ahead_first = entering[::-1]  # the vehicle behind adapts to the one ahead
        for one in ahead_first:
            one.ask(sumo)
        for step in range(max(round(settings.entry_patience / settings.step), 1)):
            sumo.simulationStep()
            arrived = {one.id for one in entering} & set(sumo.vehicle.getIDList())
            if not arrived:
                continue
            if len(arrived) == len(entering) and self._stands_free(sumo):
                self._entry_steps = step + 1
                break
            # All at once or none; SUMO considers the lane alone, and another vehicle
            # may reach into it from the next one.
            for one in ahead_first:
                sumo.vehicle.remove(one.id)
                one.ask(sumo)
        else:
            speed = "any speed" if ego.speed is None else f"{ego.speed:g} m/s"
            raise EntryError(
                f"no room to enter within {settings.entry_patience:g} s on lane "
                f"{ego.lane.id} at {ego.position:.1f} m with {speed}: take less "
                "traffic, another ego.start_m or network.lane, or ego.depart_speed_mps:"
                " max"
            )
        sumo.vehicletype.setMaxSpeed(EGO_TYPE, fastest)
        self._take_over(sumo)
        if settings.gui:
            sumo.gui.trackVehicle("View #0", EGO_ID)
            sumo.gui.setZoom("View #0", 1200)

    @staticmethod
    def _allow(sumo: Libsumo, speed: float, lane: str) -> None:
        """Let the ego enter a lane with this speed, whatever the lane's limit [m/s]."""
        factor = max(1.0, 1.001 * speed / float(sumo.lane.getMaxSpeed(lane)))
        sumo.vehicletype.setSpeedFactor(EGO_TYPE, factor)

    def _replace(self, sumo: Libsumo, name: str) -> CartesianState:
        """Wait for a vehicle of the demand and put the ego in its place.

        Returns:
            Where the ego is a step later, beside its path as far as the vehicle was.
        """
        settings, path = self._settings, self.road.path
        for step in range(max(round(settings.entry_patience / settings.step), 1)):
            sumo.simulationStep()
            if name in sumo.vehicle.getIDList():
                self._entry_steps = step + 1
                break
        else:
            raise EntryError(
                f'the vehicle "{name}" did not depart within '
                f"{settings.entry_patience:g} s of its time: its road is full"
            )
        fastest = float(sumo.vehicletype.getMaxSpeed(EGO_TYPE))
        speed = min(float(sumo.vehicle.getSpeed(name)), fastest)
        self._allow(sumo, speed, str(sumo.vehicle.getLaneID(name)))
        x, y = sumo.vehicle.getPosition(name)
        angle = float(sumo.vehicle.getAngle(name))
        sumo.vehicle.remove(name)
        rear = frames.rear_axle_from_front(x, y, angle, self._vehicle)
        s, l = path.project(np.array(rear[:1]), np.array(rear[1:2]))
        ego = state_on_path(
            path, max(float(s[0]), 0.0) + speed * self.step, float(l[0]), speed
        )
        sumo.vehicle.add(EGO_ID, EGO_ROUTE, typeID=EGO_TYPE, departSpeed=repr(speed))
        self._take_over(sumo)
        sumo.vehicle.setSpeed(EGO_ID, speed)
        x, y, angle = frames.front_from_rear_axle(ego, self._vehicle)
        sumo.vehicle.moveToXY(EGO_ID, "", -1, x, y, angle, KEEP_ROUTE_EXACT)
        sumo.simulationStep()
        return ego

    def _stands_free(self, sumo: Libsumo) -> bool:
        """Check that no vehicle is in the way of the ego that SUMO has inserted."""
        start = self._at_start(float(sumo.vehicle.getSpeed(EGO_ID)))
        others = self._reading().near(self._ego_front, VIEW_RADIUS)
        return stands_free(self._vehicle, start, others)

    def _take_over(self, sumo: Libsumo) -> None:
        """Switch SUMO's own driver off."""
        sumo.vehicle.setSpeedMode(EGO_ID, NO_CHECKS)
        sumo.vehicle.setLaneChangeMode(EGO_ID, 0)

    def _read_signals(self, sumo: Libsumo) -> tuple[Signal, ...]:
        """Read the ego's letter of every traffic light on its route."""
        lines = self.road.stop_lines
        if not lines:
            return ()
        state_of = sumo.trafficlight.getRedYellowGreenState
        letters = {line.signal: "" for line in lines}
        for signal in letters:
            letters[signal] = state_of(signal)
        return tuple(
            Signal(line.signal, line.s, letters[line.signal][line.link])
            for line in lines
        )

    def _ghost_state(self) -> CartesianState | None:
        """Return the pose of the ghost's centre."""
        pose = self._ghost.pose if self._ghost is not None else None
        if pose is None:
            return None
        half = pose.length / 2.0
        x = pose.x - half * math.cos(pose.heading)
        y = pose.y - half * math.sin(pose.heading)
        return CartesianState(x, y, pose.heading, 0.0, 0.0, 0.0)

    def _count_collision(self, sumo: Libsumo) -> None:
        """Count the step if SUMO reports the ego with a real body."""
        for collision in sumo.simulation.getCollisions():
            pair = {collision.collider, collision.victim}
            if EGO_ID in pair and GHOST + EGO_ID not in pair:
                self._reported_collisions += 1
                return


def ready_libsumo(net_file: Path) -> Libsumo:
    """Return libsumo, which can be started on a network.

    Raises:
        SimulationError: If it cannot be loaded, is in use, or would die of the file.
    """
    sumo = load_libsumo()
    try:
        check_complete(net_file)
    except NetworkError as error:
        raise SimulationError(str(error)) from error
    if sumo.isLoaded():
        raise SimulationError("this process already runs a simulation: close it")
    return sumo


class sumo_errors:  # noqa: N801 - reads as the function that it is used as
    """Turn SUMO's exceptions into ours; entered several times in every step.

    Args:
        sumo: The running libsumo module.
        doing: What fails, in words.
    """

    __slots__ = ("_doing", "_sumo")

    def __init__(self, sumo: Libsumo, doing: str) -> None:
        self._sumo = sumo
        self._doing = doing

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Raise an error of ours instead of one of SUMO's."""
        if error is None:
            return
        sumo = self._sumo
        if isinstance(error, (sumo.TraCIException, sumo.FatalTraCIError)):
            cause = " ".join(str(error).split())  # one line, also of a parser's report
            raise SimulationError(
                f"SUMO failed while {self._doing}: {cause}"
            ) from error
