"""Numbers of sensors and tracker."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from planner.states import FloatArray


@dataclass(frozen=True, slots=True)
class PerceptionSettings:
    """How well the ego sees; deviations are standard deviations."""

    reach: float  # [m]
    latency: float  # age of what is seen when it is known [s]
    missed: float  # share of detections that do not happen
    position: float  # along each axis [m]
    heading: float  # [rad]
    speed: float  # [m/s], of accelerations in m/s²
    size: float  # of a vehicle's length and width, the same all the time [m]
    correlation: float = 1.0  # in which noise changes [s]
    field_of_view: float = 2.0 * math.pi  # about the heading [rad]
    occlusion: bool = True
    forget_after: float = 1.0  # a vehicle not seen for longer is not believed [s]
    margin: float = 2.0  # bodies are believed larger, in deviations of the position
    buildings: tuple[FloatArray, ...] = ()  # corners of polygons, (n, 2) [m]


# good: a car with lidar all round; poor: cameras in rain
PERCEPTION: Mapping[str, PerceptionSettings] = {
    "good": PerceptionSettings(
        reach=120.0,
        latency=0.1,
        missed=0.02,
        position=0.1,
        heading=0.01,
        speed=0.2,
        size=0.05,
    ),
    "poor": PerceptionSettings(
        reach=60.0,
        latency=0.3,
        missed=0.1,
        position=0.3,
        heading=0.03,
        speed=0.5,
        size=0.2,
    ),
}
