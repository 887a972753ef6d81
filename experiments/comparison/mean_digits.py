"""How many digits a mean is shown with."""

from experiments.metrics.catalogue import METRICS

MORE_DIGITS = 1  # of a mean than of one run


def mean_digits(metric: str) -> int:
    """Return the digits after the point of a mean: those of the catalogue and one.

    Args:
        metric: A column, or one with an addition: "travel_time_s, penalised". What the
            catalogue does not know, such as the columns of users, gets two.
    """
    column = metric.partition(", ")[0]
    return METRICS[column].digits + MORE_DIGITS if column in METRICS else 2
