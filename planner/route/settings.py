"""Parameters of the route planner."""

from dataclasses import dataclass, field

from planner.cruise import CruiseSettings
from planner.dense import DenseSettings
from planner.lane_change import LaneChangeSettings
from planner.lane_change.settings import ManoeuvreSettings
from planner.states import store_floats


@dataclass(frozen=True, slots=True)
class RouteSettings:
    """Everything that can be set."""

    # in the narrow turns of small junctions short motions lead back to the lane as well
    cruise: CruiseSettings = field(
        default_factory=lambda: CruiseSettings(starting_lengths=(16.0, 24.0, 4.0, 6.0))
    )
    dense: DenseSettings = field(default_factory=DenseSettings)
    manoeuvre: ManoeuvreSettings = LaneChangeSettings().manoeuvre
    need_time: float = 14.0  # before the end of a lane, for each lane to change [s]
    need_room: float = 60.0  # and this [m]
    end_room: float = 14.0  # kept to the end of a lane that must be left [m]
    gain: float = 3.0  # of mean speed, that is worth a change [m/s]
    quiet: float = 120.0  # a lane taken for speed leads on for twice as long [m]
    settle_time: float = 4.0  # from a change for speed to a line or junction [s]
    settle_room: float = 8.0  # and this [m]
    patience: float = 12.0  # standing before what stands, then round it [s]
    stuck_after: float = 2.0  # standing before obstacles, then dense drives [s]

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)
