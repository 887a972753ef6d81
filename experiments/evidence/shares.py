"""How documents write a share of runs."""

from experiments.comparison.inference import wilson


def share(successes: int, trials: int) -> str:
    """Write a rate with its 95 % interval by Wilson; `-` without trials."""
    if not trials:
        return "-"
    rate = wilson(successes, trials)
    return percent(rate.value, rate.low, rate.high)


def percent(value: float, low: float, high: float) -> str:
    """Write a share and its interval."""
    return f"{100.0 * value:.1f} % [{100.0 * low:.1f}, {100.0 * high:.1f}]"
