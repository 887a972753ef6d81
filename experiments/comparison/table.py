"""The table of a comparison for the terminal, and as CSV, Markdown, LaTeX."""

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.comparison.compare import Line
from experiments.comparison.inference import rule_of_three
from experiments.comparison.latex import as_latex
from experiments.comparison.location import Interval
from experiments.comparison.mean_digits import mean_digits
from experiments.errors import ConfigError, ResultsError

HEADER = (
    "metric",
    "where",
    "planner",
    "runs",
    "value",
    "95 % interval",
    "pairs",
    "difference",
    "95 % interval of it",
    "placebo",
    "far ahead",
    "effect",
    "p",
    "p (Holm)",
    "seeds",
    "note",
)
_ONLY_IF_FILLED = ("where", "placebo", "far ahead", "note")
SMALL_P = 0.001
_CSV_HEADER = (
    "metric",
    "where",
    "planner",
    "runs",
    "value",
    "low",
    "high",
    "pairs",
    "difference",
    "difference_low",
    "difference_high",
    "placebo",
    "placebo_low",
    "placebo_high",
    "far_ahead",
    "far_ahead_low",
    "far_ahead_high",
    "effect",
    "test",
    "p",
    "p_holm",
    "seeds_needed",
    "note",
)


def header(lines: Sequence[Line]) -> tuple[str, ...]:
    """Return the names of the columns of `cells`."""
    return tuple(HEADER[number] for number in _shown(lines))


def cells(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Format the lines of a comparison; a column that would be empty is left out."""
    kept = _shown(lines)
    return [tuple(row[number] for number in kept) for row in map(_cells, lines)]


def _shown(lines: Sequence[Line]) -> list[int]:
    """Return the numbers of the columns that are shown."""
    rows = [_cells(line) for line in lines]
    return [
        number
        for number, name in enumerate(HEADER)
        if name not in _ONLY_IF_FILLED or any(row[number] for row in rows)
    ]


def export(lines: Sequence[Line], path: Path, caption: str = "") -> None:
    """Write a comparison to a file in the format of its suffix.

    Args:
        lines: Of the comparison.
        path: Of the file.
        caption: Of a LaTeX table.

    Raises:
        ConfigError: If the suffix is not .csv, .md or .tex.
        ResultsError: If the file cannot be written.
    """
    if path.suffix not in EXPORTS:
        allowed = ", ".join(EXPORTS)
        raise ConfigError(f"{path}: unknown suffix; allowed: {allowed}")
    if caption and path.suffix != ".tex":
        raise ConfigError(f"--caption: {path}: allowed: a .tex file")
    text = as_latex(lines, caption) if caption else EXPORTS[path.suffix](lines)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"{path}: cannot be written: {error.strerror}") from error


def as_csv(lines: Sequence[Line]) -> str:
    """Write a comparison as CSV, with all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_CSV_HEADER)
    for row in records(lines):
        writer.writerow("" if value is None else value for value in row.values())
    return text.getvalue()


def records(lines: Sequence[Line]) -> list[dict[str, str | int | float | None]]:
    """Return the lines of a comparison with all digits, None where nothing is known."""
    return [dict(zip(_CSV_HEADER, _values(line), strict=True)) for line in lines]


def _values(line: Line) -> tuple[str | int | float | None, ...]:
    """Return one line, in the order of `_CSV_HEADER`."""
    return (
        line.metric,
        line.where,
        line.label,
        line.runs,
        *_ends(line.value),
        line.pairs,
        *_ends(line.difference),
        *_ends(line.placebo),
        *_ends(line.ahead),
        line.effect,
        line.test,
        line.p_value,
        line.p_holm,
        line.seeds_needed,
        line.note,
    )


def as_markdown(lines: Sequence[Line]) -> str:
    """Write a comparison as a Markdown table."""
    names = header(lines)
    rows = [names, tuple("---" for _ in names), *cells(lines)]
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


EXPORTS: dict[str, Callable[[Sequence[Line]], str]] = {
    ".csv": as_csv,
    ".md": as_markdown,
    ".tex": as_latex,
}


def _cells(line: Line) -> tuple[str, ...]:
    """Format one line, in the order of `HEADER`."""
    other = line.difference
    return (
        line.metric,
        line.where,
        line.label,
        str(line.runs),
        _number(line.value.value, line) if line.value else "",
        _own_interval(line),
        "" if line.difference is None and not line.note else str(line.pairs),
        _number(other.value, line) if other else "",
        _interval(other, line) if other else "",
        *(
            _with_interval(one, line) if one else ""
            for one in (line.placebo, line.ahead)
        ),
        "" if line.effect is None else f"{line.effect:.2f}",
        "" if line.p_value is None else _p(line.p_value),
        "" if line.p_holm is None else _p(line.p_holm),
        "" if line.seeds_needed is None else str(line.seeds_needed),
        line.note,
    )


def _own_interval(line: Line) -> str:
    """Format the interval of a planner's own value; of no event the rule of three."""
    if line.value is None:
        return ""
    if line.events == 0:
        return f"below {100.0 * rule_of_three(line.runs):.1f} % (rule of three)"
    return _interval(line.value, line)


def _with_interval(interval: Interval, line: Line) -> str:
    """Format a value and its interval in one cell."""
    return f"{_number(interval.value, line)} {_interval(interval, line)}"


def _number(value: float, line: Line) -> str:
    """Format a value, a rate in percent."""
    if line.rate:
        return f"{100.0 * value:z.1f} %"
    return f"{value:z.{mean_digits(line.metric)}f}"


def _interval(interval: Interval, line: Line) -> str:
    """Format the ends of an interval."""
    if not interval.known:
        return "unknown"
    if line.rate:
        return f"[{100.0 * interval.low:z.1f}, {100.0 * interval.high:z.1f}] %"
    digits = mean_digits(line.metric)
    return f"[{interval.low:z.{digits}f}, {interval.high:z.{digits}f}]"


def _p(value: float) -> str:
    """Format a p value."""
    return f"< {SMALL_P:g}" if value < SMALL_P else f"{value:.3f}"


def _ends(interval: Interval | None) -> tuple[float | None, ...]:
    """Return the estimate and the ends of its interval."""
    if interval is None:
        return None, None, None
    return interval.value, interval.low, interval.high
