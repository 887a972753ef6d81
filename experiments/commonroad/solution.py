"""Writes solutions: what a vehicle drove, as states of a published vehicle model."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from typing import Final
from xml.etree import ElementTree as ET

from experiments.commonroad.vehicles import SolutionVehicle
from planner.states import FloatArray

DIGITS: Final = 9  # of a state: the official checker allows 2 cm


class CostFunction(StrEnum):
    """What a solution is rated by; the official evaluation knows their weights."""

    JB1 = "JB1"
    SA1 = "SA1"
    WX1 = "WX1"
    SM1 = "SM1"
    SM2 = "SM2"
    SM3 = "SM3"
    MW1 = "MW1"
    TR1 = "TR1"


class SolutionModel(StrEnum):
    """A vehicle model: kinematic or dynamic single track."""

    KS = "KS"
    ST = "ST"


FIELDS: Final = {  # elements of a state in their order, behind x and y
    SolutionModel.KS: ("steeringAngle", "velocity", "orientation"),
    SolutionModel.ST: (
        "steeringAngle",
        "velocity",
        "orientation",
        "yawRate",
        "slipAngle",
    ),
}


@dataclass(frozen=True, slots=True, eq=False)
class DrivenTrajectory:
    """What solves one planning problem; `states` is (n, 2 + fields of the model)."""

    problem: int
    model: SolutionModel
    vehicle: SolutionVehicle
    first: int  # step of the first state
    states: FloatArray  # x, y of the body's middle, then `FIELDS`

    @property
    def vehicle_id(self) -> str:
        """Model and number of the vehicle."""
        return f"{self.model}{self.vehicle.number}"


def benchmark_id(
    scenario: str, driven: Sequence[DrivenTrajectory], cost: CostFunction
) -> str:
    """Return the id of a solution: vehicles, costs, scenario, version."""
    vehicles = [one.vehicle_id for one in driven]
    costs = [str(cost)] * len(driven)
    if len(driven) == 1:
        return f"{vehicles[0]}:{costs[0]}:{scenario}"
    return f"[{','.join(vehicles)}]:[{','.join(costs)}]:{scenario}"


def solution_text(
    scenario: str,
    driven: Sequence[DrivenTrajectory],
    cost: CostFunction,
    computation_time: float,
) -> str:
    """Write a solution.

    Args:
        scenario: Id of the benchmark and version of the format, with a colon between.
        driven: One trajectory for each planning problem.
        cost: That it is to be rated by.
        computation_time: Of planning [s].

    Returns:
        The content of the file.
    """
    root = ET.Element(
        "CommonRoadSolution",
        benchmark_id=benchmark_id(scenario, driven, cost),
        computation_time=f"{computation_time:.6f}",
        date=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S"),
    )
    for one in driven:
        kind = one.model.lower()
        node = ET.SubElement(
            root, f"{kind}Trajectory", planningProblem=str(one.problem)
        )
        names = ("x", "y", *FIELDS[one.model])
        for k, row in enumerate(one.states.tolist()):
            state = ET.SubElement(node, f"{kind}State")
            for name, value in zip(names, row, strict=True):
                ET.SubElement(state, name).text = f"{value:.{DIGITS}f}"
            ET.SubElement(state, "time").text = str(one.first + k)
    ET.indent(root, " ")
    text = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"
