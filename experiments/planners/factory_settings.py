"""Settings against the parameters of a planner's factory, in a user's words."""

import inspect
import json
from collections.abc import Callable, Mapping
from typing import Any, get_type_hints

from pydantic import ConfigDict, PydanticUserError, TypeAdapter, ValidationError

from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError

_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def check_factory_settings(
    name: str, factory: Callable[..., object], settings: Mapping[str, Any]
) -> None:
    """Check settings that are passed to a factory as keyword arguments.

    Args:
        name: Of the planner.
        factory: Makes it.
        settings: Of the scenario.

    Raises:
        ConfigError: If a key is not a parameter of the factory, or one is missing, or
            a value is not of the type with which the factory annotates it.
    """
    try:
        parameters = inspect.signature(factory).parameters.values()
    except (TypeError, ValueError):  # not every callable has a signature
        return
    named = [one for one in parameters if one.kind in _NAMED]
    known = [one.name for one in named]
    takes_any = any(one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters)
    unknown = [key for key in settings if key not in known]
    if unknown and not takes_any:
        allowed = unknown_name(unknown[0], known) if known else f"{name} has none"
        raise ConfigError(f"planner.settings.{unknown[0]}: unknown key; {allowed}")
    for one in named:
        if one.default is inspect.Parameter.empty and one.name not in settings:
            raise ConfigError(
                f"planner.settings.{one.name}: is missing; {name} needs it"
            )
    hints = _hints(factory)
    for one in named:
        value = settings.get(one.name, one.default)
        if one.name in hints and value is not one.default:
            _check_type(one.name, value, hints[one.name])


def check_call(name: str, made: object, method: str, arguments: str) -> None:
    """Check that a method of a planner takes the arguments it is called with.

    Args:
        name: Of the planner.
        made: The planner.
        method: Its name.
        arguments: As they are listed: `scene, memory`.

    Raises:
        ConfigError: If it takes fewer, or needs more.
    """
    try:
        signature = inspect.signature(getattr(made, method))
    except (TypeError, ValueError):  # not every callable has a signature
        return
    try:
        signature.bind(*arguments.split(", "))
    except TypeError as error:
        raise ConfigError(
            f"planner: {name}: {method}{signature} does not take what it is called "
            f"with ({error}); allowed: {method}({arguments})"
        ) from error


def _hints(factory: Callable[..., object]) -> Mapping[str, Any]:
    """Return the annotations of a factory's parameters; none if they mean nothing."""
    annotated = factory.__init__ if isinstance(factory, type) else factory  # type: ignore[misc]
    try:
        return get_type_hints(annotated)
    except Exception:  # noqa: BLE001, texts of annotations are evaluated
        return {}


def _check_type(key: str, value: object, hint: Any) -> None:
    """Check one value as it was read from YAML: whole numbers are numbers too."""
    try:
        strict: TypeAdapter[Any] = TypeAdapter(hint, config=ConfigDict(strict=True))
    except PydanticUserError:  # a class of the user's, or one with its own strictness
        return
    try:
        strict.validate_json(json.dumps(value))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(("planner", "settings", key, *map(str, first["loc"])))
        problem = first["msg"]
        raise ConfigError(
            f"{place}: is {first['input']!r}; {problem[:1].lower()}{problem[1:]}"
        ) from error
    except TypeError:  # a date, which JSON does not know
        return
