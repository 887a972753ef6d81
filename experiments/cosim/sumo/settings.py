"""What a SUMO world is made of, and the command line that starts it."""

from dataclasses import dataclass, field
from pathlib import Path

from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.vehicle import Vehicle
from sumo_nets.route_path import StopLine


@dataclass(frozen=True, slots=True)
class SlowLeader:
    """A vehicle that enters with the ego, ahead of it in its lane."""

    id: str  # and its vehicle type in the route file
    gap: float  # from the ego's front bumper to its rear one [m]
    speed: float  # [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class SumoSettings:
    """All that a SUMO world is made of."""

    net_file: Path
    route_file: Path  # demand, and the ego's vehicle type
    route: tuple[str, ...]  # the ego's edges, one beyond its last junction
    path: ReferencePath  # of that route
    road: RoadBounds
    vehicle: Vehicle
    start_s: float  # of the ego's rear axle on the path [m]
    start_offset: float = 0.0  # of the ego, positive to the left [m]
    start_speed: float | None = None  # None: as fast as the gap allows [m/s]
    ego_type: str = "ego"  # vehicle type in the route file
    leader: SlowLeader | None = None
    obstacles: Obstacles = field(default_factory=Obstacles.none)
    stop_lines: tuple[StopLine, ...] = ()
    step: float = 0.1  # [s]
    seed: int = 42
    begin: float = 0.0  # of the demand [s]
    warm_up: float = 60.0  # of traffic alone before the ego asks to enter [s]
    entry_patience: float = 120.0  # how long the ego waits for a gap [s]
    view_radius: float = 150.0  # vehicles farther from the ego are not reported [m]
    # A car changes lanes in this time instead of jumping sideways in one step [s].
    lane_change_duration: float = 2.5
    ghost: bool = True
    gui: bool = False


def command_line(settings: SumoSettings) -> list[str]:
    """Build SUMO's command line, program first."""
    command = ["sumo-gui" if settings.gui else "sumo"]
    command += ["--net-file", str(settings.net_file)]
    command += ["--route-files", str(settings.route_file)]
    command += ["--begin", repr(float(settings.begin))]
    command += ["--step-length", repr(float(settings.step))]
    command += ["--seed", str(settings.seed)]
    command += ["--no-step-log", "--no-warnings"]
    # Queues stay; SUMO removes nobody, whatever it takes for a collision.
    command += ["--time-to-teleport", "-1"]
    command += ["--collision.action", "warn"]
    command += ["--collision.mingap-factor", "0"]
    command += ["--collision.check-junctions", "true"]
    if settings.lane_change_duration > 0.0:
        command += ["--lanechange.duration", repr(float(settings.lane_change_duration))]
    if settings.gui:
        # No delay of SUMO's: it would hold for the warm-up too.
        command += ["--start", "--quit-on-end", "--delay", "0"]
    return command
