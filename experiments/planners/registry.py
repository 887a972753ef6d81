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
from experiments.errors import ConfigError, described
from experiments.interrupts import is_interrupt
from experiments.planners.contract_check import CheckedBatchPlanner, watched
from experiments.planners.factory_settings import check_call, check_factory_settings
from experiments.planners.hints import file_hint
from experiments.storage.provenance import PACKAGES
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
_SUMO_DRIVER = "experiments.cosim.sumo.sumo_driver:no_op"
_SUMO_SETTINGS = "experiments.cosim.sumo.driver_settings:SumoDriverSettings"
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
    "route": RegisteredPlanner(
        "planner.route:proposed",
        "planner.route:RouteSettings",
        "one driver for a route: cruises, changes lanes where the route asks for it",
    ),
    "lane_change": RegisteredPlanner(
        "planner.lane_change:proposed",
        "planner.lane_change:LaneChangeSettings",
        "chapter 6 in closed loop: B-spline path, s-T graph, every passing order",
    ),
    "lane_change_area": RegisteredPlanner(
        "planner.lane_change:area",
        "planner.lane_change:LaneChangeSettings",
        "the same with the passing order chosen by its area, as in the thesis",
    ),
    "lane_change_thesis": RegisteredPlanner(
        "planner.lane_change:thesis",
        "planner.lane_change:LaneChangeSettings",
        "the same with speeds planned as chapter 6 is printed, faults included",
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
    "idm_mobil": RegisteredPlanner(
        f"{_DRIVERS}.idm_mobil:idm_mobil",
        f"{_DRIVERS}:IdmMobilSettings",
        "IDM and MOBIL: the usual model of a human driver on lanes, a baseline",
    ),
    "sumo": RegisteredPlanner(
        _SUMO_DRIVER,
        _SUMO_SETTINGS,
        "SUMO's own driver (Krauss, LC2013) in the same traffic: a baseline",
    ),
    "sumo_as_shipped": RegisteredPlanner(
        _SUMO_DRIVER,
        _SUMO_SETTINGS,
        "the same, not told of closures: it knows of stopped vehicles what it sees",
    ),
    "sumo_tuned": RegisteredPlanner(
        _SUMO_DRIVER,
        _SUMO_SETTINGS,
        "the same with the best lane-change parameters on development seeds",
    ),
    "sumo_sublane": RegisteredPlanner(
        _SUMO_DRIVER,
        _SUMO_SETTINGS,
        "the same with SUMO's sublane model (SL2015), for all of the traffic",
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
        check_factory_settings(name, factory, settings)
        return _call(name, factory, **settings)
    require_planner_name(name)
    factory = _load(name)
    check_factory_settings(name, factory, settings)
    made = _call(name, factory, **settings)
    check_call(name, made, "plan", "scene, memory")
    planner = watched(made)
    if isinstance(planner, CheckedBatchPlanner):
        check_call(name, made, "plan_many", "scenes, memories")
    return planner


def require_planner_name(name: str) -> None:
    """Raise ConfigError unless a name is registered, or names a factory of a module."""
    if not isinstance(name, str):
        raise ConfigError(f"planner: {name!r}: is no name; allowed: that of a planner")
    if name not in PLANNERS and ":" not in name:
        known = f"{unknown_name(name, list(PLANNERS))}, module:factory"
        problem = f"no such planner; {file_hint(name) or known}"
        raise ConfigError(f"planner: {name}: {problem}")


def user_module(name: str) -> str | None:
    """Return the module of a user's planner, None for a registered one."""
    if name in PLANNERS:
        return None
    _search_here()
    return name.partition(":")[0]


def require_name_is_free(module_name: str) -> None:
    """Raise ConfigError if a module of the user's has the name of a package of ours."""
    if module_name in PACKAGES:
        raise ConfigError(
            f"planner: the name {module_name} is taken by rearview; allowed: another "
            f"name for the file, such as my_{module_name}.py"
        )


def _search_here() -> None:
    """Search the working folder for planners too."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)


def _call(
    name: str, factory: Callable[..., object], *arguments: object, **settings: Any
) -> Planner:
    """Call the factory and check that it returns a planner."""
    try:
        made = factory(*arguments, **settings)
    except (TypeError, ValueError, PlannerError) as error:
        text = described(error).partition(": ")[2] or described(error)
        problem = f"{name} refuses its settings: {text}"
        raise ConfigError(f"planner.settings: {problem}") from error
    except BaseException as error:  # a user's factory may raise anything
        if is_interrupt(error):
            raise
        raise ConfigError(f"planner: {name} raises {described(error)}") from error
    if not _has_plan(made):
        raise ConfigError(
            f"planner: {name} returned {type(made).__name__}; allowed: an object with "
            "plan(scene, memory)"
        )
    return cast(Planner, made)


def _has_plan(made: object) -> bool:
    """Check for a method `plan`; asking for it may raise anything."""
    try:
        return callable(getattr(made, "plan", None))
    except BaseException as error:
        if is_interrupt(error):
            raise
        return False


def _load(address: str) -> Any:
    """Import `module:attribute`."""
    module_name, _, attribute = address.partition(":")
    if not module_name or not attribute:
        raise ConfigError(f"planner: {address}: allowed: module:factory")
    module = _import(address, module_name)
    try:
        loaded = getattr(module, attribute)
    except AttributeError:
        own = _own_callables(module)
        hint = unknown_name(attribute, own) if own else "it defines no function"
        raise ConfigError(
            f"planner: {address}: {module_name} has no {attribute}; {hint}"
        ) from None
    if not callable(loaded):
        raise ConfigError(
            f"planner: {address}: {attribute} is of type {type(loaded).__name__}; "
            "allowed: a function or class that makes a planner"
        )
    return loaded


def _import(address: str, module_name: str) -> ModuleType:
    """Import a module, from the working folder too."""
    parts = module_name.split(".")
    if parts[-1] == "py" or not all(part.isidentifier() for part in parts):
        hint = file_hint(address)
        raise ConfigError(
            f"planner: {address}: {module_name} is not a module name; "
            + (hint or "allowed: a name as after import, without folder and .py")
        )
    require_name_is_free(module_name)
    _search_here()
    try:
        return importlib.import_module(module_name)
    except ImportError as error:
        raise ConfigError(
            f"planner: {address}: cannot import {module_name}: "
            f"{described(error).partition(': ')[2]}"
        ) from error
    except BaseException as error:  # a user's module may raise anything
        if is_interrupt(error):
            raise
        raise ConfigError(
            f"planner: {address}: importing {module_name} raises {described(error)}"
        ) from error


def _own_callables(module: ModuleType) -> list[str]:
    """List the callables that a module defines itself."""
    return [
        name
        for name, value in vars(module).items()
        if callable(value) and getattr(value, "__module__", "") == module.__name__
    ]


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
