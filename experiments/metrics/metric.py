"""One metric of the results row, and the recorded episode it is computed from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

from experiments.metrics import without_ego
from experiments.metrics.columns import Cell
from experiments.metrics.verdict.of_trace import verdict_of
from experiments.metrics.verdict.records import ContactVerdict
from experiments.trace.content_check import LARGEST_NUMBER
from experiments.trace.schema import Table, Trace
from planner.vehicle import VehicleLimits


@dataclass(frozen=True)
class MeasuredEpisode:
    """A recorded episode, and the same seed without the ego if that was driven."""

    trace: Trace
    vehicles_without_ego: Table | None = None
    limits: VehicleLimits | None = None  # of the ego, if they are known
    # two more without the ego, each with other random numbers from its entry on
    placebos: tuple[Table | None, Table | None] = (None, None)
    recorded_traffic: bool = False  # the others follow a recording, and do not react

    @cached_property
    def verdict(self) -> ContactVerdict | None:
        """Whose fault the first contact is; None without one."""
        return verdict_of(self.trace)

    @cached_property
    def costs_behind(self) -> list[without_ego.Cost] | None:
        """Losses of the vehicles behind the ego; None without the second run."""
        if self.vehicles_without_ego is None:
            return None
        return without_ego.costs(self.trace, self.vehicles_without_ego)

    @cached_property
    def costs_ahead(self) -> list[without_ego.Cost] | None:
        """Differences of vehicles far ahead; None without the second run."""
        if self.vehicles_without_ego is None:
            return None
        return without_ego.costs_ahead(self.trace, self.vehicles_without_ego)

    @cached_property
    def costs_placebo(self) -> list[without_ego.Cost] | None:
        """Differences between the two placebos; None without both."""
        one, other = self.placebos
        if one is None or other is None:
            return None
        return without_ego.costs(self.trace, one, other)


class Better(StrEnum):
    """Direction in which a metric improves."""

    LOWER = "lower"
    HIGHER = "higher"
    NEITHER = "-"


class CellKind(StrEnum):
    """What the cells of a column hold."""

    NUMBER = "a number"
    WHOLE = "a whole number"
    TEXT = "a text"
    FLAG = "true or false"


_TYPES: Mapping[CellKind, type | tuple[type, ...]] = {
    CellKind.NUMBER: (int, float),
    CellKind.WHOLE: int,
    CellKind.TEXT: str,
    CellKind.FLAG: bool,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One column of the results row: how it is computed, named and shown."""

    column: str
    label: str
    compute: Callable[[MeasuredEpisode], Cell]  # None where it does not apply
    formula: str  # definition in words
    unit: str = ""
    digits: int = 0  # after the decimal point
    kind: CellKind = CellKind.NUMBER
    better: Better = Better.NEITHER
    identity: bool = False  # names the run or its outcome, measures nothing
    in_terminal: bool = False  # listed when `rearview run` ends
    compared: bool = False  # `rearview compare` includes its mean by default
    rate: str = ""  # name of the share of runs with a value above zero, if compared
    of_planner: bool = False  # or of motion SUMO only draws; null where SUMO drives
    timing: bool = False  # wall clock: left out when results are compared for identity

    @property
    def label_with_unit(self) -> str:
        """Label with the unit in brackets."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def holds(self, value: object) -> bool:
        """Check whether a value, or None, may stand in the column."""
        if value is None:
            return not self.identity
        if isinstance(value, bool):
            return self.kind is CellKind.FLAG
        if isinstance(value, float) and not abs(value) <= LARGEST_NUMBER:
            return False
        return isinstance(value, _TYPES[self.kind])

    def text(self, value: Any) -> str:
        """Format a value, `-` where the metric does not apply."""
        if value is None:
            return "-"
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, int | float):
            return f"{value:.{self.digits}f}"
        return str(value)
