"""The outcome of an episode as a table on the terminal."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.episode.run_folder import Outcome
from experiments.metrics import columns
from experiments.metrics.catalogue import IN_TERMINAL, METRICS
from experiments.metrics.fleet_catalogue import EGOS_DRIVEN, FLEET_METRICS

# Rows left out for planners that do not choose among candidates.
_OF_MANY_EGOS = (
    columns.COLLISIONS,
    columns.FALLBACK_CYCLES,
    columns.PLANNING_CPU_P50,
    columns.PLANNING_CPU_P99,
    *(metric.column for metric in FLEET_METRICS),
)
_OF_CANDIDATES = (columns.CANDIDATES_MEAN, columns.FEASIBLE_MEAN)


def print_outcome(outcome: Outcome, console: Console | None = None) -> None:
    """Print the metrics with units, status and reason, and the run folder."""
    console = console or Console(highlight=False)
    row = outcome.row
    title = (
        f"{row[columns.SCENARIO]} · {row[columns.PLANNER]} · seed {row[columns.SEED]}"
    )
    table = Table(show_header=False)
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    counts_candidates = bool(row[columns.CANDIDATES_MEAN])
    many = row[EGOS_DRIVEN] is not None
    shown = [METRICS[name] for name in _OF_MANY_EGOS if row[name] is not None]
    for metric in shown if many else IN_TERMINAL:
        if metric.column in _OF_CANDIDATES and not counts_candidates:
            continue
        table.add_row(metric.label, metric.text(row[metric.column]), metric.unit)
    console.print(title, soft_wrap=True)
    console.print(table)
    style = "green" if row[columns.ARRIVED] else "red"
    status = str(outcome.ending.status)
    reason = outcome.ending.reason.removeprefix(status).strip()  # not twice
    verdict = Text(status, style=f"bold {style}")
    console.print(verdict.append(f": {reason}", style="default"), soft_wrap=True)
    if row[columns.RECORDED_TRAFFIC]:
        console.print("traffic: a recording, which does not react to the ego")
    console.print(f"run folder: {outcome.folder}", soft_wrap=True)
