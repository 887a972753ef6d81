"""One step of an environment, and what is told of it."""

from dataclasses import dataclass
from typing import Any

from experiments.cosim.records import Ending, EpisodeStatus, StepRecord

# an outcome of the driving; anything else ends an episode from outside
TERMINAL = frozenset(
    {
        EpisodeStatus.ARRIVED,
        EpisodeStatus.COLLISION,
        EpisodeStatus.OFF_ROAD,
        EpisodeStatus.BLOCKED,
        EpisodeStatus.PLANNER_FAILED,
    }
)


@dataclass(frozen=True, slots=True)
class Transition:
    """One step, as a reward sees it."""

    before: StepRecord
    after: StepRecord  # the same as before if the action could not be driven
    step: float  # [s]
    target_speed: float  # [m/s]
    ending: Ending | None  # of the episode, if it ended


def step_facts(record: StepRecord, ending: Ending | None) -> dict[str, Any]:
    """Return the facts about a step that `info` holds."""
    frenet = record.ego_frenet
    return {
        "status": "running" if ending is None else ending.status.value,
        "reason": "" if ending is None else ending.reason,
        "time_s": record.time,
        "s_m": None if frenet is None else frenet.s,
        "l_m": None if frenet is None else frenet.l,
        "speed_mps": record.ego.speed,
        "clearance_m": record.clearance,
        "is_success": ending is not None and ending.status is EpisodeStatus.ARRIVED,
    }
