"""The outcome of an episode as people read it."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.episode.run import Outcome
from experiments.metrics import columns
from experiments.metrics.row import Cell

# column -> (words, unit, digits); in the order shown
SHOWN = {
    columns.TRAVEL_TIME: ("travel time", "s", 1),
    columns.DISTANCE: ("distance", "m", 1),
    columns.MEAN_SPEED: ("mean speed", "m/s", 1),
    columns.COLLISIONS: ("collisions", "", 0),
    columns.OFF_ROAD_STEPS: ("steps off the road", "", 0),
    columns.MIN_CLEARANCE: ("least clearance", "m", 2),
    columns.MIN_TTC: ("least time to collision", "s", 1),
    columns.MIN_TIME_HEADWAY: ("least time headway", "s", 2),
    columns.RMS_JERK: ("RMS jerk", "m/s³", 2),
    columns.MAX_ACCELERATION: ("hardest speeding or braking", "m/s²", 2),
    columns.MAX_LATERAL_ACCELERATION: ("hardest turning", "m/s²", 2),
    columns.REAR_MAX_DECELERATION: ("hardest braking behind the ego", "m/s²", 2),
    columns.FALLBACK_CYCLES: ("fallback cycles", "", 0),
    columns.CANDIDATES_MEAN: ("candidates a cycle", "", 0),
    columns.SURVIVORS_MEAN: ("of these allowed", "", 0),
    columns.PLANNING_P50: ("planning, median", "ms", 2),
    columns.PLANNING_P99: ("planning, 99 %", "ms", 2),
    columns.STEPS_PER_SECOND: ("speed of the loop", "steps/s", 0),
}


def print_outcome(outcome: Outcome, console: Console | None = None) -> None:
    """Print status, reason, metrics with units, and where the run folder is."""
    console = console or Console(highlight=False)
    row = outcome.row
    title = (
        f"{row[columns.SCENARIO]} · {row[columns.PLANNER]} · seed {row[columns.SEED]}"
    )
    table = Table(show_header=False)
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    for key, (words, unit, digits) in SHOWN.items():
        table.add_row(words, _number(row[key], digits), unit)
    console.print(title, soft_wrap=True)
    console.print(table)
    style = "green" if row[columns.ARRIVED] else "red"
    status = str(outcome.ending.status)
    reason = outcome.ending.reason.removeprefix(status).strip()  # say it once
    verdict = Text(status, style=f"bold {style}")
    console.print(verdict.append(f": {reason}", style="default"), soft_wrap=True)
    console.print(f"run folder: {outcome.folder}", soft_wrap=True)


def _number(value: Cell, digits: int) -> str:
    """Write a number, a dash where the metric does not apply."""
    return "-" if value is None else f"{value:.{digits}f}"
