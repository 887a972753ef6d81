"""The outcome of an episode as people read it."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.episode.run_folder import Outcome
from experiments.metrics import columns
from experiments.metrics.row import Cell
from experiments.metrics.words import SHOWN


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
