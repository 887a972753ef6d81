"""Checks that the metrics and axes of a sweep's claim exist and can be tested."""

from experiments.config.sweep import Sweep
from experiments.config.validation_errors import unknown_name
from experiments.config.yaml_reader import Document
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS, RATES, TIMING_COLUMNS
from experiments.metrics.metric import CellKind


def testable_metrics() -> list[str]:
    """List the rates, and the columns of numbers that do not measure the machine."""
    numbers = [
        name
        for name, metric in METRICS.items()
        if metric.kind is not CellKind.TEXT and not metric.identity
    ]
    return [*RATES, *(name for name in numbers if name not in TIMING_COLUMNS)]


def check_claim(sweep: Sweep, document: Document) -> None:
    """Reject a metric or an axis that does not exist, or measures the machine.

    Raises:
        ConfigError: One line that names the place.
    """
    primary = sweep.claim.primary if sweep.claim else ()
    axes = [columns.SCENARIO, *sweep.axes.names]
    for index, name in enumerate((sweep.claim and sweep.claim.by) or ()):
        if name not in axes:
            where = document.where(("claim", "by", index))
            hint = unknown_name(name, axes)
            raise ConfigError(f"{where}: claim.by: {name}: no such axis; {hint}")
    for index, name in enumerate(primary):
        where = document.where(("claim", "primary", index))
        if name in TIMING_COLUMNS:
            raise ConfigError(
                f"{where}: claim.primary: {name} measures the machine; allowed: "
                "metrics of the episode"
            )
        if name not in testable_metrics():
            hint = unknown_name(name, testable_metrics())
            raise ConfigError(f"{where}: claim.primary: {name}: no such metric; {hint}")
        if name in primary[:index]:
            raise ConfigError(
                f"{where}: claim.primary: {name} is there twice; allowed: once"
            )
