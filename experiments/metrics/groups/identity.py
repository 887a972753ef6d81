"""Which run it is, and how it ended."""

from typing import Final

from experiments.metrics import columns, efficiency
from experiments.metrics.metric import Better, CellKind, Metric

IDENTITY: Final = (
    Metric(
        column=columns.SCENARIO,
        label="scenario",
        kind=CellKind.TEXT,
        compute=lambda e: str(e.trace.fact("scenario")),
        formula="name of the resolved scenario",
        identity=True,
    ),
    Metric(
        column=columns.PLANNER,
        label="planner",
        kind=CellKind.TEXT,
        compute=lambda e: str(e.trace.fact("planner")),
        formula="name of the planner",
        identity=True,
    ),
    Metric(
        column=columns.SEED,
        label="seed",
        kind=CellKind.WHOLE,
        compute=lambda e: int(e.trace.fact("seed")),
        formula="seed of traffic and obstacles",
        identity=True,
    ),
    Metric(
        column=columns.STATUS,
        label="status",
        kind=CellKind.TEXT,
        compute=lambda e: str(e.trace.fact("status")),
        formula="how the episode ended: `arrived`, `blocked`, `timeout`, `collision`, "
        "`off_road`, `no_room`, `planner_failed`, `simulator_failed` or `crashed`",
        identity=True,
    ),
    Metric(
        column=columns.ARRIVED,
        label="arrived",
        kind=CellKind.FLAG,
        compute=lambda e: efficiency.arrived(e.trace),
        formula="whether the status is `arrived`",
        better=Better.HIGHER,
        identity=True,
        compared=True,
        rate="arrived",
    ),
)
