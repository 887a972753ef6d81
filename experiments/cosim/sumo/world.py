"""SUMO as a world: the only module that imports libsumo.

One simulation per process: libsumo holds a single one, and a second start would
silently take the place of the first.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic, sleep
from types import ModuleType

import numpy as np

from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.sumo import frames
from experiments.cosim.sumo import obstacle_vehicles as obstacles
from experiments.cosim.sumo.ego_entry import (
    EGO_ID,
    EGO_ROUTE,
    Departure,
    departures,
    stands_free,
    start_state,
)
from experiments.cosim.sumo.ghost_vehicle import (
    GHOST_ID,
    KEEP_ROUTE_EXACT,
    NO_CHECKS,
    Ghost,
)
from experiments.cosim.sumo.lane_change_guard import LaneChangeHold, abreast
from experiments.cosim.sumo.lanes import all_lanes, edge_lanes, route_strips
from experiments.cosim.sumo.settings import SumoSettings, command_line
from experiments.cosim.sumo.vehicle_reader import VehicleReader, traffic_state
from experiments.errors import SimulationError
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState, Trajectory
from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import check_complete

PLAN_ID = "rearview.plan"  # of the line drawn in SUMO's window
PLAN_COLOUR = (213, 94, 0, 255)  # as in all pictures
PLAN_LAYER = 200  # above the vehicles
PLAN_WIDTH = 0.4  # [m]
SYSTEM_LIBRARIES = "libgl1 libx11-6 libxext6 libxrender1 libatomic1 libexpat1"


class SumoWorld:
    """A SUMO network with its traffic, and the ego moved through it.

    SUMO starts in `enter`; `close` ends it. Every error of SUMO, also one of a missing
    system library, comes out as a `SimulationError`.
    """

    def __init__(self, settings: SumoSettings) -> None:
        self._settings = settings
        self._sumo: ModuleType | None = None
        self._ghost: Ghost | None = None
        self._hold: LaneChangeHold | None = None
        self._traffic: TrafficState | None = None  # as last observed
        self._ego_front = (math.nan, math.nan)
        self._reader: VehicleReader | None = None
        self._steps = 0
        self._entry_steps = 0
        self._reported_collisions = 0
        self._shown_at = -math.inf  # when the last step was shown [s]

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._settings.step

    @property
    def path(self) -> ReferencePath:
        """Reference path of the ego's route."""
        return self._settings.path

    @property
    def road(self) -> RoadBounds:
        """Lateral room along `path`."""
        return self._settings.road

    @property
    def obstacles(self) -> Obstacles:
        """Static bodies, as they are and not as SUMO sees them."""
        return self._settings.obstacles

    @property
    def entry_steps(self) -> int:
        """Steps after the warm-up in the last of which the ego entered."""
        return self._entry_steps

    @property
    def reported_collisions(self) -> int:
        """Steps in which SUMO itself saw the ego collide: a cross-check, no truth.

        SUMO misses overlaps across lane lines and reports others that are none.
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
            self._insert(sumo, entering)
            speed = float(sumo.vehicle.getSpeed(EGO_ID))
        edge = entering[0].edge
        if settings.ghost:
            with sumo_errors(sumo, "reading the lanes"):
                strips = route_strips(sumo, settings.route[edge:])
                self._ghost = Ghost(sumo, EGO_ID, EGO_ROUTE, settings.ego_type, strips)
        self._hold = LaneChangeHold(sumo)
        ego = start_state(settings, speed)
        self._ego_front = frames.front_from_rear_axle(ego, settings.vehicle)[:2]
        return ego

    def observe(self) -> TrafficState:
        """Read every vehicle within the view radius of the ego, sorted by id.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo, reader = self._running(), self._reading()
        with sumo_errors(sumo, "reading the traffic"):
            ids, rows = reader.near(self._ego_front, self._settings.view_radius)
            signals = self._read_signals(sumo)
        time = self._steps * self.step
        self._traffic = traffic_state(time, ids, rows, signals, self._ghost_state())
        return self._traffic

    def advance(self, ego: CartesianState) -> CartesianState:
        """Put the ego at `ego` and let SUMO move everyone else one step on.

        The others still react to the ego's pose before: SUMO applies the new one at
        the end of the step.

        Returns:
            Where the ego is then: `ego`.

        Raises:
            SimulationError: If SUMO fails or the state is not finite.
        """
        sumo = self._running()
        if not all(map(math.isfinite, (ego.x, ego.y, ego.heading, ego.speed))):
            # SUMO accepts NaN without a word and goes on with it.
            raise SimulationError(f"the ego cannot be moved to {ego}")
        x, y, angle = frames.front_from_rear_axle(ego, self._settings.vehicle)
        with sumo_errors(sumo, "moving the ego"):
            if self._ghost is not None:
                self._ghost.update(ego, self._settings.vehicle)
            # A negative speed would hand the ego back to SUMO's driver.
            sumo.vehicle.setSpeed(EGO_ID, max(ego.speed, 0.0))
            sumo.vehicle.moveToXY(EGO_ID, "", -1, x, y, angle, KEEP_ROUTE_EXACT)
            if self._hold is not None and self._traffic is not None:
                beside = abreast(ego, self._settings.vehicle, self._traffic)
                self._hold.update(beside, set(self._traffic.ids))
            sumo.simulationStep()
            if sumo.simulation.getCollidingVehiclesNumber():
                self._count_collision(sumo)
        if self._settings.gui:
            self._keep_pace()
        self._ego_front = (x, y)
        self._steps += 1
        return ego

    def _keep_pace(self) -> None:
        """Let a step take as long as it lasts, to be watched."""
        now = monotonic()
        due = self._shown_at + self.step
        if now < due:
            sleep(due - now)
        self._shown_at = max(now, due)

    def show_plan(self, plan: Trajectory) -> None:
        """Draw a plan in SUMO's window, in the place of the one before.

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
        self._reader = None
        if sumo is not None and sumo.isLoaded() and not self._settings.gui:
            with sumo_errors(sumo, "closing"):
                sumo.close()

    def _running(self) -> ModuleType:
        """Give the simulation, which must have been started."""
        if self._sumo is None:
            raise SimulationError("the simulation is not running: call enter() first")
        return self._sumo

    def _reading(self) -> VehicleReader:
        """Give the reader of a simulation that is set up."""
        if self._reader is None:
            raise SimulationError("the simulation is not set up: call enter() first")
        return self._reader

    def _set_up(self) -> tuple[ModuleType, list[Departure]]:
        """Start SUMO, place the obstacles, run the warm-up, say who is to enter."""
        settings = self._settings
        sumo = self._start()
        with sumo_errors(sumo, "setting up"):
            route_lanes = [edge_lanes(sumo, edge) for edge in settings.route]
            entering = departures(sumo, settings, route_lanes)
            for one in entering:
                sumo.route.add(one.route, list(settings.route[one.edge :]))
            hidden = {EGO_ID, GHOST_ID, *self._place_obstacles(sumo)}
            self._reader = VehicleReader(sumo, hidden)
            self._check_ego_type(sumo)
            self._check_stop_lines(sumo)
        with sumo_errors(sumo, "warming up"):
            if settings.warm_up > 0.0:
                sumo.simulationStep(settings.begin + settings.warm_up)
        return sumo, entering

    def _start(self) -> ModuleType:
        """Start SUMO on the settings' files."""
        sumo = _import_libsumo()
        try:
            check_complete(self._settings.net_file)
        except NetworkError as error:
            raise SimulationError(str(error)) from error
        if sumo.isLoaded():
            raise SimulationError("this process already runs a simulation: close it")
        # From here on close() has something to end, also after a failed start.
        self._sumo = sumo
        with sumo_errors(sumo, "starting"):
            sumo.start(command_line(self._settings))
        return sumo

    def _place_obstacles(self, sumo: ModuleType) -> frozenset[str]:
        """Make the obstacles visible to SUMO's traffic; gives the names they get."""
        if not self.obstacles.ids:
            return frozenset()
        found = obstacles.twins(self.obstacles, all_lanes(sumo))
        return obstacles.place(sumo, found, EGO_ROUTE)

    def _check_ego_type(self, sumo: ModuleType) -> None:
        """Refuse an ego whose SUMO type has another size."""
        types, name = sumo.vehicletype, self._settings.ego_type
        size = (types.getLength(name), types.getWidth(name))
        vehicle = self._settings.vehicle
        if not np.allclose(size, (vehicle.length, vehicle.width), atol=1e-3):
            raise SimulationError(
                f"vehicle type {name!r} measures {size[0]:g} x {size[1]:g} m, "
                f"the ego {vehicle.length:g} x {vehicle.width:g} m"
            )

    def _check_stop_lines(self, sumo: ModuleType) -> None:
        """Refuse a stop line whose letter the traffic light does not have."""
        for line in self._settings.stop_lines:
            state = sumo.trafficlight.getRedYellowGreenState(line.signal)
            if not 0 <= line.link < len(state):
                raise SimulationError(
                    f"traffic light {line.signal!r} has links 0 to {len(state) - 1}, "
                    f"no {line.link}"
                )

    def _insert(self, sumo: ModuleType, entering: Sequence[Departure]) -> None:
        """Wait for SUMO to find safe gaps for all of them, then take the ego over."""
        settings, ego = self._settings, entering[0]
        if ego.speed is not None:
            # How fast the ego enters is the scenario's business, not the limit's.
            limit = float(sumo.lane.getMaxSpeed(ego.lane.id))
            factor = max(1.0, 1.001 * ego.speed / limit)
            sumo.vehicletype.setSpeedFactor(settings.ego_type, factor)
        self._ego_front = frames.front_from_rear_axle(
            start_state(settings, 0.0), settings.vehicle
        )[:2]
        ahead_first = entering[::-1]  # who enters behind someone adapts to them
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
            # All at once or nobody; SUMO looks at the lane alone, and someone may
            # reach into it from the next one.
            for one in ahead_first:
                sumo.vehicle.remove(one.id)
                one.ask(sumo)
        else:
            raise SimulationError(
                f"no room to enter within {settings.entry_patience:g} s on lane "
                f"{ego.lane.id} at {ego.position:.1f} m with "
                f"{'any speed' if ego.speed is None else f'{ego.speed:g} m/s'}"
            )
        self._take_over(sumo)
        if settings.gui:
            sumo.gui.trackVehicle("View #0", EGO_ID)
            sumo.gui.setZoom("View #0", 1200)

    def _stands_free(self, sumo: ModuleType) -> bool:
        """Tell whether nobody is in the way of the ego that SUMO has inserted."""
        settings = self._settings
        start = start_state(settings, float(sumo.vehicle.getSpeed(EGO_ID)))
        _, rows = self._reading().near(self._ego_front, settings.view_radius)
        return stands_free(settings.vehicle, start, rows)

    def _take_over(self, sumo: ModuleType) -> None:
        """Switch SUMO's own driver off."""
        sumo.vehicle.setSpeedMode(EGO_ID, NO_CHECKS)
        sumo.vehicle.setLaneChangeMode(EGO_ID, 0)

    def _read_signals(self, sumo: ModuleType) -> tuple[Signal, ...]:
        """Read the ego's letter of every traffic light on its route."""
        lines = self._settings.stop_lines
        state_of = sumo.trafficlight.getRedYellowGreenState
        letters = {line.signal: "" for line in lines}
        for signal in letters:
            letters[signal] = state_of(signal)
        return tuple(
            Signal(line.signal, line.s, letters[line.signal][line.link])
            for line in lines
        )

    def _ghost_state(self) -> CartesianState | None:
        """Say where the centre of the ghost is."""
        pose = self._ghost.pose if self._ghost is not None else None
        if pose is None:
            return None
        half = self._settings.vehicle.length / 2.0
        x = pose.x - half * math.cos(pose.heading)
        y = pose.y - half * math.sin(pose.heading)
        return CartesianState(x, y, pose.heading, 0.0, 0.0, 0.0)

    def _count_collision(self, sumo: ModuleType) -> None:
        """Count the step if SUMO reports the ego with a real body."""
        for collision in sumo.simulation.getCollisions():
            pair = {collision.collider, collision.victim}
            if EGO_ID in pair and GHOST_ID not in pair:
                self._reported_collisions += 1
                return


def _import_libsumo() -> ModuleType:
    """Import libsumo, which needs libraries of the system.

    Raises:
        SimulationError: If it cannot be imported; one line that says what to install.
    """
    try:
        import libsumo
    except (ImportError, OSError) as error:
        cause = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SimulationError(
            f"libsumo cannot be loaded ({cause}); its system libraries come with: "
            f"apt-get install {SYSTEM_LIBRARIES}"
        ) from error
    module: ModuleType = libsumo
    return module


@contextmanager
def sumo_errors(sumo: ModuleType, doing: str) -> Iterator[None]:
    """Turn SUMO's exceptions into ours."""
    try:
        yield
    except (sumo.TraCIException, sumo.FatalTraCIError) as error:
        cause = " ".join(str(error).split())  # one line, also of a parser's report
        raise SimulationError(f"SUMO failed while {doing}: {cause}") from error
