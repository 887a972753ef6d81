"""The section `simulation`: time, and when to give up."""

from typing import Annotated, Literal

from pydantic import Field

from experiments.config.base import Strict


class Simulation(Strict):
    """Time, and when to give up."""

    step_s: Annotated[float, Field(ge=0.01, le=1.0)] = 0.1
    warmup_s: Annotated[float, Field(ge=0.0, le=3600.0)] = Field(
        default=60.0, description="duration of traffic before the ego enters"
    )
    duration_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=90.0,
        description="default: 90; for a route whose end is the goal by default, its "
        "length at 2.5 m/s, from 90 to 3600",
    )
    horizon_s: Annotated[float, Field(gt=0.0, le=20.0)] = Field(
        default=5.0, description="prediction horizon of vehicles"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    blocked_after_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=20.0,
        description="the episode ends after standing this long without a way on",
    )
    predictor: Literal["constant_speed", "held_braking", "recorded"] = Field(
        default="constant_speed",
        description="constant_speed: vehicles keep their speed; held_braking: braking "
        "vehicles are predicted to brake to a stop; recorded: in world commonroad, the "
        "file's own future",
    )
    ghost: bool = Field(
        default=True,
        description="world sumo: followers see an ego that reaches over a lane line",
    )
    lane_change_guard: bool = Field(
        default=True,
        description="world sumo: vehicles abreast of the ego begin no lane change",
    )
    planning_period_s: Annotated[float, Field(gt=0.0, le=5.0)] | None = Field(
        default=None,
        description="time between planning cycles, a multiple of step_s; default: "
        "step_s",
    )
    planning_delay_s: (
        Annotated[float, Field(ge=0.0, le=5.0)] | Literal["measured"] | None
    ) = Field(
        default=None,
        description="time after which a plan takes effect, a multiple of step_s; "
        "measured: the time that planning took, so that runs differ; default: 0",
    )
    without_ego: bool = Field(
        default=False,
        description="world sumo: also drive the same seed without the ego, to measure "
        "its cost to the vehicles behind",
    )
    placebo: bool = Field(
        default=False,
        description="with without_ego: run that twice more, each with other random "
        "numbers of SUMO from the ego's entry on, to see what is chance",
    )
    repetition: Annotated[int, Field(ge=0, le=1_000_000)] = Field(
        default=0,
        description="world sumo: the same demand and obstacles with other random "
        "numbers of SUMO; 0: those of the seed",
    )
