"""Cases 1 and 2 of [Thesis] ch. 6: one car from behind in the lane to change to.

The clamped cubic over 60 m with C at 12 m, then straight on; the rear car drives
14 m/s and is 12 m behind, centre to centre. Where the thesis leaves a parameter open,
it is set such that both published behaviours come out.
"""

from dataclasses import dataclass, replace

import numpy as np

from planner.lane_change.path import ChangeTarget, best_change
from planner.lane_change.settings import PathSettings, SpeedSettings
from planner.lane_change.speed.area_rule import area_above, area_below
from planner.lane_change.speed.passing_orders import Side
from planner.lane_change.speed.plan import SpeedPlan, plan_speed
from planner.lane_change.speed.program import SpeedTask, knot_times
from planner.lane_change.speed.st_graph import in_time
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Prediction, Vehicles
from planner.states import FloatArray, FrenetState, Path
from planner.vehicle import Vehicle, VehicleLimits

LANE = 3.5  # [m]
PATH_LENGTH = 200.0  # S_L [m]
CAR_SPEED, CAR_BEHIND = 14.0, 12.0  # [m/s], between the centres [m]
WISH = 11.0  # v_ref [m/s]
EGO = Vehicle(
    limits=VehicleLimits(max_speed=20.0, max_acceleration=2.5, max_deceleration=4.0)
)
SHAPE = PathSettings(
    change_times=(0.1,), min_lengths=(60.0,), c_ratios=(0.2,), lateral_acceleration=9.0
)
# of the published scenario: no gaps and headways beyond the margins
SPEED = SpeedSettings(front_gap=0.0, front_headway=0.0, rear_gap=0.0, rear_headway=0.0)
VARIANTS = {
    "margins 1.0 m along, 0.3 m across": SPEED,
    "no margin along": replace(SPEED, along_margin=0.0),
    "no margin across": replace(SPEED, across_margin=0.0),
    "no margins": replace(SPEED, along_margin=0.0, across_margin=0.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class SpeedCase:
    """One case and its plan."""

    start_speed: float  # [m/s]
    path: Path
    plan: SpeedPlan
    settings: SpeedSettings

    @property
    def area_a(self) -> float:
        """Area of region A, ahead of the car, before first contact, eq. 6.18 [m s]."""
        before, _, high = self._contact()
        acceleration = EGO.limits.max_acceleration
        return area_above(before, self.start_speed, acceleration, high, PATH_LENGTH)

    @property
    def area_b(self) -> float:
        """Area of region B, behind the car, before first contact, eq. 6.18 [m s]."""
        before, low, _ = self._contact()
        return area_below(before, self.start_speed, -EGO.limits.max_deceleration, low)

    @property
    def region(self) -> str:
        """Region of the plan: A ahead of the car, B behind it."""
        return "A" if self.plan.order[0][1] is Side.BEFORE else "B"

    def _contact(self) -> tuple[FloatArray, float, float]:
        """Return the times up to first contact, and the distances of the car there."""
        graph = self.plan.graph
        first = int(np.argmax(graph.hit[0]))
        times = knot_times(self.settings)[: first + 1]
        return times, float(graph.lower[0, first]), float(graph.upper[0, first])


def solve_case(start_speed: float, settings: SpeedSettings = SPEED) -> SpeedCase:
    """Plan one case.

    Args:
        start_speed: v0; 9 m/s is case 1, 15 m/s is case 2.
        settings: Weights and margins.
    """
    road = ReferencePath.from_segments([line(2.0 * PATH_LENGTH)])
    ego = FrenetState(100.0, start_speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    change, _ = best_change(road, ego, ChangeTarget(LANE, 0.0, PATH_LENGTH), EGO, SHAPE)
    if change is None:
        raise ValueError("the path of the case breaks a limit")
    car = _rear_car(ego.s + EGO.centre_offset - CAR_BEHIND, knot_times(settings))
    plan = plan_speed(
        change.path,
        EGO,
        in_time(car, knot_times(settings)),
        np.ones(1, np.bool_),
        SpeedTask(start_speed, 0.0, WISH),
        settings,
    )
    return SpeedCase(start_speed, change.path, plan, settings)


def _rear_car(centre: float, times: FloatArray) -> Vehicles:
    """Build the car that approaches from behind at constant speed."""
    s = (centre + CAR_SPEED * times)[None]
    across, none = np.full_like(s, LANE), np.zeros(1)
    ahead = Prediction(float(times[1]), s, across, np.zeros_like(s), s, across)
    return Vehicles(
        ("car",),
        s[:, 0],
        across[:, 0],
        none,
        np.full(1, CAR_SPEED),
        none,
        none,
        np.full(1, EGO.length),
        np.full(1, EGO.width),
        ahead,
    )
