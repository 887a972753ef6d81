"""The scenario schema: what a YAML file may say, strictly.

Unknown keys, repeated keys, wrong types and numbers out of range are errors. Every key
with a unit carries it in its name. The JSON Schema that editors read is made from the
same classes.
"""

from experiments.config.conflict import Conflict
from experiments.config.ego import Ego
from experiments.config.obstacles import Obstacle, ObstacleField, RandomObstacles
from experiments.config.planner_choice import DEFAULT_PLANNER, default_planner
from experiments.config.scenario import Scenario
from experiments.config.traffic import SumoTraffic, Traffic

__all__ = [
    "DEFAULT_PLANNER",
    "Conflict",
    "Ego",
    "Obstacle",
    "ObstacleField",
    "RandomObstacles",
    "Scenario",
    "SumoTraffic",
    "Traffic",
    "default_planner",
]
