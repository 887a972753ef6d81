"""Periods and delays: multiples of the step, and shorter than the horizon."""

from experiments.config.base import mismatch
from experiments.config.sections import ScenarioSections
from experiments.config.vehicle_model import (
    ControllerConfig,
    check_delays,
    is_multiple,
)


def check_timing(scenario: ScenarioSections) -> None:
    """Reject periods and delays that are no multiples, or end too late."""
    simulation, ego = scenario.simulation, scenario.single_ego
    for key in ("planning_period_s", "planning_delay_s"):
        value, step = getattr(simulation, key), simulation.step_s
        if isinstance(value, float) and not is_multiple(value, step):
            problem = f"is {value:g}; allowed: a multiple of step_s = {step:g}"
            raise mismatch(f"simulation.{key}", problem)
    period = simulation.planning_period_s
    if period is not None and period >= simulation.horizon_s:
        problem = f"is {period:g}; allowed: less than the horizon"
        raise mismatch("simulation.planning_period_s", problem)
    delay = simulation.planning_delay_s
    if isinstance(delay, float) and delay >= simulation.horizon_s:
        problem = f"is {delay:g}; allowed: less than the horizon"
        raise mismatch("simulation.planning_delay_s", problem)
    if ego is not None and ego.plant is not None:
        controller = ego.controller or ControllerConfig()
        check_delays(ego.actuators, controller, simulation.step_s, simulation.horizon_s)
