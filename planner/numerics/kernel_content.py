"""What compiled code is made of: the functions and constants that it reaches."""

import hashlib
import math
import sys
from collections.abc import Iterator
from enum import Enum
from functools import lru_cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core import types

from planner.numerics.linking import Kernel

_RELEASED = sys.stdlib_module_names | {"numpy", "numba"}  # not our sources
_PLAIN = (int, float, complex, str, bytes, type(None), type(Ellipsis), np.generic)


class UnknownContentError(Exception):
    """Code uses something of which it is not known when it has changed."""


def content(kernel: Kernel) -> tuple[str, ...]:
    """Describe everything that the machine code of a function depends on.

    Two functions with equal descriptions do the same. Comments, docstrings and
    annotations do not count.

    Raises:
        UnknownContentError: If it uses an object of an unknown kind.
    """
    found: dict[int, str] = {}
    waiting: list[FunctionType] = [kernel.py_func]
    while waiting:
        function = waiting.pop()
        if id(function) not in found:
            found[id(function)], called = _function(function)
            waiting.extend(called)
    return tuple(sorted(found.values()))


def type_content(kind: Any) -> str:
    """Describe the type of an argument, with the fields of its records.

    Raises:
        UnknownContentError: If it is a function that is not known.
    """
    if isinstance(kind, types.Dispatcher):
        return f"function {content(kind.dispatcher)}"
    if isinstance(kind, types.containers.BaseTuple):
        inside = ", ".join(map(type_content, kind))
        record = getattr(kind, "instance_class", None)
        return f"{_record(record) if record else 'tuple'}({inside})"
    if isinstance(kind, types.EnumMember):
        return _enum(kind.instance_class)
    return str(kind)


@lru_cache(maxsize=1024)
def _function(function: FunctionType) -> tuple[str, tuple[FunctionType, ...]]:
    """Describe one function; return it with the functions that it calls."""
    called: list[FunctionType] = []
    words = [function.__module__, function.__qualname__]
    words += _code(function.__code__, function.__doc__)
    words += [_value(function.__defaults__, called)]
    words += [_value(tuple((function.__kwdefaults__ or {}).items()), called)]
    for cell in function.__closure__ or ():
        words.append(_value(cell.cell_contents, called))
    for name, value in _globals(function):
        words.append(f"{name} = {_value(value, called)}")
    return hashlib.sha256("\0".join(words).encode()).hexdigest(), tuple(called)


def _code(code: CodeType, docstring: str | None = None) -> Iterator[str]:
    """Describe bytecode."""
    yield hashlib.sha256(code.co_code + code.co_exceptiontable).hexdigest()
    for names in (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars):
        yield repr(names)
    yield repr((code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount))
    yield repr(code.co_flags)
    for i, constant in enumerate(code.co_consts):
        if isinstance(constant, CodeType):
            yield from _code(constant)
        elif isinstance(constant, frozenset):
            yield repr(sorted(map(repr, constant)))
        elif i > 0 or docstring is None or constant != docstring:
            yield repr(constant)


def _names(code: CodeType) -> set[str]:
    """Collect the names that code and the functions inside it look up."""
    inside = [c for c in code.co_consts if isinstance(c, CodeType)]
    return set(code.co_names).union(*map(_names, inside))


def _globals(function: FunctionType) -> Iterator[tuple[str, object]]:
    """Find what the names of a function mean, also those of modules of ours."""
    names = sorted(_names(function.__code__))
    for name in names:
        if name not in function.__globals__:
            continue  # a builtin, or an attribute
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, ModuleType) and not _is_released(value.__name__):
            for attribute in names:
                if hasattr(value, attribute):
                    yield f"{name}.{attribute}", getattr(value, attribute)


def _is_released(module: str | None) -> bool:
    """Check whether a module changes only with its release."""
    return str(module).partition(".")[0] in _RELEASED


def _value(value: object, called: list[FunctionType]) -> str:
    """Describe a constant, or name a function and note it as called.

    Raises:
        UnknownContentError: If its kind is unknown.
    """
    if isinstance(value, Kernel | FunctionType):
        function = value.py_func if isinstance(value, Kernel) else value
        if not _is_released(function.__module__):
            called.append(function)
        options = sorted(getattr(value, "targetoptions", {}).items())
        return f"{function.__module__}.{function.__qualname__} {options}"
    if isinstance(value, Enum):
        return f"{_enum(type(value))}.{value.name}"
    if isinstance(value, tuple):
        kind = _record(type(value)) if hasattr(value, "_fields") else "tuple"
        return f"{kind}({', '.join(_value(each, called) for each in value)})"
    if isinstance(value, np.ndarray):
        data = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return f"{value.dtype.str} {value.shape} {value.strides} {data}"
    if isinstance(value, _PLAIN):
        nan = isinstance(value, float) and math.isnan(value)
        return "nan" if nan else f"{type(value).__name__} {value!r}"
    return _named(value)


def _named(value: object) -> str:
    """Describe what has a name: modules, classes and functions of a release.

    Raises:
        UnknownContentError: If its kind is unknown.
    """
    if isinstance(value, ModuleType):
        return f"module {value.__name__}"
    if isinstance(value, type) and issubclass(value, Enum):
        return _enum(value)
    if isinstance(value, type) and hasattr(value, "_fields"):
        return _record(value)
    module = getattr(value, "__module__", None)
    if isinstance(value, np.ufunc) or _is_released(module):
        return f"{module}.{getattr(value, '__qualname__', value)}"
    raise UnknownContentError(f"{value!r} of type {type(value).__name__}")


def _record(kind: Any) -> str:
    """Describe the class of a named tuple."""
    defaults = repr(kind._field_defaults)
    return f"{kind.__module__}.{kind.__qualname__} {kind._fields} {defaults}"


def _enum(kind: Any) -> str:
    """Describe an enumeration."""
    members = [(name, member.value) for name, member in kind.__members__.items()]
    return f"{kind.__module__}.{kind.__qualname__} {members!r}"
