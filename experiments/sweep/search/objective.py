"""How bad a trial went: its robustness, below 0 a failure, and the kind of it."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from experiments.config.search import CLEARANCE, NEAR_MISS, SearchObjective
from experiments.config.validation_errors import unknown_name
from experiments.config.yaml_reader import Document
from experiments.cosim.records import EpisodeStatus
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.metric import CellKind
from experiments.metrics.verdict.records import Fault
from experiments.sweep.task import Failure

BLAMELESS = 1.0  # of `near_miss` where others are to blame: as far as can be
LEAST = 1e-9  # below zero, of a failure that the objective does not see
BROKEN = frozenset(  # endings that are a failure, whatever the objective
    (
        EpisodeStatus.COLLISION,
        EpisodeStatus.OFF_ROAD,
        EpisodeStatus.PLANNER_FAILED,
        EpisodeStatus.CRASHED,
    )
)
IMPOSSIBLE = frozenset((Failure.INVALID, Failure.ERROR, Failure.LOST_WORKER))
BEYOND = "beyond the threshold"
USUAL_CLEARANCE = 1.0  # at which a margin of `near_miss` is one half [m]
USUAL_TIME = 2.0  # the same [s]
USUAL_BRAKING = 4.0  # the same [m/s²]
MEAN_SHARE = 0.2  # of the mean of all margins beside the least one
_NUMBER = re.compile(r"[\d_.#:-]+")


@dataclass(frozen=True, slots=True)
class TrialJudgement:
    """What a run says about its point.

    `robustness` is None where the run has no value; `kind` is empty unless it failed.
    """

    robustness: float | None
    kind: str = ""

    @property
    def failed(self) -> bool:
        """Whether the planner failed."""
        return bool(self.kind)

    @property
    def limit_state(self) -> float:
        """The robustness below 0 exactly if it failed; infinite if it says nothing."""
        if self.failed:
            return min(self.robustness or 0.0, -LEAST)
        return math.inf if self.robustness is None else max(self.robustness, 0.0)


def judge(
    objective: SearchObjective, row: Mapping[str, Any], failure: str | None = None
) -> TrialJudgement:
    """Judge a run by its row of the results.

    Args:
        objective: What is made small.
        row: Of the results.
        failure: Why the run has no complete episode, if it has none.

    Returns:
        The judgement. A run that could not be made at all (its configuration, its
        machine) is no failure of the planner, and has no value.
    """
    if failure in IMPOSSIBLE:
        return TrialJudgement(None)
    blamed = row[columns.VERDICT] in (Fault.EGO, Fault.SHARED)
    if objective.blame == "ego" and row[columns.COLLISIONS] and not blamed:
        return TrialJudgement(BLAMELESS)
    value = robustness(objective, row)
    return TrialJudgement(value, _kind(row, value, objective))


def robustness(objective: SearchObjective, row: Mapping[str, Any]) -> float | None:
    """Return the value that is made small; None where the row has none.

    Clearance and near misses go on below zero as the impact speed [m/s] after a
    contact, so that a search can tell a graze from a crash: clearance - margin, or
    -(margin + speed).
    """
    if objective.metric in (CLEARANCE, NEAR_MISS) and row[columns.COLLISIONS]:
        return -objective.margin_m - float(row[columns.IMPACT_SPEED] or 0.0)
    if objective.metric == NEAR_MISS:
        return near_miss(row)
    if objective.metric == CLEARANCE:
        value = row[columns.MIN_CLEARANCE]
        return None if value is None else float(value) - objective.margin_m
    value = row[objective.metric]
    if value is None:
        return None
    beyond = objective.fails_beyond or 0.0
    sign = 1.0 if objective.direction == "minimise" else -1.0
    return sign * (float(value) - beyond)


def near_miss(row: Mapping[str, Any]) -> float | None:
    """Return how far a run without a contact was from one, from 0 to 1.

    Four margins, each 0 at a contact and 1 far from it: least clearance c / (c + 1 m),
    least time to collision with a vehicle and with an obstacle t / (t + 2 s), largest
    required deceleration 4 m/s² / (4 m/s² + d). The least of them counts, and a little
    of their mean: where the closest call stays as it is, the others still slope.
    None where the row has none of them.
    """
    clearance, braking = row[columns.MIN_CLEARANCE], row[columns.MAX_DRAC]
    times = [row[columns.MIN_TTC], row[columns.MIN_STATIC_TTC]]
    if clearance is None and braking is None and times == [None, None]:
        return None
    margins = [
        *(1.0 if time is None else time / (time + USUAL_TIME) for time in times),
        1.0 if clearance is None else clearance / (clearance + USUAL_CLEARANCE),
        USUAL_BRAKING / (USUAL_BRAKING + (braking or 0.0)),
    ]
    mean = sum(margins) / len(margins)
    return (min(margins) + MEAN_SHARE * mean) / (1.0 + MEAN_SHARE)


def check_objective(objective: SearchObjective, document: Document) -> None:
    """Reject a metric without numbers, or without a direction; raises ConfigError."""
    name = objective.metric
    allowed = [CLEARANCE, NEAR_MISS, *_numeric()]
    if name not in allowed:
        where = document.where(("objective",))
        hint = unknown_name(name, allowed)
        raise ConfigError(f"{where}: objective: {name}: no such metric; {hint}")
    if name not in (CLEARANCE, NEAR_MISS) and objective.direction is None:
        problem = "objective.direction: is missing; allowed: minimise, maximise"
        raise ConfigError(f"{document.where(('objective',))}: {problem}")


def _numeric() -> list[str]:
    """List the columns that hold numbers of the episode."""
    return [
        name
        for name, metric in METRICS.items()
        if metric.kind in (CellKind.NUMBER, CellKind.WHOLE)
        and not metric.identity
        and not metric.timing
    ]


def _kind(
    row: Mapping[str, Any], value: float | None, objective: SearchObjective
) -> str:
    """Name the kind of a failure: how it ended, and what was touched."""
    status = str(row[columns.STATUS])
    touched = row[columns.FIRST_COLLISION_WITH]
    if row[columns.COLLISIONS]:
        body = _NUMBER.sub(" ", str(touched)).strip() or "a body"
        verdict = row[columns.VERDICT]
        return f"contact with {body}" + (f", {verdict}" if verdict else "")
    if status in BROKEN:
        return status.replace("_", " ")
    if objective.has_threshold and value is not None and value < 0.0:
        return "too close" if objective.metric == CLEARANCE else BEYOND
    return ""
