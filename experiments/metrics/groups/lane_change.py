"""Changes of lane."""

from typing import Final

from experiments.metrics import columns, lane_change
from experiments.metrics.metric import Better, CellKind, Metric

LANE_CHANGE: Final = (
    Metric(
        column=columns.LANE_CHANGE_TIME,
        label="lane-change duration",
        compute=lambda e: lane_change.lane_change_time(e.trace),
        formula="duration of the first lane change: from the last step within 0.1 m of "
        "the initial offset to the first after which the offset, at least 2.5 m away, "
        "stays within 0.1 m for 2 s; null without one",
        unit="s",
        digits=1,
        of_planner=True,
    ),
    Metric(
        column=columns.LANE_CHANGE_DONE,
        label="lane change completed",
        compute=lambda e: lane_change.lane_change_done(e.trace),
        formula="time from entry to the end of that lane change; null without one",
        unit="s",
        digits=1,
        of_planner=True,
    ),
    Metric(
        column=columns.BEFORE_BLOCKAGE,
        label="changed before blockage",
        kind=CellKind.FLAG,
        compute=lambda e: lane_change.changed_before_blockage(e.trace),
        formula="whether the point of the ego's body nearest to the blockage was "
        "beside it when the front reached it; the blockage is the first obstacle "
        "ahead that covers the ego's full width at its initial offset; false if the "
        "ego never reached it; null without a blockage",
        better=Better.HIGHER,
    ),
)
