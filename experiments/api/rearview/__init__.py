"""rearview from Python: what the command line does, in a few lines.

    import rearview

    run = rearview.Scenario.load("intersection").with_(seed=3).run()
    print(run.status, run.row["min_clearance_m"])

The names listed in `__all__`, their arguments and the names of results columns are
stable: they change only with an entry under Changed in the changelog and a new minor
version; what stands in `planner`, `sumo_nets` and `experiments` may change at any time,
except for the records of `planner.interface`, `planner.scene` and `planner.states` that
a planner of your own uses.
"""

from rearview_command import hidden_package

_problem = hidden_package()
if _problem is not None:
    raise ImportError(_problem)

from experiments.api.catalogue import (  # noqa: E402 - after the check
    networks,
    planners,
    scenarios,
    sweeps,
)
from experiments.api.comparisons import Comparison, compare  # noqa: E402
from experiments.api.runs import Run  # noqa: E402
from experiments.api.scenarios import Scenario  # noqa: E402
from experiments.api.sweeps import SweepResults, sweep  # noqa: E402
from experiments.errors import ConfigError, ExperimentError  # noqa: E402
from planner.errors import PlannerError  # noqa: E402
from sumo_nets.errors import NetworkError  # noqa: E402

__all__ = [
    "Comparison",
    "ConfigError",
    "ExperimentError",
    "NetworkError",
    "PlannerError",
    "Run",
    "Scenario",
    "SweepResults",
    "compare",
    "networks",
    "planners",
    "scenarios",
    "sweep",
    "sweeps",
]
