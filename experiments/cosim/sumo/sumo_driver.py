"""SUMO's own driver in the ego's place: the baseline for paired comparison.

The same vehicle with the same limits enters the same traffic; SUMO's car-following and
lane-change model (Krauss with LC2013, or with its sublane model SL2015) drive it. What
is planned is not driven. It is told of a closure from the same distance as a planner.
"""

import math
from dataclasses import dataclass

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.closed_lanes import NOT_TOLD, TOLD, close_to_told_ego
from experiments.cosim.sumo.control_modes import NO_LIMIT
from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from experiments.cosim.sumo.ego_entry import EGO_ID
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.sumo_errors import sumo_errors
from experiments.cosim.sumo.world import SumoWorld
from experiments.errors import SimulationError
from planner.interface import PlanResult, PlanStatus
from planner.scene import Scene
from planner.states import CartesianState, Trajectory

LEAST_DRIVEN = 0.05  # a step this short has no curvature [m]
MOST_TURNED = math.pi / 2.0  # in one step; beyond it SUMO's angle is wrong [rad]


class SumoDriverWorld(SumoWorld):
    """A SUMO world whose ego is driven by SUMO, at the ego's target speed."""

    _wish = math.nan  # the highest speed that SUMO's driver was told [m/s]
    _s: float | None = None  # where the ego was last [m]
    _told = False  # of the closure

    def advance(self, ego: CartesianState) -> CartesianState:
        """Let SUMO move all vehicles, the ego too.

        Args:
            ego: Its present state.

        Returns:
            The rear axle after the step, with the curvature that it has driven.

        Raises:
            SimulationError: If SUMO fails or has taken the ego out.
        """
        sumo = self._running()
        with sumo_errors(sumo, "driving the ego"):
            self._keep_limit(sumo, ego)
            self._tell(sumo)
            self._move_drivers()
            sumo.simulationStep()
            if EGO_ID not in sumo.vehicle.getIDList():
                raise SimulationError("SUMO has taken the ego off the road")
            x, y = sumo.vehicle.getPosition(EGO_ID)
            angle = float(sumo.vehicle.getAngle(EGO_ID))
            speed = float(sumo.vehicle.getSpeed(EGO_ID))
            acceleration = float(sumo.vehicle.getAcceleration(EGO_ID))
        self._ego_front = (x, y)
        self._steps += 1
        heading = frames.heading_from_angle(angle)
        turned = math.remainder(heading - ego.heading, 2.0 * math.pi)
        if abs(turned) > MOST_TURNED:
            # Between two lanes at the joint of two edges, SUMO 1.28 can give an angle
            # turned by half a circle for one step.
            angle, turned = frames.angle_from_heading(ego.heading), 0.0
        rear_x, rear_y, heading = frames.rear_axle_from_front(
            x, y, angle, self._settings.task.vehicle
        )
        driven = speed * self.step
        curvature = turned / driven if driven > LEAST_DRIVEN else 0.0
        return CartesianState(rear_x, rear_y, heading, curvature, speed, acceleration)

    def _keep_limit(self, sumo: Libsumo, ego: CartesianState) -> None:
        """Bound the speed by the road's limits, as for a planner."""
        task, path = self._settings.task, self.road.path
        s, _ = path.project_one(ego.x, ego.y, self._s)
        self._s = s
        allowed = self.road.allowed_speed(s + task.vehicle.front_reach, ego.speed)
        wish = min(task.vehicle.limits.max_speed, task.target_speed, allowed)
        if wish != self._wish:
            sumo.vehicle.setMaxSpeed(EGO_ID, wish)
            self._wish = wish

    def _tell(self, sumo: Libsumo) -> None:
        """Tell the driver of a closure once it is near enough to be known."""
        closure, s = self.road.closure, self._s
        if self._told or closure is None or s is None or not self._hears:
            return
        if closure.is_known(s + self._settings.task.vehicle.front_reach):
            sumo.vehicle.setVehicleClass(EGO_ID, TOLD)
            self._told = True

    @property
    def _hears(self) -> bool:
        """Whether there are closed lanes of which the driver is told."""
        driver = self._settings.driver
        return driver is not None and driver.told and bool(self._settings.closed.lanes)

    def _replace(self, sumo: Libsumo, name: str) -> CartesianState:
        """Put the ego in a vehicle's place and leave its speed to SUMO's driver."""
        ego = super()._replace(sumo, name)
        sumo.vehicle.setSpeed(EGO_ID, -1.0)  # until then it kept the vehicle's
        return ego

    def _take_over(self, sumo: Libsumo) -> None:
        """Keep SUMO's driver, with the ego's limits and target speed.

        The limits inside junctions bind SUMO's driver no more than they do a planner.
        """
        task = self._settings.task
        limits = task.vehicle.limits
        wish = min(limits.max_speed, task.target_speed)
        sumo.vehicle.setAccel(EGO_ID, limits.max_acceleration)
        sumo.vehicle.setMaxSpeed(EGO_ID, wish)
        self._wish = wish
        sumo.vehicle.setSpeedFactor(EGO_ID, NO_LIMIT)
        driver = self._settings.driver or SumoDriverSettings()
        for name, value in driver.parameters.items():
            key = f"laneChangeModel.{name}"
            sumo.vehicle.setParameter(EGO_ID, key, repr(float(value)))
        if self._hears:
            close_to_told_ego(sumo, self._settings.closed.lanes)
            sumo.vehicle.setVehicleClass(EGO_ID, NOT_TOLD)


@dataclass(frozen=True, slots=True)
class NoOpPlanner:
    """A planner whose trajectory goes straight on, and is not driven."""

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Return a trajectory that keeps heading and speed."""
        t = scene.step * np.arange(11, dtype=np.float64)
        ego, place = scene.ego, scene.ego_frenet
        driven = ego.speed * t
        one = np.ones_like(t)
        trajectory = Trajectory(
            t,
            ego.x + driven * math.cos(ego.heading),
            ego.y + driven * math.sin(ego.heading),
            ego.heading * one,
            0.0 * one,
            ego.speed * one,
            0.0 * one,
            place.s + place.s_dot * t,
            place.l + place.l_dot * t,
        )
        return PlanResult(PlanStatus.OK, trajectory, memory)


def no_op(settings: SumoDriverSettings | None = None) -> NoOpPlanner:
    """Make the planner of a `SumoDriverWorld`, where the settings act."""
    del settings
    return NoOpPlanner()
