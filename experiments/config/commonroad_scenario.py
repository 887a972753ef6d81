"""The scenario of a CommonRoad file: what its keys are where none are written."""

from copy import deepcopy
from pathlib import Path
from typing import Any

from experiments.commonroad.read import read_commonroad
from experiments.commonroad.records import CommonRoadScenario, PlanningProblem
from experiments.commonroad.vehicles import DEFAULT
from experiments.config.sections import scenario_name
from experiments.config.yaml_reader import Document

WORLD = "commonroad"
ENDING = ".xml"
OTHERS = (".net.xml", ".osm", ".xodr")  # that are read as maps
PREFERRED = 50.0 / 3.6  # speed of an ego that begins slowly [m/s]
SLOW = 8.0  # an ego that begins faster than this keeps its speed [m/s]
CONTROL_PERIOD = 0.05  # about, and a whole part of the file's step [s]
SHARPEST = 0.25  # curvature that is planned with; the vehicle can steer more [1/m]
# More than comfort asks for: who was recorded does not wait. The vehicle has 11.5 m/s².
LIMITS = {
    "max_acceleration_mps2": 4.0,
    "max_deceleration_mps2": 6.0,
    "emergency_deceleration_mps2": 9.0,
    "max_lateral_acceleration_mps2": 6.0,
}
# A goal lies in a lane, and the ego has to come back to it from beside a vehicle: what
# keeps `cruise` in the lane that it is in must not hold it there.
PLANNER: dict[str, Any] = {"name": "cruise", "settings": {"weights": {"lane": 0.1}}}
DIGITS = 6  # of a speed


def is_commonroad_file(name: str) -> bool:
    """Tell whether a name may be that of a CommonRoad scenario."""
    return name.endswith(ENDING) and not name.endswith(OTHERS)


def commonroad_document(name: str) -> Document:
    """Make the scenario of a file; `complete` adds what it says.

    Raises:
        ConfigError: If the file cannot be read.
    """
    path = Path(name).resolve()
    read_commonroad(Path(name))  # an error names the file as it was given
    return Document(name, {"world": WORLD, "network": {"file": str(path)}})


def complete(document: Document) -> None:
    """Write what a CommonRoad file says where a scenario is silent.

    Raises:
        ConfigError: If the file cannot be read.
    """
    data = document.data
    if not isinstance(data, dict) or data.get("world") != WORLD:
        return
    network = data.get("network")
    file = network.get("file") if isinstance(network, dict) else None
    if not isinstance(file, str):
        return
    found = read_commonroad(Path(file))
    wanted = network.get("planning_problem") if isinstance(network, dict) else None
    try:
        problem = found.problem(wanted if isinstance(wanted, int) else None)
    except KeyError:
        problem = found.problems[0]  # the layout says which there are
    data.setdefault("name", _name(found))
    data.setdefault("planner", deepcopy(PLANNER))
    for section, defaults in (
        ("simulation", _simulation(found, problem, data.get("ego"))),
        ("ego", _ego(found, problem)),
    ):
        own = data.get(section)
        if own is None:
            own = data[section] = {}
        if isinstance(own, dict):
            for key, value in defaults.items():
                own.setdefault(key, value)
    _fit_plant(data["ego"])


def _fit_plant(ego: Any) -> None:
    """Write or leave out what depends on the plant."""
    if not isinstance(ego, dict):
        return
    if ego["plant"] == "perfect":
        ego.pop("controller", None)
    elif _is_kinematic(ego["plant"]):
        ego.setdefault("tube", "none")  # it follows its plan to a centimetre or two


def _is_kinematic(plant: Any) -> bool:
    """Tell whether a plant is the kinematic one, in either form."""
    return (plant.get("model") if isinstance(plant, dict) else plant) == "kinematic"


def _name(found: CommonRoadScenario) -> str:
    """Make a scenario's name of a benchmark's id."""
    return scenario_name(found.benchmark_id or found.file.stem)


def _simulation(
    found: CommonRoadScenario, problem: PlanningProblem, ego: Any
) -> dict[str, Any]:
    """Return the section of the simulation."""
    last = problem.last_step - problem.start.step
    perceives = isinstance(ego, dict) and ego.get("perception") is not None
    duration = round(last * found.step, DIGITS)
    return {
        "step_s": found.step,
        "duration_s": duration,
        # recorded traffic stands as long as it stood; the time of the goal ends a wait
        "blocked_after_s": duration,
        "predictor": "constant_speed" if perceives else "recorded",
    }


def _ego(found: CommonRoadScenario, problem: PlanningProblem) -> dict[str, Any]:
    """Return the section of the ego."""
    speed = problem.start.speed
    wanted = speed if speed >= SLOW else PREFERRED
    parts = max(round(found.step / CONTROL_PERIOD), 1)
    return {
        "target_speed_mps": round(min(wanted, DEFAULT.max_speed), DIGITS),
        "vehicle": {
            "length_m": DEFAULT.length,
            "width_m": DEFAULT.width,
            "wheelbase_m": DEFAULT.wheelbase,
            "rear_overhang_m": DEFAULT.rear_overhang,
            "limits": {
                "max_speed_mps": DEFAULT.max_speed,
                "max_curvature_1pm": SHARPEST,
                **LIMITS,
            },
        },
        "plant": "kinematic",
        "controller": {"name": "lqr", "period_s": found.step / parts},
    }
