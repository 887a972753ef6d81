"""The table of a comparison for the terminal, and as CSV, Markdown, LaTeX."""

import csv
import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.comparison.compare import Line
from experiments.comparison.inference import Interval
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
_LATEX = {"%": r"\%", "_": r"\_", "&": r"\&", "#": r"\#", "$": r"\$"}


def cells(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Format the lines of a comparison."""
    return [_cells(line) for line in lines]


def export(lines: Sequence[Line], path: Path) -> None:
    """Write a comparison to a file in the format of its suffix.

    Raises:
        ConfigError: If the suffix is not .csv, .md or .tex.
        ResultsError: If the file cannot be written.
    """
    if path.suffix not in EXPORTS:
        allowed = ", ".join(EXPORTS)
        raise ConfigError(f"{path}: unknown suffix; allowed: {allowed}")
    try:
        path.write_text(EXPORTS[path.suffix](lines), encoding="utf-8")
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


def as_latex(lines: Sequence[Line]) -> str:
    """Write a comparison as a LaTeX table with booktabs."""
    body = []
    before = None
    for line in lines:
        if before is not None and before != line.metric:
            body.append(r"\addlinespace")
        row = _cells(line)
        shown = row if before != line.metric else ("", *row[1:])
        body.append(" & ".join(map(_latex, shown)) + r" \\")
        before = line.metric
    head = " & ".join(map(_latex, HEADER)) + r" \\"
    parts = [
        "% needs \\usepackage{booktabs}",
        r"\begin{tabular}{llrrrrrrrr}",
        r"\toprule",
        head,
        r"\midrule",
        *body,
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(parts) + "\n"


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


def _latex(text: str) -> str:
    """Escape text for LaTeX."""
    if text.startswith("< "):
        return f"${text}$"
    return "".join(_LATEX.get(character, character) for character in text)
