"""From the ego's section of a scenario to its plant, timing, tube and perception."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.config import Scenario
from experiments.config.perception import PerceptionConfig
from experiments.config.self_driven import SELF_DRIVEN
from experiments.config.vehicle_model import (
    ActuatorsConfig,
    ControllerConfig,
    PlanStartConfig,
    PlantConfig,
)
from experiments.cosim.execution import PlanTiming, StartRule
from experiments.cosim.perception.perceive import Perception
from experiments.cosim.perception.settings import PERCEPTION, PerceptionSettings
from experiments.cosim.plant import PerfectTracking, Plant
from experiments.cosim.plants.controllers import ControllerKind, ControllerSettings
from experiments.cosim.plants.parameters import (
    ACTUATORS,
    CHASSIS,
    Actuators,
    PlantModel,
    Tyres,
)
from experiments.cosim.plants.tracked import PlantSettings, TrackedPlant
from experiments.cosim.plants.tube import (
    NONE,
    ErrorTube,
    measure_tube,
    planned_vehicle,
    read_tube,
)
from experiments.cosim.road import Road
from experiments.errors import ConfigError
from planner.errors import InvalidInputError
from planner.tracking.lqr import LqrWeights
from planner.vehicle import Vehicle


def plant_settings(scenario: Scenario) -> PlantSettings | None:
    """Return the settings of the scenario's plant; None if it is perfect.

    Raises:
        ConfigError: If SUMO's own driver is to drive it.
    """
    ego = scenario.ego
    config = ego.plant
    if config is None:
        return None
    if scenario.planner.name in SELF_DRIVEN:
        problem = (
            f"is not for planner {scenario.planner.name}, which moves the ego itself; "
            "allowed: perfect"
        )
        raise scenario.error(("ego", "plant"), problem)
    return model_settings(
        config, ego.actuators, ego.controller, ego.vehicle.wheelbase_m
    )


def model_settings(
    plant: PlantConfig,
    actuators: ActuatorsConfig | None,
    controller: ControllerConfig | None,
    wheelbase: float,
) -> PlantSettings:
    """Return the settings of a vehicle model.

    Args:
        plant: Mass and tyres.
        actuators: None for ideal ones.
        controller: None for the default one.
        wheelbase: [m].
    """
    control = controller or ControllerConfig()
    return PlantSettings(
        PlantModel(plant.model),
        CHASSIS[plant.parameters].with_wheelbase(wheelbase),
        Tyres(saturate=plant.tyres == "pacejka"),
        plant.friction,
        plant.understeer_gradient,
        _actuators(actuators or ActuatorsConfig()),
        ControllerSettings(
            ControllerKind(control.name),
            control.period_s,
            control.delay_aware,
            LqrWeights(
                control.lateral_weight,
                control.heading_weight,
                control.steering_weight,
            ),
            pursuit_time=control.pursuit_time_s,
            stanley_gain=control.stanley_gain,
            position_gain=control.position_gain,
            speed_gain=control.speed_gain,
        ),
    )


def _given(**numbers: float | None) -> dict[str, Any]:
    """Return the numbers that are not None."""
    return {name: value for name, value in numbers.items() if value is not None}


def _actuators(config: ActuatorsConfig) -> Actuators:
    """Lay numbers over a preset."""
    preset = ACTUATORS[config.preset]
    steering = _given(
        dead_time=config.steering_dead_time_s,
        lag=config.steering_lag_s,
        rate=config.steering_rate_radps,
        largest=config.max_steering_rad,
    )
    drive = _given(
        dead_time=config.drive_dead_time_s,
        lag=config.drive_lag_s,
        rate=config.drive_rate_mps3,
        largest=config.max_drive_mps2,
    )
    return Actuators(
        replace(preset.steering, **steering), replace(preset.drive, **drive)
    )


def make_plant(scenario: Scenario) -> Plant:
    """Make the plant of an episode.

    Raises:
        ConfigError: If it is not possible.
    """
    settings = plant_settings(scenario)
    if settings is None:
        return PerfectTracking()
    try:
        return TrackedPlant(settings, scenario.simulation.step_s)
    except InvalidInputError as error:
        raise scenario.error(("ego", "actuators"), str(error)) from error


def tube_of(scenario: Scenario) -> ErrorTube | None:
    """Return the tube by which plans keep clear; None for none.

    Raises:
        ConfigError: If its file cannot be read or is of another plant.
    """
    settings, tube = plant_settings(scenario), scenario.ego.tube
    if settings is None or tube == "none":
        return None
    if tube is None or tube == "auto":
        return measure_tube(settings)
    try:
        return read_tube(Path(tube), settings)
    except ConfigError as error:
        raise scenario.error(("ego", "tube"), f"{tube} {error}") from error


def planned_body(scenario: Scenario) -> Vehicle | None:
    """Return the vehicle that plans are made with; None if it is the ego's.

    Raises:
        ConfigError: If its tube cannot be read.
    """
    settings = plant_settings(scenario)
    if settings is None:
        return None
    vehicle = scenario.ego.vehicle.to_planner()
    speed = min(scenario.ego.target_speed_mps, vehicle.limits.max_speed)
    tube = tube_of(scenario)
    bounds = NONE if tube is None else tube.upto(speed)
    return planned_vehicle(vehicle, settings, bounds, speed)


def plan_timing(scenario: Scenario) -> PlanTiming:
    """Return when plans are made, take effect, and where they begin."""
    simulation = scenario.simulation
    start = scenario.ego.plan_start or PlanStartConfig()
    delay = simulation.planning_delay_s
    return PlanTiming(
        simulation.planning_period_s,
        None if delay == "measured" else float(delay or 0.0),
        StartRule(start.rule),
        start.lateral_m,
        start.longitudinal_m,
    )


def perception_settings(config: PerceptionConfig) -> PerceptionSettings:
    """Lay numbers over a preset."""
    degrees = config.field_of_view_deg
    numbers = _given(
        reach=config.range_m,
        latency=config.latency_s,
        missed=config.missed,
        position=config.position_noise_m,
        heading=config.heading_noise_rad,
        speed=config.speed_noise_mps,
        size=config.size_noise_m,
        correlation=config.correlation_s,
        field_of_view=None if degrees is None else math.radians(degrees),
        forget_after=config.forget_after_s,
        margin=config.margin,
    )
    preset = PERCEPTION[config.preset]
    return replace(
        preset,
        occlusion=preset.occlusion if config.occlusion is None else config.occlusion,
        buildings=tuple(np.array(corners) for corners in config.buildings),
        **numbers,
    )


def make_perception(scenario: Scenario, road: Road) -> Perception | None:
    """Make the perception of an episode; None if it is perfect."""
    config = scenario.ego.perception
    if config is None:
        return None
    simulation = scenario.simulation
    return Perception(
        perception_settings(config),
        road.obstacles,
        simulation.step_s,
        simulation.seed,
        scenario.ego.vehicle.to_planner().centre_offset,
    )
