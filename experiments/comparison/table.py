"""The table of a comparison for the terminal, and as CSV, Markdown, LaTeX."""

import csv
import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.comparison.compare import Line
from experiments.comparison.inference import Interval
from experiments.comparison.latex import as_latex
from experiments.errors import ConfigError, ResultsError

HEADER = (
    "metric",
    "planner",
    "runs",
    "value",
    "95 % interval",
    "difference",
    "95 % interval",
    "effect",
    "p (Holm)",
    "seeds",
)
SMALL_P = 0.001
_CSV_HEADER = (
    "metric",
    "planner",
    "runs",
    "value",
    "low",
    "high",
    "pairs",
    "difference",
    "difference_low",
    "difference_high",
    "effect",
    "test",
    "p",
    "p_holm",
    "seeds_needed",
)


def cells(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Format the lines of a comparison."""
    return [_cells(line) for line in lines]


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
    for line in lines:
        other = line.difference
        writer.writerow(
            (
                line.metric,
                line.label,
                line.runs,
                *_ends(line.value),
                line.pairs,
                *(_ends(other) if other else ("", "", "")),
                *(
                    "" if value is None else value
                    for value in (
                        line.effect,
                        line.test,
                        line.p_value,
                        line.p_holm,
                        line.seeds_needed,
                    )
                ),
            )
        )
    return text.getvalue()


def as_markdown(lines: Sequence[Line]) -> str:
    """Write a comparison as a Markdown table."""
    rows = [HEADER, tuple("---" for _ in HEADER), *cells(lines)]
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


EXPORTS: dict[str, Callable[[Sequence[Line]], str]] = {
    ".csv": as_csv,
    ".md": as_markdown,
    ".tex": as_latex,
}


def _cells(line: Line) -> tuple[str, ...]:
    """Format one line."""
    rate, other = line.rate, line.difference
    return (
        line.metric,
        line.label,
        str(line.runs),
        _number(line.value.value, rate=rate),
        _interval(line.value, rate=rate),
        _number(other.value, rate=rate) if other else "",
        _interval(other, rate=rate) if other else "",
        "" if line.effect is None else f"{line.effect:.2f}",
        "" if line.p_holm is None else _p(line.p_holm),
        "" if line.seeds_needed is None else str(line.seeds_needed),
    )


def _number(value: float, *, rate: bool) -> str:
    """Format a value, a rate in percent."""
    return f"{100.0 * value:.1f} %" if rate else f"{value:.4g}"


def _interval(interval: Interval, *, rate: bool) -> str:
    """Format the ends of an interval."""
    if not (math.isfinite(interval.low) and math.isfinite(interval.high)):
        return "unknown"
    if rate:
        return f"[{100.0 * interval.low:.1f}, {100.0 * interval.high:.1f}] %"
    return f"[{interval.low:.4g}, {interval.high:.4g}]"


def _p(value: float) -> str:
    """Format a p value."""
    return f"< {SMALL_P:g}" if value < SMALL_P else f"{value:.3f}"


def _ends(interval: Interval) -> tuple[float, float, float]:
    """Return the estimate and the ends of its interval."""
    return interval.value, interval.low, interval.high
