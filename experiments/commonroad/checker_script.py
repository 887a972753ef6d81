"""Runs the official checks; started by the Python of an environment of their own.

Nothing of rearview can be imported here. Called with the files of scenario and
solution; prints one line of JSON: check -> "" or what is wrong, and the cost.
"""

import json
import sys
import warnings
from collections.abc import Callable
from typing import Any


def main(scenario_file: str, solution_file: str) -> dict[str, Any]:
    """Run all checks, each by itself."""
    from commonroad.common.file_reader import CommonRoadFileReader
    from commonroad.common.solution import CommonRoadSolutionReader
    from commonroad_dc.costs.evaluation import CostFunctionEvaluator
    from commonroad_dc.feasibility import solution_checker

    scenario, problems = CommonRoadFileReader(scenario_file).open()
    solution = CommonRoadSolutionReader.open(solution_file)

    def feasible() -> bool:
        results = solution_checker.solution_feasible(solution, scenario.dt, problems)
        for name, (holds, inputs, _) in results.items():
            if not holds:
                step = inputs.state_list[-1].time_step
                raise ValueError(f"problem {name}: not feasible from step {step} on")
        return True

    checks: dict[str, Callable[[], Any]] = {
        "all problems": lambda: solution_checker.solved_all_problems(
            problems, solution
        ),
        "goal": lambda: solution_checker.goal_reached(scenario, problems, solution),
        "start": lambda: solution_checker.starts_at_correct_state(solution, problems),
        "obstacles": lambda: (
            not solution_checker.obstacle_collision(scenario, problems, solution)
        ),
        "road": lambda: (
            not solution_checker.boundary_collision(scenario, problems, solution)
        ),
        "feasible": feasible,
    }
    found: dict[str, str] = {}
    for name, check in checks.items():
        try:
            found[name] = "" if check() else "failed"
        except Exception as error:  # noqa: BLE001 - their checks raise what they find
            words = " ".join(str(error).split())
            found[name] = f"{type(error).__name__}: {words[:200]}"
    cost: float | None = None
    try:
        rating = CostFunctionEvaluator.init_from_solution(solution)
        rated = rating.evaluate_solution(scenario, problems, solution)
        cost = float(rated.total_costs)
    except Exception as error:  # noqa: BLE001 - as above
        found_cost = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        return {"checks": found, "cost": None, "cost_error": found_cost}
    return {"checks": found, "cost": cost}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    sys.stdout.write("\n" + json.dumps(main(*sys.argv[1:3])) + "\n")
