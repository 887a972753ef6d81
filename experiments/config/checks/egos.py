"""One ego or many: what only one of the two kinds of scenarios may say."""

from experiments.config.base import mismatch
from experiments.config.ego import Ego
from experiments.config.egos import largest_share
from experiments.config.obstacles import ObstaclesConfig
from experiments.config.sections import ScenarioSections
from experiments.config.self_driven import SELF_DRIVEN, SUMO
from experiments.config.simulation import Simulation
from experiments.config.traffic import Traffic


def check_egos(scenario: ScenarioSections) -> None:
    """Reject both kinds of egos, none, and what is of a single one."""
    if scenario.egos is None:
        if scenario.single_ego is None:
            keys = ", ".join(Ego.model_fields)
            raise mismatch("ego", f"is missing; allowed: a section with {keys}")
        if scenario.measurement is not None:
            raise mismatch("measurement", "is of many egos; allowed with egos")
        return
    if scenario.single_ego is not None:
        raise mismatch("egos", "is beside ego; allowed: one of them")
    if scenario.world != "sumo":
        raise mismatch("egos", "is for world sumo; allowed there: ego")
    if scenario.traffic is None:
        raise mismatch("egos", "needs vehicles; allowed: with a traffic section")
    if isinstance(scenario.traffic, Traffic) and not scenario.traffic.has_flow:
        raise mismatch("egos", "needs vehicles; allowed: with a flow in traffic")
    driver = scenario.planner.name
    if driver in SELF_DRIVEN and driver != SUMO:
        raise mismatch("planner", f"is {driver}; allowed with egos: others, {SUMO}")
    _check_single_keys(scenario)
    _check_measurement(scenario)
    total, of = largest_share(scenario.egos)
    if total > 1.0:
        problem = f"have penetrations of {of} that are {total:g} in sum"
        raise mismatch("egos", f"{problem}; allowed: at most 1")


def _check_measurement(scenario: ScenarioSections) -> None:
    """Reject a measurement that begins when the run has ended."""
    begin = 0.0 if scenario.measurement is None else scenario.measurement.from_s
    duration = scenario.simulation.duration_s
    if begin >= duration:
        problem = f"is {begin:g}; allowed: below simulation.duration_s = "
        raise mismatch("measurement.from_s", f"{problem}{duration:g}")


def _check_single_keys(scenario: ScenarioSections) -> None:
    """Reject keys that are about a single ego."""
    if scenario.conflict is not None:
        raise mismatch("conflict", "is of a single ego; allowed with ego")
    if scenario.obstacles != ObstaclesConfig():
        raise mismatch("obstacles", "are of a single ego; allowed: none")
    if isinstance(scenario.traffic, Traffic):
        for key in ("slow_leader", "ego_lane_veh_per_h"):
            if getattr(scenario.traffic, key):
                problem = "is of a single ego; allowed with ego"
                raise mismatch(f"traffic.{key}", problem)
    if scenario.network is not None and scenario.network.vehicle is not None:
        raise mismatch("network.vehicle", "is of a single ego; allowed with ego")
    if scenario.network is not None and scenario.network.is_drawn:
        problem = "is missing; allowed with egos: network.route, or from and to"
        raise mismatch("network.route", problem)
    for key in ("without_ego", "placebo"):
        if getattr(scenario.simulation, key):
            problem = "is of a single ego; allowed: false"
            raise mismatch(f"simulation.{key}", problem)
    _check_delays_and_errors(scenario)


def _check_delays_and_errors(scenario: ScenarioSections) -> None:
    """Reject what is not done with many egos, rather than to say nothing."""
    usual = Simulation()
    for key in ("planning_period_s", "planning_delay_s"):
        if getattr(scenario.simulation, key) != getattr(usual, key):
            problem = "is of a single ego; allowed: without it"
            raise mismatch(f"simulation.{key}", problem)
    if not isinstance(scenario.traffic, Traffic):
        return
    if scenario.traffic.relaxation_s > 0.0:
        raise mismatch("traffic.relaxation_s", "is of a single ego; allowed: 0")
    drivers = scenario.traffic.drivers
    if drivers is not None and drivers.err:
        problem = "err, which is of a single ego; allowed: distraction: 0 and no "
        problem += "other errors"
        raise mismatch("traffic.drivers", problem)
    if drivers is not None and drivers.cooperation > 0.0:
        raise mismatch("traffic.drivers.cooperation", "is of a single ego; allowed: 0")
