"""Settings against the parameters of a planner's factory, in a user's words."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError

_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


def check_factory_settings(
    name: str, factory: Callable[..., object], settings: Mapping[str, Any]
) -> None:
    """Check the keys of settings that are passed to a factory as keyword arguments.

    Args:
        name: Of the planner.
        factory: Makes it.
        settings: Of the scenario.

    Raises:
        ConfigError: If a key is not a parameter of the factory, or one is missing.
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
