"""A vehicle with a model, actuators and a controller, as the loop's plant."""

import math
from dataclasses import dataclass, field

import numpy as np

from experiments.cosim.plant import PlannerOutputError
from experiments.cosim.plants.controllers import (
    ControllerSettings,
    control_numbers,
    queue_length,
)
from experiments.cosim.plants.following import (
    BEHIND,
    GIVEN,
    GRIP,
    LATERAL,
    LIMITED,
    PUSH,
    PUSH_COMMAND,
    PUSH_DRIVEN,
    REAR_ACCELERATION,
    REAR_CURVATURE,
    REAR_HEADING,
    REAR_SPEED,
    REAR_X,
    REAR_Y,
    STEER,
    STEER_ANGLE,
    STEER_COMMAND,
    TURNED,
    Clock,
    follow,
)
from experiments.cosim.plants.parameters import (
    GRAVITY,
    TESTED_FRICTION,
    Actuators,
    Chassis,
    PlantModel,
    Tyres,
)
from experiments.cosim.plants.single_track import (
    DRIVE,
    FADE_SPEED,
    HEADING,
    N_STATES,
    SLIP,
    SPEED,
    STEERING,
    SUB_STEP,
    YAW_RATE,
    X,
    Y,
    plant_numbers,
)
from experiments.cosim.records import TrackingReport
from planner.numerics.angles import wrapped
from planner.states import CartesianState, FloatArray, Trajectory
from planner.tracking.reference import plan_table

LOST = 5.0  # farther beside or behind its plan the ego does not follow it [m]
SPUN = 0.5 * math.pi  # nor does one that has turned this far from it [rad]


@dataclass(frozen=True, slots=True)
class PlantSettings:
    """Everything that a vehicle's motion depends on."""

    model: PlantModel
    chassis: Chassis
    tyres: Tyres = field(default_factory=Tyres)
    friction: float = TESTED_FRICTION
    understeer: float = 0.0  # gradient [rad s²/m]
    actuators: Actuators = field(default_factory=Actuators)
    controller: ControllerSettings = field(default_factory=ControllerSettings)

    @property
    def wheelbase(self) -> float:
        """Distance of the axles [m]."""
        return self.chassis.front + self.chassis.rear

    @property
    def slip_gradient(self) -> float:
        """Slip angle of the rear axle per lateral acceleration [rad s²/m].

        The controller knows the tyres, not the friction of the road of the day.
        """
        if self.model is PlantModel.KINEMATIC:
            return 0.0
        return 1.0 / (self.tyres.stiffness * GRAVITY)

    @property
    def grip(self) -> float:
        """Acceleration that the road allows in any direction; inf without tyres."""
        dynamic = self.model is PlantModel.DYNAMIC
        return self.friction * GRAVITY if dynamic else math.inf


class TrackedPlant:
    """Follows plans with a controller; carries its motion from step to step.

    Args:
        settings: Of vehicle, actuators and controller.
        step: Of the loop [s].
    """

    def __init__(self, settings: PlantSettings, step: float) -> None:
        self.settings = settings
        actuators, controller = settings.actuators, settings.controller
        self._plant = plant_numbers(
            settings.model,
            settings.chassis,
            settings.tyres,
            actuators,
            settings.friction,
            settings.understeer,
        )
        self._control = control_numbers(
            controller,
            actuators,
            settings.wheelbase,
            settings.understeer,
            settings.slip_gradient,
        )
        self._ticks = max(round(step / controller.period), 1)
        self._period = step / self._ticks
        self._sub_steps = max(math.ceil(self._period / SUB_STEP - 1e-9), 1)
        self._state = np.empty(N_STATES)
        self._queue = np.empty((4, queue_length(controller, actuators)))
        self._time: float | None = None  # None before the first step [s]
        self._table: tuple[Trajectory, FloatArray] | None = None
        self.report: TrackingReport | None = None  # of the last step

    def step(
        self, ego: CartesianState, trajectory: Trajectory, step: float, at: float = 0.0
    ) -> CartesianState:
        """Return the ego's state one `step` [s] after `ego`.

        Args:
            ego: Now; the first one is what the vehicle starts with.
            trajectory: To follow.
            step: Of the loop [s].
            at: Now, on the trajectory [s].

        Raises:
            PlannerOutputError: If the vehicle has lost its plan.
        """
        if self._time is None:
            self._start(ego)
        now = self._time or 0.0
        if self._table is None or self._table[0] is not trajectory:
            self._table = (trajectory, plan_table(trajectory))
        actuators = self.settings.actuators
        numbers = follow(
            self._state,
            self._queue,
            self._table[1],
            Clock(
                now,
                at,
                self._period,
                self._ticks,
                self._sub_steps,
                actuators.steering.dead_time,
                actuators.drive.dead_time,
            ),
            self._plant,
            self._control,
        ).tolist()
        self._time = now + step
        self._check(numbers)
        self.report = TrackingReport(
            numbers[LATERAL],
            numbers[BEHIND],
            numbers[TURNED],
            numbers[STEER_COMMAND],
            numbers[STEER_ANGLE],
            numbers[PUSH_COMMAND],
            numbers[PUSH_DRIVEN],
            numbers[LIMITED],
            numbers[GRIP],
        )
        return CartesianState(
            numbers[REAR_X],
            numbers[REAR_Y],
            wrapped(numbers[REAR_HEADING]),
            numbers[REAR_CURVATURE],
            numbers[REAR_SPEED],
            numbers[REAR_ACCELERATION],
        )

    def _start(self, ego: CartesianState) -> None:
        """Set the vehicle in the motion of `ego`, as if it had long been in it."""
        chassis, state = self.settings.chassis, self._state
        state[:] = 0.0
        state[STEERING] = math.atan(self.settings.wheelbase * ego.curvature)
        state[HEADING], state[DRIVE] = ego.heading, ego.acceleration
        state[SPEED] = max(ego.speed, 0.0)
        state[X], state[Y] = ego.x, ego.y
        if self._plant.dynamic:
            state[X] += chassis.rear * math.cos(ego.heading)
            state[Y] += chassis.rear * math.sin(ego.heading)
            state[YAW_RATE] = ego.curvature * state[SPEED]
            sideways = chassis.rear * ego.curvature
            if ego.speed > FADE_SPEED:
                sideways -= self.settings.slip_gradient * ego.speed**2 * ego.curvature
            state[SLIP] = math.atan(sideways)
            state[SPEED] /= math.cos(state[SLIP])
        self._queue[GIVEN] = -math.inf
        self._queue[STEER] = state[STEERING]
        self._queue[PUSH] = ego.acceleration
        self._queue[3] = 0.0
        self._time = 0.0

    def _check(self, numbers: list[float]) -> None:
        """Raise if the vehicle has lost its plan."""
        kind = self.settings.controller.kind
        if not all(map(math.isfinite, numbers)):
            raise PlannerOutputError(f"controller {kind}: the motion is not finite")
        lateral, behind = numbers[LATERAL], numbers[BEHIND]
        if abs(lateral) > LOST or abs(behind) > LOST:
            side = "left" if lateral > 0.0 else "right"
            raise PlannerOutputError(
                f"controller {kind} has lost its plan: the ego is {abs(lateral):.1f} m "
                f"to the {side} of it and {behind:.1f} m behind"
            )
        if abs(numbers[TURNED]) > SPUN:
            turned = math.degrees(numbers[TURNED])
            raise PlannerOutputError(
                f"controller {kind} has lost its plan: the ego has turned {turned:.0f}"
                " degrees from it"
            )
