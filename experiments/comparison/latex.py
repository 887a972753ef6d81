"""The table of a comparison for a paper: LaTeX with booktabs.

Words and units are those of the pages; each metric has the digits of the catalogue.
"""

import math
from collections.abc import Sequence

from experiments.comparison.compare import Line, named
from experiments.comparison.location import Interval
from experiments.comparison.mean_digits import mean_digits

SMALL_P = 0.001
NOTES = r"p{0.25\linewidth}"  # a column of text in several lines

_SIGNS = {
    "\\": r"\textbackslash{}",
    "%": r"\%",
    "_": r"\_",
    "&": r"\&",
    "#": r"\#",
    "$": r"\$",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "²": r"\textsuperscript{2}",
    "³": r"\textsuperscript{3}",
    "⁵": r"\textsuperscript{5}",
}


def as_latex(lines: Sequence[Line], caption: str = "") -> str:
    """Write a comparison as a LaTeX table.

    Args:
        lines: Of the comparison.
        caption: Of the table; without one only the `tabular` is written.
    """
    body: list[str] = []
    before = None
    cells = any(line.where for line in lines)
    notes = any(line.note for line in lines)
    for line in lines:
        if before not in (None, line.metric):
            body.append(r"\addlinespace")
        name = "" if before == line.metric else escaped(named(line.metric, " [%]"))
        where = (escaped(line.where),) if cells else ()
        note = (escaped(line.note),) if notes else ()
        body.append(" & ".join((name, *where, *_cells(line), *note)) + r" \\")
        before = line.metric
    table = [
        rf"\begin{{tabular}}{{l{'l' * cells}lrrrrr{NOTES * notes}}}",
        r"\toprule",
        rf"metric & {'where & ' * cells}planner & runs & value [95\,\%] & pairs & "
        rf"difference [95\,\%] & $p${' & note' * notes} \\",
        r"\midrule",
        *body,
        r"\bottomrule",
        r"\end{tabular}",
    ]
    if caption:
        table = [
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{escaped(caption)}}}",
            *table,
            r"\end{table}",
        ]
    return "\n".join(["% needs \\usepackage{booktabs}", *table]) + "\n"


def escaped(text: str) -> str:
    """Escape text for LaTeX."""
    return "".join(_SIGNS.get(sign, sign) for sign in text)


def _cells(line: Line) -> tuple[str, ...]:
    """Format planner, runs, value, difference and p of a line."""
    digits = 1 if line.rate else mean_digits(line.metric)
    scale = 100.0 if line.rate else 1.0
    p = line.p_holm
    return (
        escaped(line.label),
        str(line.runs),
        _with_interval(line.value, scale, digits),
        "" if line.difference is None else str(line.pairs),
        _with_interval(line.difference, scale, digits, sign="+"),
        "" if p is None else f"$<{SMALL_P:g}$" if p < SMALL_P else f"{p:.3f}",
    )


def _with_interval(
    interval: Interval | None, scale: float, digits: int, sign: str = ""
) -> str:
    """Format an estimate with its interval."""
    if interval is None:
        return ""
    value, low, high = (
        f"{scale * end:{sign}z.{digits}f}".replace("-", "$-$")
        for end in (interval.value, interval.low, interval.high)
    )
    if not (math.isfinite(interval.low) and math.isfinite(interval.high)):
        return value
    return f"{value} [{low}, {high}]"
