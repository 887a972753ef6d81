"""`rearview results | compare`: results of a sweep."""

import csv
import json
import sys
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.cli.user_errors import report_user_errors


class Format(StrEnum):
    """Output format of rows."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


AT_ONCE = "none"  # of --by: no cells
_SUMMARY = """
SELECT scenario, label, count(*) AS runs,
  count(*) FILTER (arrived) AS arrived,
  count(*) FILTER (collisions > 0) AS collided,
  count(*) FILTER (failure IS NOT NULL) AS lost,
  round(avg(travel_time_s), 2) AS travel_time_s,
  round(min(min_clearance_m), 2) AS min_clearance_m,
  round(median(planning_cpu_ms_p50), 2) AS planning_cpu_ms_p50
FROM runs GROUP BY ALL ORDER BY ALL
"""


def add_to(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command()(results)
    app.command()(compare)


def results(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    *,
    rebuild: Annotated[
        bool,
        typer.Option("--rebuild", help="Collect the rows from all run folders again."),
    ] = False,
    sql: Annotated[
        str | None, typer.Option(help="A SELECT on the table runs.  [a summary]")
    ] = None,
    form: Annotated[
        Format, typer.Option("--format", help="Output format.")
    ] = Format.TABLE,
) -> None:
    """Print the results of a sweep, by default a summary.

    Example: rearview results sweeps/smoke --sql "SELECT seed, status FROM runs"

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.comparison import results as found
        from experiments.sweep.folder import require_sweep

        require_sweep(folder)
        if rebuild:
            count = found.rebuild(folder)
            sys.stderr.write(f"{folder}: {count} rows\n")
        relation = found.query(folder, sql or _SUMMARY)
        _print(relation.columns, found.fetch(relation), form)


def compare(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    *,
    baseline: Annotated[
        str | None,
        typer.Option(
            help="Planner that the others are compared with.  [of the sweep's claim]"
        ),
    ] = None,
    where: Annotated[
        str | None,
        typer.Option(metavar="SQL", help="Condition on runs: scenario = 'curved'"),
    ] = None,
    metric: Annotated[
        list[str] | None,
        typer.Option(
            help="Metric or rate; may be repeated.  [the claim's and the usual ones]"
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN",
            help="Compare within its values; none: over all runs at once.  "
            "[scenario and axes]",
        ),
    ] = None,
    median: Annotated[
        bool, typer.Option("--median", help="Compare medians instead of means.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A .csv, .md or .tex file.")
    ] = None,
    caption: Annotated[
        str, typer.Option(help="Of a .tex file, which becomes a whole table.")
    ] = "",
) -> None:
    """Compare planners with a baseline on common seeds.

    Example: rearview compare sweeps/smoke --baseline cruise -o table.tex

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.comparison.compare import Center
        from experiments.comparison.compare import compare as compared
        from experiments.comparison.question import question_of
        from experiments.comparison.results import ALL_RUNS, rows
        from experiments.comparison.table import cells, export, header

        condition = f" WHERE {where}" if where else ""
        found = rows(folder, f"{ALL_RUNS}{condition}", "--where")
        center = Center.MEDIAN if median else Center.MEAN
        split = () if by == [AT_ONCE] else by
        lines = compared(found, question_of(folder, baseline, metric, split, center))
        if output is None:
            _print(header(lines), cells(lines), Format.TABLE)
        else:
            export(lines, output, caption)
            sys.stdout.write(f"{output}\n")


def _print(names: Sequence[str], rows: Sequence[Sequence[Any]], form: Format) -> None:
    """Print rows in a format."""
    if form is Format.CSV:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)
    elif form is Format.JSON:
        for row in rows:
            line = dict(zip(names, row, strict=True))
            sys.stdout.write(json.dumps(line, default=str) + "\n")
    else:
        _print_table(names, rows)


def _print_table(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print rows as a table, in full width unless a terminal limits it."""
    from rich.console import Console
    from rich.table import Table

    table = Table()
    for name in names:
        table.add_column(name)
    for row in rows:
        table.add_row(*("-" if value is None else str(value) for value in row))
    width = None if sys.stdout.isatty() else 10_000
    Console(width=width, highlight=False).print(table, soft_wrap=True)
