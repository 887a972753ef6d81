"""Conditions on the results of a sweep, as continuous integration asks them.

A condition is a short expression over the runs of one scenario and planner:

    collisions > 0 or arrived < 0.95

A metric stands for its mean over the runs in which it applies (the share, where it is
true or false), `min(...)`, `max(...)`, `sum(...)`, `median(...)`, `p5(...)`, `p95(...)`
and `count(...)` for other figures of it, `runs` and `lost` for the numbers of all runs
and of those without an episode. Python's parser reads it; nothing is executed.
"""

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from experiments.comparison.results import FAILURE, LABEL, Row
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.metric import CellKind
from planner.states import FloatArray

LONGEST = 500  # characters of a condition

Value = float | str | bool

_AGGREGATES: Mapping[str, Callable[[FloatArray], Any]] = {
    "mean": np.mean,
    "median": np.median,
    "min": np.min,
    "max": np.max,
    "sum": np.sum,
    "p5": lambda values: np.quantile(values, 0.05),
    "p95": lambda values: np.quantile(values, 0.95),
}
_COUNT = "count"  # of the runs in which a metric applies
_RUNS, _LOST = "runs", "lost"
_TEXTS = (columns.SCENARIO, "planner")  # the same in all runs of a group
_NUMBERS = tuple(
    name
    for name, metric in METRICS.items()
    if metric.kind is not CellKind.TEXT and name != columns.SEED
)
_COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_ARITHMETIC: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


@dataclass(frozen=True, slots=True)
class ConditionVerdict:
    """A condition on the runs of one scenario and planner."""

    condition: str
    scenario: str
    planner: str  # label
    met: bool
    values: Mapping[str, Value]  # what the figures in it were, as far as it was read

    def __str__(self) -> str:
        """Describe it in one line."""
        shown = ", ".join(f"{name} = {_text(x)}" for name, x in self.values.items())
        return f"{self.scenario}, {self.planner}: {self.condition} ({shown})"


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition that was read and checked."""

    text: str
    tree: ast.expr = field(repr=False)

    @classmethod
    def read(cls, text: str) -> "Condition":
        """Read a condition.

        Raises:
            ConfigError: One line that names what is wrong and what is allowed.
        """
        text = " ".join(text.split())
        if len(text) > LONGEST:
            raise _error(text[:40], f"is too long; allowed: {LONGEST} characters")
        try:
            tree = ast.parse(text, mode="eval").body
        except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
            allowed = "allowed: a condition such as collisions > 0 or arrived < 0.95"
            raise _error(text, f"cannot be understood; {allowed}") from error
        _check(tree, text)
        if not _is_condition(tree):
            raise _error(text, "is no condition; allowed: one, such as collisions > 0")
        return cls(text, tree)

    def judge(
        self, rows: Sequence[Row], scenario: str, planner: str
    ) -> ConditionVerdict:
        """Decide whether it is met by the runs of one scenario and planner.

        A condition about metrics is met if all runs are lost.

        Raises:
            ConfigError: If a figure in it applies to no run, or is divided by zero.
        """
        reading = _Reading(self.text, rows, scenario, planner)
        try:
            met = bool(reading.value(self.tree))
        except _AllLostError:  # nothing is known that could speak for the planner
            met = True
            reading.seen[_LOST] = float(len(rows))
        return ConditionVerdict(self.text, scenario, planner, met, reading.seen)


def judge(
    rows: Sequence[Row], conditions: Sequence[Condition]
) -> list[ConditionVerdict]:
    """Decide every condition for every scenario and planner of a sweep.

    Raises:
        ConfigError: If there are no runs, or a condition cannot be decided.
    """
    if not rows:
        raise ConfigError("--fail-if: there are no runs to judge")
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        key = (str(row[columns.SCENARIO]), str(row[LABEL]))
        groups.setdefault(key, []).append(row)
    for condition in conditions:
        _require_names(condition, {_TEXTS[k]: {g[k] for g in groups} for k in (0, 1)})
    return [
        condition.judge(group, *key)
        for key, group in sorted(groups.items())
        for condition in conditions
    ]


def _require_names(condition: Condition, there: Mapping[str, set[str]]) -> None:
    """Reject a comparison with a scenario or planner that no run is of."""
    for node in ast.walk(condition.tree):
        if not isinstance(node, ast.Compare):
            continue
        parts = [node.left, *node.comparators]
        names = [part.id for part in parts if isinstance(part, ast.Name)]
        texts = [part.value for part in parts if isinstance(part, ast.Constant)]
        for key in there.keys() & set(names):
            for text in texts:
                if text not in there[key]:
                    hint = unknown_name(str(text), sorted(there[key]))
                    problem = f"no run is of {key} {text!r}; {hint}"
                    raise _error(condition.text, problem)


class _AllLostError(Exception):
    """A figure is asked for of runs that are all lost."""


@dataclass(slots=True)
class _Reading:
    """Evaluates a checked condition on the runs of one scenario and planner."""

    text: str
    rows: Sequence[Row]
    scenario: str
    planner: str
    seen: dict[str, Value] = field(default_factory=dict)

    def value(self, node: ast.expr) -> Value:
        """Evaluate a node."""
        match node:
            case ast.Constant(value=str() | int() | float() as value):
                return value if isinstance(value, str) else float(value)
            case ast.Name(id=name):
                return self._figure("mean", name)
            case ast.Call(func=ast.Name(id=name), args=[ast.Name(id=of)]):
                return self._figure(name, of)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -float(self.value(operand))
            case ast.BinOp(left=left, op=op, right=right):
                return self._arithmetic(left, op, right)
            case _:
                return self._truth(node)

    def _truth(self, node: ast.expr) -> bool:
        """Evaluate a node that is true or false."""
        match node:
            case ast.BoolOp(op=ast.And(), values=values):
                return all(self.value(part) for part in values)
            case ast.BoolOp(values=values):
                return any(self.value(part) for part in values)
            case ast.UnaryOp(operand=operand):
                return not self.value(operand)
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self._comparison(left, ops, others)
            case _:  # pragma: no cover - refused by `_check`
                raise AssertionError(ast.dump(node))

    def _arithmetic(self, left: ast.expr, op: ast.operator, right: ast.expr) -> float:
        """Evaluate a sum, difference, product or quotient."""
        one, other = float(self.value(left)), float(self.value(right))
        try:
            return _ARITHMETIC[type(op)](one, other)
        except ZeroDivisionError as error:
            raise _error(self.text, f"divides by zero for {self._who}") from error

    def _comparison(
        self, left: ast.expr, ops: Sequence[ast.cmpop], others: Sequence[ast.expr]
    ) -> bool:
        """Evaluate a comparison, also a chained one."""
        one = self.value(left)
        for op, node in zip(ops, others, strict=True):
            other = self.value(node)
            if not _COMPARISONS[type(op)](one, other):
                return False
            one = other
        return True

    def _figure(self, aggregate: str, name: str) -> Value:
        """Compute a figure of a metric, and remember it for the message."""
        shown = name if aggregate == "mean" else f"{aggregate}({name})"
        found = self._compute(aggregate, name)
        self.seen[shown] = found
        return found

    def _compute(self, aggregate: str, name: str) -> Value:
        """Compute a figure of a metric over the runs."""
        if name in _TEXTS:
            return self.scenario if name == columns.SCENARIO else self.planner
        if name == _RUNS:
            return float(len(self.rows))
        if name == _LOST:
            return float(sum(row[FAILURE] is not None for row in self.rows))
        known = [row[name] for row in self.rows if row.get(name) is not None]
        if aggregate == _COUNT:
            return float(len(known))
        if not known and all(row[FAILURE] is not None for row in self.rows):
            raise _AllLostError
        if not known:
            hint = f"allowed: ask count({name}) > 0 and ... first"
            raise _error(self.text, f"{name} applies to no run of {self._who}; {hint}")
        return float(_AGGREGATES[aggregate](np.array(known, dtype=np.float64)))

    @property
    def _who(self) -> str:
        """Name the runs for a message."""
        return f"{self.scenario}, {self.planner}"


def _check(node: ast.expr, text: str) -> None:
    """Raise a ConfigError unless a node and all in it are of the small language."""
    match node:
        case ast.BoolOp(values=parts):
            _check_all(parts, text, conditions=True)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            _check_all([operand], text, conditions=True)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            _check_all([operand], text, conditions=False)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
            _check_all([left, right], text, conditions=False)
        case ast.Compare(left=left, ops=ops, comparators=others):
            _check_compared([left, *others], ops, text)
        case _:
            _check_leaf(node, text)


def _is_finite(value: int) -> bool:
    """Check whether a whole number is one of a computer's numbers."""
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _check_leaf(node: ast.expr, text: str) -> None:
    """Check a number, a text, a metric or a function of one; refuse anything else."""
    match node:
        case ast.Constant(value=bool() | None as value):
            raise _error(text, f"{value} is not allowed; allowed: 1 or 0")
        case ast.Constant(value=int() as value) if not _is_finite(value):
            raise _error(text, "holds a number that is too large")
        case ast.Constant(value=int() | float() | str()):
            return
        case ast.Name(id=name):
            allowed = [*_NUMBERS, _RUNS, _LOST, *_TEXTS]
            if name not in allowed:
                raise _error(text, f"{name}: no such metric; {_few(name, allowed)}")
        case ast.Call(func=ast.Name(id=name), args=[ast.Name(id=of)], keywords=[]):
            functions = [*_AGGREGATES, _COUNT]
            if name not in functions:
                hint = unknown_name(name, functions)
                raise _error(text, f"{name}: no such function; {hint}")
            if of not in _NUMBERS:
                hint = _few(of, list(_NUMBERS))
                raise _error(text, f"{name}({of}): no such metric; {hint}")
        case _:
            raise _error(
                text,
                f"{ast.unparse(node)} is not allowed; allowed: numbers, metrics, "
                "functions of one metric, < <= > >= == !=, and or not, + - * /",
            )


def _check_all(nodes: Sequence[ast.expr], text: str, *, conditions: bool) -> None:
    """Check the parts of an operation: all conditions, or all numbers."""
    for node in nodes:
        _check(node, text)
        if conditions != _is_condition(node) or (not conditions and _is_text(node)):
            wanted = "a condition, such as collisions > 0" if conditions else "a number"
            raise _error(text, f"{ast.unparse(node)}: allowed here: {wanted}")


def _check_compared(
    nodes: Sequence[ast.expr], ops: Sequence[ast.cmpop], text: str
) -> None:
    """Check a comparison: of numbers, or of texts for equality."""
    for node in nodes:
        _check(node, text)
    kinds = [_is_text(node) for node in nodes]
    odd = [op for op in ops if type(op) not in _COMPARISONS]
    unequal = any(kinds) and any(not isinstance(op, ast.Eq | ast.NotEq) for op in ops)
    if odd or unequal or any(map(_is_condition, nodes)) or len(set(kinds)) > 1:
        raise _error(
            text,
            "compares what cannot be compared; allowed: numbers with < <= > >= == !=, "
            'scenario and planner with == or != "name"',
        )


def _is_condition(node: ast.expr) -> bool:
    """Tell whether a node is true or false."""
    negated = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)
    return negated or isinstance(node, ast.BoolOp | ast.Compare)


def _is_text(node: ast.expr) -> bool:
    """Tell whether a node is a text."""
    named = isinstance(node, ast.Name) and node.id in _TEXTS
    return named or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _few(name: str, allowed: list[str]) -> str:
    """Suggest a metric without listing all of them."""
    hint = unknown_name(name, allowed)
    return (
        hint.partition("allowed: ")[0] + "allowed: columns of the results, runs, lost"
    )


def _error(text: str, problem: str) -> ConfigError:
    """Build the error of a condition."""
    return ConfigError(f"--fail-if {text}: {problem}")


def _text(value: Value) -> str:
    """Format a figure."""
    return value if isinstance(value, str) else f"{value:.4g}"
