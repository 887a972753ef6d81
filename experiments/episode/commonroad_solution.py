"""From recorded runs to a solution of their CommonRoad scenario."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from experiments.commonroad.read import read_commonroad
from experiments.commonroad.records import CommonRoadScenario
from experiments.commonroad.solution import (
    CostFunction,
    DrivenTrajectory,
    SolutionModel,
    solution_text,
)
from experiments.commonroad.vehicles import vehicle_of
from experiments.config import Scenario
from experiments.config.scenario_file import CONFIG_FILE, load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.errors import ConfigError
from experiments.storage.atomic_folder import require_there
from experiments.trace.files import read_trace
from experiments.trace.schema import Table, Trace
from planner.states import FloatArray

MODELS = {"kinematic": SolutionModel.KS, "dynamic": SolutionModel.ST}
ROLLING = 1.0  # below it wheels roll without slip [m/s]
TO_S = 1e-3  # from milliseconds


@dataclass(frozen=True, slots=True)
class SolvedRun:
    """A run that solves a planning problem."""

    folder: Path
    scenario: Scenario
    trace: Trace
    file: CommonRoadScenario


def read_solved_run(folder: Path) -> SolvedRun:
    """Read a run folder.

    Raises:
        ConfigError: If the run is of another world, or did not arrive.
        ResultsError: If the folder is damaged.
    """
    require_there(folder)
    config = str(folder / CONFIG_FILE)
    trace = read_trace(folder)
    module = str(trace.fact("planner")).partition(":")[0]
    scenario = load_scenario(config, allow_planners=(module,))
    if scenario.world != "commonroad" or scenario.network is None:
        raise ConfigError(
            f"{folder}: world is {scenario.world}; allowed: a run of world commonroad"
        )
    status = str(trace.fact("status"))
    if status != EpisodeStatus.ARRIVED:
        problem = f"status is {status}, which solves nothing; allowed: arrived"
        raise ConfigError(f"{folder}: {problem}")
    file = read_commonroad(Path(scenario.network.file or ""))
    return SolvedRun(folder, scenario, trace, file)


def solution_of(
    runs: Sequence[SolvedRun], cost: CostFunction
) -> tuple[str, tuple[int, ...]]:
    """Write the solution of one scenario.

    Args:
        runs: One for each of its planning problems.
        cost: That it is to be rated by.

    Returns:
        The text, and the planning problems that are not solved by any of the runs.

    Raises:
        ConfigError: If the runs are of several scenarios, of one problem twice, or of
            a plant or vehicle that has no published model.
    """
    first = runs[0]
    driven: dict[int, DrivenTrajectory] = {}
    computing = 0.0
    for run in runs:
        if run.file.benchmark_id != first.file.benchmark_id:
            problem = f"is of {run.file.benchmark_id}, not {first.file.benchmark_id}"
            raise ConfigError(f"{run.folder}: {problem}; allowed: one scenario")
        one = _driven(run)
        if one.problem in driven:
            problem = f"solves planning problem {one.problem} like another run"
            raise ConfigError(f"{run.folder}: {problem}; allowed: one run for each")
        driven[one.problem] = one
        computing += float(np.ma.sum(run.trace.timing["planning_cpu_ms"])) * TO_S
    name = f"{first.file.benchmark_id}:{first.file.version}"
    text = solution_text(name, list(driven.values()), cost, computing)
    missing = tuple(p.id for p in first.file.problems if p.id not in driven)
    return text, missing


def _driven(run: SolvedRun) -> DrivenTrajectory:
    """Return the states of a run in the model of its plant."""
    plant, network = run.scenario.ego.plant, run.scenario.network
    if plant is None:
        words = "ego.plant: is perfect, a motion that no vehicle model has"
        raise ConfigError(f"{run.folder}: {words}; allowed: kinematic, dynamic")
    body = run.scenario.ego.vehicle
    try:
        vehicle = vehicle_of(
            body.length_m, body.width_m, body.wheelbase_m, body.rear_overhang_m
        )
    except ConfigError as error:
        raise ConfigError(f"{run.folder}: {error}") from error
    problem = run.file.problem(None if network is None else network.planning_problem)
    model = MODELS[plant.model]
    return DrivenTrajectory(
        problem.id,
        model,
        vehicle,
        problem.start.step,
        _states(run, model, vehicle.rear, vehicle.wheelbase),
    )


def _states(
    run: SolvedRun, model: SolutionModel, rear: float, wheelbase: float
) -> FloatArray:
    """Return the rows of the states; the reference point is the body's middle.

    Args:
        run: Recorded.
        model: Of the states.
        rear: From the middle to the rear axle [m].
        wheelbase: [m].
    """
    steps, tracking = run.trace.steps, run.trace.tracking
    heading, speed = (_numbers(steps, n) for n in ("heading_rad", "speed_mps"))
    x = _numbers(steps, "x_m") + rear * np.cos(heading)
    y = _numbers(steps, "y_m") + rear * np.sin(heading)
    curvature = _numbers(steps, "curvature_1pm")
    steering = np.arctan(wheelbase * curvature)
    steering[_numbers(tracking, "index").astype(int)] = _numbers(
        tracking, "steering_rad"
    )
    if model is SolutionModel.KS:
        return np.column_stack([x, y, steering, speed, heading])
    slip = _slip(_numbers(steps, "time_s"), x, y, heading)
    rolling = np.arctan(rear / wheelbase * np.tan(steering))
    slip = np.where(speed > ROLLING, slip, rolling)
    along = speed / np.cos(slip)
    yaw_rate = curvature * speed
    return np.column_stack([x, y, steering, along, heading, yaw_rate, slip])


def _slip(
    time: FloatArray, x: FloatArray, y: FloatArray, heading: FloatArray
) -> FloatArray:
    """Return the angle between motion and heading of the middle, (n,) [rad]."""
    if time.size < 4:  # noqa: PLR2004 - a cubic needs four
        return np.zeros(time.size)
    course = np.arctan2(CubicSpline(time, y)(time, 1), CubicSpline(time, x)(time, 1))
    return np.asarray(np.arctan2(np.sin(course - heading), np.cos(course - heading)))


def _numbers(table: Table, name: str) -> FloatArray:
    """Return a column of numbers; null is NaN."""
    return np.ma.filled(np.ma.asarray(table[name], dtype=np.float64), np.nan)
