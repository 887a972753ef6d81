"""Settings of a SUMO world, and the command line that starts it."""

from dataclasses import dataclass
from pathlib import Path

from experiments.cosim.road import EgoTask, Road
from experiments.cosim.sumo.cooperation import CooperationSettings
from experiments.cosim.sumo.driver_errors import DriverErrorSettings
from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from sumo_nets.demand_records import DemandFiles
from sumo_nets.sumocfg import command_options

EGO_TYPE = "ego"  # vehicle type in the route file
BEGIN = 0.0  # of the demand [s]
ENTRY_PATIENCE = 120.0  # how long the ego waits for a gap to enter in [s]
VIEW_RADIUS = 150.0  # vehicles farther from the ego are not read [m]
# A car changes lanes in this time instead of jumping sideways in one step [s].
LANE_CHANGE_DURATION = 2.5


@dataclass(frozen=True, slots=True)
class SlowLeader:
    """A vehicle that enters with the ego, ahead of it in its lane."""

    id: str  # and its vehicle type in the route file
    gap: float  # from the ego's front bumper to its rear one [m]
    speed: float  # [m/s]


@dataclass(frozen=True, slots=True)
class ClosedLanes:
    """How SUMO's traffic sees the obstacles, and which whole lanes they close."""

    lanes: tuple[str, ...] = ()  # ids; of no more than the obstacles' stretch
    disallowed: bool = False  # to the traffic; SUMO's driver is told apart from that
    twins: bool = True  # the obstacles stand in the lanes as stopped vehicles


@dataclass(frozen=True, slots=True, eq=False)
class SumoSettings:
    """All that a SUMO world is made of."""

    net_file: Path
    route_file: Path  # demand, and the ego's vehicle type
    route: tuple[str, ...]  # the ego's edges, one beyond its last junction
    road: Road  # along that route
    task: EgoTask
    leader: SlowLeader | None = None
    closed: ClosedLanes = ClosedLanes()
    driver: SumoDriverSettings | None = None  # SUMO's in the ego's place
    ghost: bool = True  # followers see an ego that reaches over a lane line
    lane_change_guard: bool = True  # no lane change into an ego abreast
    errors: DriverErrorSettings | None = None  # of the traffic's drivers
    relaxation: float = 0.0  # until a follower cut in has its time gap back [s]
    cooperation: CooperationSettings | None = None  # with an ego that indicates
    step: float = 0.1  # [s]
    seed: int = 42
    warm_up: float = 60.0  # of traffic alone before the ego asks to enter [s]
    begin: float = BEGIN  # of the simulation [s]
    demand: DemandFiles | None = None  # of the user
    taken: str | None = None  # vehicle of that demand whose place the ego takes
    entry_patience: float = ENTRY_PATIENCE
    gui: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class FleetSettings:
    """All that a SUMO world with many egos is made of."""

    net_file: Path
    route_file: Path  # demand
    step: float = 0.1  # [s]
    seed: int = 42
    warm_up: float = 60.0  # of traffic before any vehicle is taken over [s]
    begin: float = BEGIN  # of the simulation [s]
    demand: DemandFiles | None = None  # of the user
    ghost: bool = True  # followers see egos that reach over a lane line
    lane_change_guard: bool = True  # no lane change into an ego abreast
    driver: None = None  # SUMO's in an ego's place
    gui: bool = False


def command_line(settings: SumoSettings | FleetSettings) -> list[str]:
    """Build SUMO's command line, program first."""
    command = ["sumo-gui" if settings.gui else "sumo"]
    command += ["--net-file", str(settings.net_file)]
    demand = settings.demand
    routes = [settings.route_file, *(demand.route_files if demand else ())]
    command += ["--route-files", ",".join(map(str, routes))]
    if demand is not None and demand.additional_files:
        command += ["--additional-files", ",".join(map(str, demand.additional_files))]
    command += ["--begin", repr(settings.begin)]
    command += ["--step-length", repr(float(settings.step))]
    command += ["--seed", str(settings.seed)]
    command += ["--no-step-log", "--no-warnings"]
    # Queues stay; SUMO removes no vehicle, whatever it takes for a collision.
    command += ["--time-to-teleport", "-1"]
    command += ["--save-state.precision", "12"]
    command += ["--collision.action", "warn"]
    command += ["--collision.mingap-factor", "0"]
    command += ["--collision.check-junctions", "true"]
    if demand is not None:
        if "route-steps" not in dict(demand.options):
            # all at once: of a file that is not in the order of departure SUMO would
            # leave out, without a word, who comes after somebody that departs late
            command += ["--route-steps", "0"]
        command += command_options(demand)
    resolution = 0.0 if settings.driver is None else settings.driver.lateral_resolution
    given = demand is not None and "lateral-resolution" in dict(demand.options)
    if resolution > 0.0 and not given:
        command += ["--lateral-resolution", repr(float(resolution))]
    if resolution <= 0.0 and not given:  # SUMO allows one of them
        command += ["--lanechange.duration", repr(LANE_CHANGE_DURATION)]
    if settings.gui:
        # No delay of SUMO's: it would hold for the warm-up too.
        command += ["--start", "--quit-on-end", "--delay", "0"]
    return command
