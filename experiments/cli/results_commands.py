"""`rearview results | compare`: results of a sweep."""

import csv
import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.cli.option_group import with_options
from experiments.cli.user_errors import OTHER_OUTCOME, report_user_errors
from experiments.config.counted import counted
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.comparison.compare import Line
    from experiments.comparison.results import Row


class Format(StrEnum):
    """Output format of rows."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


class FailOn(StrEnum):
    """Which difference from earlier results is a regression."""

    SIGNIFICANT = "significant"
    WORSE = "worse"


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
        if sql is not None and not sql.strip():
            raise ConfigError("--sql: is empty; allowed: a SELECT on the table runs")
        if rebuild:
            count = found.rebuild(folder)
            sys.stderr.write(f"{folder}: {count} rows\n")
        relation = found.query(folder, sql or _SUMMARY)
        _print(relation.columns, found.fetch(relation), form)


@dataclass(frozen=True, slots=True)
class Earlier:
    """Earlier results that a sweep is compared with, instead of a baseline."""

    against: Annotated[
        Path | None,
        typer.Option(
            metavar="PARQUET",
            help="Compare every planner with itself in an earlier results.parquet.",
        ),
    ] = None
    fail_on: Annotated[
        FailOn | None,
        typer.Option(
            help="With --against: what is a regression.  [significant]",
            show_default=False,
        ),
    ] = None


@dataclass(frozen=True, slots=True)
class TableFile:
    """Where a comparison is written to."""

    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A .csv, .md or .tex file.")
    ] = None
    caption: Annotated[
        str, typer.Option(help="Of a .tex file, which becomes a whole table.")
    ] = ""


@with_options("earlier", Earlier)
@with_options("table", TableFile)
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
    table: TableFile,
    earlier: Earlier,
) -> None:
    """Compare planners with a baseline on common seeds, or with earlier results.

    Examples: rearview compare sweeps/smoke --baseline cruise -o table.tex;
    rearview compare sweeps/smoke --against baseline.parquet

    Exit status: 0 done, 1 with --against: a metric got worse, 2 bad input.
    """
    with report_user_errors():
        from experiments.comparison.compare import Center
        from experiments.comparison.compare import compare as compared
        from experiments.comparison.question import question_of
        from experiments.comparison.results import ALL_RUNS, rows

        condition = f" WHERE {where}" if where else ""
        found = rows(folder, f"{ALL_RUNS}{condition}", "--where")
        if earlier.against is not None:
            if baseline is not None or by is not None or median:
                raise ConfigError(
                    "--against: compares means of each planner with its own earlier "
                    "ones; allowed with it: --metric, --where, --fail-on, -o"
                )
            _against(found, earlier, metric, table)
            return
        if earlier.fail_on is not None:
            raise ConfigError("--fail-on: allowed with --against")
        center = Center.MEDIAN if median else Center.MEAN
        split = () if by == [AT_ONCE] else by
        lines = compared(found, question_of(folder, baseline, metric, split, center))
        _show(lines, table)


def _against(
    found: "Sequence[Row]",
    earlier: Earlier,
    metrics: Sequence[str] | None,
    table: TableFile,
) -> None:
    """Compare rows with earlier ones, print what got worse, and exit by it."""
    from experiments.comparison import against

    assert earlier.against is not None  # noqa: S101 - of the caller
    before = against.read_results(earlier.against)
    lines = against.compare_with_earlier(found, before, metrics)
    if table.output is not None:
        _show(lines, table)
    fail_on = against.RegressionRule(earlier.fail_on or FailOn.SIGNIFICANT)
    against.require_tested(lines, fail_on)
    worse = against.regressions(lines, fail_on)
    for one in worse:
        sys.stdout.write(f"{one}\n")
    if worse:
        raise typer.Exit(OTHER_OUTCOME)
    words = counted(len(lines), "comparison")
    few = against.untested(lines)
    if few and fail_on is against.RegressionRule.SIGNIFICANT:
        words += f", {few} of them not tested: too few common seeds"
    sys.stdout.write(f"no metric got worse: {words}\n")


def _show(lines: "Sequence[Line]", table: TableFile) -> None:
    """Print a comparison, or write it to a file."""
    from experiments.comparison.table import cells, export, header

    if table.output is None:
        _print_blocks(header(lines), cells(lines))
    else:
        export(lines, table.output, table.caption)
        sys.stdout.write(f"{table.output}\n")


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


def _print_blocks(names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a comparison below one another in as many tables as the terminal needs."""
    from experiments.comparison.blocks import WIDTH, blocks, says, whole_width

    width = shutil.get_terminal_size((WIDTH, 1)).columns
    found = blocks(names, rows, width)
    for block in found:
        told = [[row[k] for k in block] for row in rows if says(row, block, names)]
        if told or not rows:
            _print_table([names[k] for k in block], told)
    if len(found) > 1:
        sys.stdout.write(
            f"in {len(found)} parts; as one table: -o FILE.csv, .md or .tex, or "
            f"COLUMNS={whole_width(names, rows)} rearview compare ...\n"
        )


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
