"""A planner's difference from the baseline, as documents write it."""

from experiments.comparison.compare import Line
from experiments.metrics.catalogue import METRICS


def difference_words(line: Line | None) -> tuple[str, str]:
    """Write a difference with its sign, and its 95 % interval.

    Args:
        line: Of a metric; None if the planner has none there.

    Returns:
        One more digit than the metric has; an empty text for what is not known.
    """
    apart = None if line is None else line.difference
    if line is None or apart is None:
        return "", ""
    digits = METRICS[line.metric].digits + 1
    interval = f"{apart.low:+.{digits}f} to {apart.high:+.{digits}f}"
    return f"{apart.value:+.{digits}f}", interval if apart.known else ""
