"""What documents count of runs: who came to the goal, and what went wrong."""

from experiments.comparison.results import REASON, Row
from experiments.cosim.records import EpisodeStatus
from experiments.metrics import columns

# in words, and the column that is above 0 in a run that counts
COUNTED = (
    ("collided", columns.COLLISIONS),
    ("off the road", columns.OFF_ROAD_STEPS),
    ("line violations", columns.LINE_VIOLATIONS),
    ("encroachments", columns.ENCROACHMENTS),
)


def came_to_goal(row: Row) -> bool:
    """Tell whether a run arrived, or would have but for the road's edge.

    SUMO's own driver cuts corners: its runs end as `off_road` at the goal.
    """
    if row[columns.ARRIVED]:
        return True
    off_road = str(row[columns.STATUS]) == EpisodeStatus.OFF_ROAD
    return off_road and str(row[REASON]).startswith(EpisodeStatus.ARRIVED)
