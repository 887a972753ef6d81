"""Whether the ego of a run came to its goal, wherever its body was on the way."""

from experiments.comparison.results import REASON, Row
from experiments.cosim.records import EpisodeStatus
from experiments.metrics import columns


def came_to_goal(row: Row) -> bool:
    """Tell whether a run arrived, or would have but for the road's edge.

    SUMO's own driver cuts corners: its runs end as `off_road` at the goal.
    """
    if row[columns.ARRIVED]:
        return True
    off_road = str(row[columns.STATUS]) == EpisodeStatus.OFF_ROAD
    return off_road and str(row[REASON]).startswith(EpisodeStatus.ARRIVED)
