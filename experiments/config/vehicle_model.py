"""How the ego follows its plan: vehicle model, actuators, controller, planner start."""

from typing import Annotated, Any, Literal

from pydantic import Field

from experiments.config.base import Strict, mismatch

MOST_COMMANDS = 60  # of a controller that may be on their way at a time
TOLERANCE = 1e-9  # [s]
Delay = Annotated[float, Field(ge=0.0, le=10.0)]
Gain = Annotated[float, Field(gt=0.0, le=1000.0)]


def unless_perfect(key: str) -> Any:
    """Build a reader that lets a bare name stand for `{key: name}`, perfect for none.

    What is perfect is left out, so that it has one form only.
    """

    def read(value: Any) -> Any:
        if value == "perfect" or (
            isinstance(value, dict) and value == {key: "perfect"}
        ):
            return None
        return {key: value} if isinstance(value, str) else value

    return read


class PlantConfig(Strict):
    """A vehicle with a model of its motion.

    Its wheelbase is that of `ego.vehicle`.
    """

    model: Literal["kinematic", "dynamic"] = Field(
        description="kinematic: single track about the rear axle; dynamic: with mass "
        "and tyres, about the centre of gravity"
    )
    parameters: Literal["car", "van", "lorry"] = "car"
    tyres: Literal["linear", "pacejka"] = Field(
        default="linear", description="pacejka: their force has a limit"
    )
    friction: Annotated[float, Field(ge=0.05, le=2.0)] = Field(
        default=1.0489, description="of the road: 0.15 is ice; model dynamic"
    )
    understeer_gradient: Annotated[float, Field(ge=0.0, le=0.02)] = Field(
        default=0.0, description="K of steering = (L + K v²) κ, in rad s²/m"
    )


class ActuatorsConfig(Strict):
    """Delays and limits of steering and drive; a number overrides the preset's."""

    preset: Literal["ideal", "nuplan", "autoware"] = "ideal"
    steering_dead_time_s: Delay | None = None
    steering_lag_s: Delay | None = None
    steering_rate_radps: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    max_steering_rad: Annotated[float, Field(gt=0.0, le=1.5)] | None = None
    drive_dead_time_s: Delay | None = None
    drive_lag_s: Delay | None = None
    drive_rate_mps3: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    max_drive_mps2: Annotated[float, Field(gt=0.0, le=30.0)] | None = None


class ControllerConfig(Strict):
    """What steers and drives along the plan."""

    name: Literal["lqr", "pure_pursuit", "stanley"] = "lqr"
    period_s: Annotated[float, Field(ge=0.005, le=1.0)] = Field(
        default=0.05, description="simulation.step_s is a multiple of it"
    )
    delay_aware: bool = Field(
        default=True, description="lqr knows dead time and lag of the steering"
    )
    lateral_weight: Gain = 1.0
    heading_weight: Gain = 2.0
    steering_weight: Gain = 8.0
    pursuit_time_s: Annotated[float, Field(gt=0.0, le=10.0)] = 0.8
    stanley_gain: Gain = 1.5
    position_gain: Gain = 0.6
    speed_gain: Gain = 1.5


class PlanStartConfig(Strict):
    """Where a plan begins when the ego is not where its last plan says."""

    rule: Literal["stitched", "measured"] = Field(
        default="stitched",
        description="stitched: on the last plan, unless the ego is farther from it "
        "than the next two keys; measured: always where the ego is",
    )
    lateral_m: Annotated[float, Field(gt=0.0, le=5.0)] = 0.5
    longitudinal_m: Annotated[float, Field(gt=0.0, le=5.0)] = 2.5


def is_multiple(value: float, step: float) -> bool:
    """Check whether a time is a whole number of steps."""
    return abs(round(value / step) * step - value) < TOLERANCE


def check_delays(
    actuators: ActuatorsConfig | None,
    controller: ControllerConfig,
    step: float,
    horizon: float,
) -> None:
    """Raise unless periods divide, and delays end within the horizon.

    Args:
        actuators: None for ideal ones.
        controller: Of the ego.
        step: Of the simulation [s].
        horizon: Of the predictions [s].
    """
    period = controller.period_s
    if period > step + TOLERANCE or not is_multiple(step, period):
        raise mismatch(
            "ego.controller.period_s",
            f"is {period:g}; allowed: simulation.step_s = {step:g} or a whole part of "
            "it",
        )
    longest = min(horizon, MOST_COMMANDS * period)
    for key in ("steering_dead_time_s", "drive_dead_time_s"):
        dead_time = getattr(actuators, key, None)
        if dead_time is not None and dead_time >= longest:
            raise mismatch(
                f"ego.actuators.{key}",
                f"is {dead_time:g}; allowed: less than {longest:g}, the horizon or "
                f"{MOST_COMMANDS} periods of the controller",
            )
