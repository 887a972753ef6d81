"""Time and speed, and the rules of the road."""

from typing import Final

from experiments.metrics import columns, efficiency, right_of_way
from experiments.metrics.metric import Better, CellKind, Metric

EFFICIENCY: Final = (
    Metric(
        column=columns.TRAVEL_TIME,
        label="travel time",
        compute=lambda e: efficiency.travel_time(e.trace),
        formula="time from entry to arrival; null unless the ego arrived",
        unit="s",
        digits=1,
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.DISTANCE,
        label="distance",
        compute=lambda e: efficiency.distance(e.trace),
        formula="path length of the rear axle, Σ ‖p_(k+1) - p_k‖",
        unit="m",
        digits=1,
        in_terminal=True,
    ),
    Metric(
        column=columns.MEAN_SPEED,
        label="mean speed",
        compute=lambda e: efficiency.mean_speed(e.trace),
        formula="distance over duration",
        unit="m/s",
        digits=1,
        better=Better.HIGHER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.SPEEDING,
        label="speeding",
        compute=lambda e: efficiency.speeding_time(e.trace),
        formula="time in which the speed is more than 0.5 m/s over the limit at the "
        "front bumper; null on a road without limits",
        unit="s",
        digits=1,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.MAX_SPEEDING,
        label="max speeding",
        compute=lambda e: efficiency.max_speeding(e.trace),
        formula="largest (speed - limit at the front bumper), at least 0; null on a "
        "road without limits",
        unit="m/s",
        digits=2,
        better=Better.LOWER,
    ),
)
RULES: Final = (
    Metric(
        column=columns.LINE_VIOLATIONS,
        label="closed lines passed",
        compute=lambda e: right_of_way.line_violations(e.trace),
        formula="stop lines of signals and junctions that the front bumper drove over "
        "while they were closed for the ego",
        of_planner=True,
        unit="",
        digits=0,
        better=Better.LOWER,
        kind=CellKind.WHOLE,
    ),
    Metric(
        column=columns.ENCROACHMENTS,
        label="hindered others",
        compute=lambda e: right_of_way.encroachments(e.trace),
        formula="vehicles with the right of way that brake by 2 m/s² more than their "
        "own turn asks for before a conflict zone, so near that 2 m/s² would not stop "
        "them after 1 s, while the ego is over its line and not out of the zone; null "
        "without a junction",
        unit="",
        digits=0,
        better=Better.LOWER,
        kind=CellKind.WHOLE,
    ),
    Metric(
        column=columns.PEOPLE_HINDERED,
        label="hindered people on foot",
        compute=lambda e: right_of_way.people_hindered(e.trace),
        formula="people on foot with the right of way at a crossing who stand before "
        "the ego's way while the ego is over the crossing, standing there or not, "
        "whoever else they stand for; null without a junction",
        unit="",
        digits=0,
        better=Better.LOWER,
        kind=CellKind.WHOLE,
    ),
    Metric(
        column=columns.GAVE_WAY,
        label="waited at junctions",
        compute=lambda e: right_of_way.gave_way_time(e.trace),
        formula="time for which the ego stood to give way; null without a junction",
        unit="s",
        digits=1,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.JUNCTION_PET,
        label="least time in between at junctions",
        compute=lambda e: right_of_way.post_encroachment_time(e.trace),
        formula="post-encroachment time: least time between one of ego and another "
        "vehicle leaving a conflict zone of a junction and the other entering it, "
        "crossing and merging traffic alone, however long; null if none did",
        unit="s",
        digits=1,
        better=Better.HIGHER,
    ),
)
