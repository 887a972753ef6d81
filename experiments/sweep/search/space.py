"""The space of a search: keys of the scenario as coordinates from 0 to 1."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from experiments.config.axes import Point
from experiments.config.scenario_file import parse_key
from experiments.config.search import SearchRange
from experiments.sweep.plan import plain
from planner.states import FloatArray

DIGITS = 5  # of a number of a trial: a command that repeats it can be read


@dataclass(frozen=True)
class SearchSpace:
    """Some keys, each with a range or a choice."""

    ranges: Mapping[str, SearchRange]

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """The keys, in the order of the file."""
        return tuple(self.ranges)

    @cached_property
    def is_choice(self) -> tuple[bool, ...]:
        """Which of them have values without an order."""
        return tuple(one.choice is not None for one in self.ranges.values())

    @cached_property
    def counts(self) -> tuple[int | None, ...]:
        """Number of values of each key; None where it is infinite."""
        return tuple(_count(one) for one in self.ranges.values())

    def point(self, at: FloatArray) -> Point:
        """Return the values at coordinates from 0 to 1, (n_keys,)."""
        pairs = zip(self.ranges.items(), at.tolist(), strict=True)
        return {key: value_at(one, share) for (key, one), share in pairs}

    def coordinates(self, point: Mapping[str, Any]) -> FloatArray:
        """Return the coordinates of values, (n_keys,) from 0 to 1."""
        return np.array([share_of(one, point[k]) for k, one in self.ranges.items()])

    def mild_point(self, scenario: Mapping[str, Any]) -> Point:
        """Return the values toward which failures are reduced.

        Args:
            scenario: The base scenario, resolved. Where a range has no `mild` value
                its own one counts, moved into the range; without any, the middle.
        """
        found = {}
        for key, one in self.ranges.items():
            value = one.mild if one.mild is not None else _value_in(scenario, key)
            found[key] = _moved_in(one, value)
        return found


def value_at(one: SearchRange, share: float) -> Any:
    """Return the value of a range at a share from 0 to 1 of its length."""
    share = min(max(share, 0.0), 1.0)
    if one.choice is not None:
        place = min(int(share * len(one.choice)), len(one.choice) - 1)
        return plain(one.choice[place])
    assert one.range is not None  # noqa: S101 - its validator knows
    least, most = one.range
    whole = _count(one)
    if whole is not None:
        if one.log:
            ends = math.log(least), math.log(most + 1)
            value = math.floor(math.exp(ends[0] + share * (ends[1] - ends[0])))
        else:
            value = int(least) + math.floor(share * whole)
        return min(max(value, int(least)), int(most))
    if one.log:
        ends = math.log(least), math.log(most)
        exact = math.exp(ends[0] + share * (ends[1] - ends[0]))
    else:
        exact = least + share * (most - least)
    return min(max(rounded(exact), float(least)), float(most))


def extremes(one: SearchRange) -> list[Any]:
    """Return both ends of a range, or all values of a choice."""
    if one.choice is not None:
        return [plain(value) for value in one.choice]
    return [value_at(one, 0.0), value_at(one, 1.0)]


def share_of(one: SearchRange, value: Any) -> float:
    """Return the share of a range at which a value lies, the middle of its own part."""
    if one.choice is not None:
        values = [plain(each) for each in one.choice]
        return (values.index(plain(value)) + 0.5) / len(values)
    assert one.range is not None  # noqa: S101 - its validator knows
    least, most = one.range
    whole = _count(one)
    if whole is not None and not one.log:
        return float((value - least + 0.5) / whole)
    if whole is not None:
        value, most = value + 0.5, most + 1
    if one.log:
        return float(math.log(value / least) / math.log(most / least))
    return float((value - least) / (most - least))


def rounded(value: float) -> float:
    """Round a number to `DIGITS` significant digits."""
    return float(f"{value:.{DIGITS}g}")


def _count(one: SearchRange) -> int | None:
    """Return the number of values; None where it is infinite."""
    if one.choice is not None:
        return len(one.choice)
    assert one.range is not None  # noqa: S101 - its validator knows
    least, most = one.range
    whole = isinstance(least, int) and isinstance(most, int)
    return int(most - least + 1) if whole else None


def _moved_in(one: SearchRange, value: Any) -> Any:
    """Return a value of the range: the given one, the nearest one, or the middle."""
    if one.choice is not None:
        values = [plain(each) for each in one.choice]
        return plain(value) if plain(value) in values else values[0]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value_at(one, 0.5)
    assert one.range is not None  # noqa: S101 - its validator knows
    near = min(max(value, one.range[0]), one.range[1])
    return round(near) if _count(one) is not None else float(near)


def _value_in(scenario: Mapping[str, Any], key: str) -> Any:
    """Look a key of a resolved scenario up; None where it has none."""
    node: Any = scenario
    for part in parse_key(key) or ():
        if isinstance(part, int):
            known = isinstance(node, list | tuple) and part < len(node)
        else:
            known = isinstance(node, dict) and part in node
        node = node[part] if known else None
    return node
