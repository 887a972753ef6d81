"""Registered planners by name, and users' planners as `module:factory`."""

import importlib
import json
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from pydantic import ConfigDict, TypeAdapter, ValidationError

from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.planners.contract_check import CheckedPlanner
from planner.errors import PlannerError
from planner.interface import Planner


@dataclass(frozen=True, slots=True)
class RegisteredPlanner:
    """A planner of this project: its factory, settings and purpose."""

    factory: str  # module:function
    settings: str | None  # module:frozen dataclass that the factory takes
    purpose: str


# What the words of a settings class say before what is allowed.
_DEMAND = re.compile(r"[;,] allowed: |\bmust (?:be |lie )?")

_DRIVERS = "planner.reference_drivers"
_CRUISE_SETTINGS = "planner.cruise.settings:CruiseSettings"

PLANNERS: Mapping[str, RegisteredPlanner] = {
    "cruise": RegisteredPlanner(
        "planner.cruise:proposed",
        _CRUISE_SETTINGS,
        "Frenet sampling with the proposed costs of chapter 4, made for closed loop",
    ),
    "cruise_conventional": RegisteredPlanner(
        "planner.cruise:conventional",
        _CRUISE_SETTINGS,
        "the same sampling with the conventional costs",
    ),
    "lane_change": RegisteredPlanner(
        "planner.lane_change:proposed",
        "planner.lane_change:LaneChangeSettings",
        "chapter 6 in closed loop: B-spline path, s-T graph, every passing order",
    ),
    "lane_change_thesis": RegisteredPlanner(
        "planner.lane_change:thesis",
        "planner.lane_change:LaneChangeSettings",
        "the same with the passing order chosen by its area, as in the thesis",
    ),
    "lane_change_dp": RegisteredPlanner(
        "planner.lane_change:conventional",
        "planner.lane_change:LaneChangeSettings",
        "the same with the passing order searched on a grid: DP&QP",
    ),
    "dense": RegisteredPlanner(
        "planner.dense:proposed",
        "planner.dense:DenseSettings",
        "dense obstacles: the sides on which they are passed, one program each",
    ),
    "dense_adaptive": RegisteredPlanner(
        "planner.dense:adaptive",
        "planner.dense:DenseSettings",
        "dense obstacles by the adaptive lattice of chapter 5",
    ),
    "dense_uniform": RegisteredPlanner(
        "planner.dense:uniform",
        "planner.dense:DenseSettings",
        "dense obstacles by the conventional, uniform lattice",
    ),
    "careful_human": RegisteredPlanner(
        f"{_DRIVERS}.braking_planner:careful_human",
        f"{_DRIVERS}:CarefulHuman",
        "competent careful human of UN Regulation 157: holds its speed, brakes late",
    ),
    "regulation_157": RegisteredPlanner(
        f"{_DRIVERS}.braking_planner:regulation_157",
        f"{_DRIVERS}:Regulation157",
        "the same with the formula of 5.2.5.2, which is for cut-ins only",
    ),
    "rss": RegisteredPlanner(
        f"{_DRIVERS}.braking_planner:rss",
        f"{_DRIVERS}:ResponsibilitySensitiveSafety",
        "the same with the safe distances of Responsibility Sensitive Safety",
    ),
    "fuzzy_safety": RegisteredPlanner(
        f"{_DRIVERS}.braking_planner:fuzzy_safety",
        f"{_DRIVERS}:FuzzySafety",
        "the same with the fuzzy safety model: brakes in anticipation",
    ),
    "sumo": RegisteredPlanner(
        "experiments.cosim.sumo.sumo_driver:no_op",
        None,
        "SUMO's own driver (Krauss, LC2013) in the same traffic: a baseline",
    ),
    "cruise_thesis": RegisteredPlanner(
        "planner.cruise:thesis_proposed",
        None,
        "chapter 4 as printed: 231 candidates, static obstacles, proposed costs",
    ),
    "cruise_thesis_conventional": RegisteredPlanner(
        "planner.cruise:thesis_conventional",
        None,
        "chapter 4 as printed, conventional costs",
    ),
}


def make_planner(name: str, settings: Mapping[str, Any]) -> Planner:
    """Create a planner.

    Args:
        name: A name of `PLANNERS`, or `module:factory` of one's own; the module is
            looked for in the working folder too.
        settings: Keyword arguments of the factory; those of this project's planners
            are checked against their settings class.

    Returns:
        The planner.

    Raises:
        ConfigError: If there is no such planner or it does not take these settings.
    """
    if name in PLANNERS:
        registered = PLANNERS[name]
        factory = _load(registered.factory)
        if registered.settings is not None and settings:
            return _call(name, factory, _checked(settings, _load(registered.settings)))
        return _call(name, factory, **settings)
    if ":" not in name:
        hint = unknown_name(name, list(PLANNERS))
        raise ConfigError(f"planner: {name}: no such planner; {hint}, module:factory")
    return CheckedPlanner(_call(name, _load(name), **settings))


def user_module(name: str) -> str | None:
    """Return the module of a user's planner, None for a registered one."""
    return None if name in PLANNERS else name.partition(":")[0]


def _call(
    name: str, factory: Callable[..., object], *arguments: object, **settings: Any
) -> Planner:
    """Call the factory and check that it returns a planner."""
    try:
        made = factory(*arguments, **settings)
    except (TypeError, ValueError, PlannerError) as error:
        problem = f"{name} refuses its settings: {error}"
        raise ConfigError(f"planner.settings: {problem}") from error
    except (Exception, SystemExit) as error:  # a user's factory may raise anything
        raise ConfigError(f"planner: {name} raises {_shown(error)}") from error
    if not callable(getattr(made, "plan", None)):
        raise ConfigError(
            f"planner: {name} gave a {type(made).__name__}; allowed: an object with "
            "plan(scene, memory)"
        )
    return cast(Planner, made)


def _load(address: str) -> Any:
    """Import `module:attribute`."""
    module_name, _, attribute = address.partition(":")
    if not module_name or not attribute:
        raise ConfigError(f"planner: {address}: allowed: module:factory")
    module = _import(address, module_name)
    try:
        loaded = getattr(module, attribute)
    except AttributeError:
        raise ConfigError(
            f"planner: {address}: {module_name} has no {attribute}; "
            f"{unknown_name(attribute, _own_callables(module))}"
        ) from None
    if not callable(loaded):
        raise ConfigError(
            f"planner: {address}: {attribute} is a {type(loaded).__name__}; allowed: "
            "a function or class that makes a planner"
        )
    return loaded


def _import(address: str, module_name: str) -> ModuleType:
    """Import a module, from the working folder too."""
    parts = module_name.split(".")
    if parts[-1] == "py" or not all(part.isidentifier() for part in parts):
        raise ConfigError(
            f"planner: {address}: {module_name} is not a module name; allowed: a name "
            "as after import, without folder and .py"
        )
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        return importlib.import_module(module_name)
    except ImportError as error:
        raise ConfigError(
            f"planner: {address}: cannot import {module_name}: {error}"
        ) from error
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        raise ConfigError(
            f"planner: {address}: importing {module_name} raises {_shown(error)}"
        ) from error


def _own_callables(module: ModuleType) -> list[str]:
    """List the callables that a module defines itself."""
    return [
        name
        for name, value in vars(module).items()
        if callable(value) and getattr(value, "__module__", "") == module.__name__
    ]


def _shown(error: BaseException) -> str:
    """Format an error of a user's code in one line."""
    return f"{type(error).__name__}: {error}"


def _checked(settings: Mapping[str, Any], schema: type) -> object:
    """Validate settings against a frozen dataclass and create it."""
    adapter = _adapter(schema)
    try:
        # JSON mode: names become enum members and lists tuples, and nothing else
        checked = adapter.validate_json(json.dumps(settings))
    except ValidationError as error:
        raise ConfigError(_setting_problem(error, adapter.json_schema())) from error
    return schema(**{key: getattr(checked, key) for key in settings})


@cache
def _adapter(schema: type) -> TypeAdapter[Any]:
    """Build the strict validator of a dataclass, which takes 50 ms."""
    strict = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid")
    body = {"__slots__": (), "__pydantic_config__": strict}
    return TypeAdapter(type(schema.__name__, (schema,), body))


def _setting_problem(error: ValidationError, schema: Mapping[str, Any]) -> str:
    """Describe the first invalid setting."""
    first = error.errors(include_url=False)[0]
    key = ".".join(("planner", "settings", *(str(part) for part in first["loc"])))
    if first["type"] == "unexpected_keyword_argument":
        *section, name = first["loc"]
        allowed = list(schema["properties"])
        if section:
            owner = str(schema["properties"][section[0]].get("$ref", ""))
            allowed = list(schema["$defs"][owner.rsplit("/", 1)[1]]["properties"])
        return f"{key}: unknown key; {unknown_name(str(name), allowed)}"
    if first["type"] == "value_error":
        return _refused_value(key, first)
    problem = first["msg"]
    if first["type"] == "dataclass_type":
        problem = "allowed: a section with keys"
    return f"{key}: is {first['input']!r}; {problem[:1].lower()}{problem[1:]}"


def _refused_value(key: str, item: Mapping[str, Any]) -> str:
    """Describe a value that a settings class rejects."""
    problem = str(item["ctx"]["error"])
    section = item["input"]
    name, _, rest = problem.partition(" ")
    if not isinstance(section, dict) or name not in section:
        return f"{key}: {problem}"
    allowed = _DEMAND.split(rest, maxsplit=1)[-1]
    return f"{key}.{name}: is {section[name]!r}; allowed: {allowed}"
