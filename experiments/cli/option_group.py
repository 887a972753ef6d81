"""Options that belong together, as one argument of a command."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from functools import wraps
from typing import Any, get_type_hints


def with_options(
    name: str, group: type
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make every field of a record an option of a command, which gets the record.

    Args:
        name: Of the command's keyword that takes the record.
        group: Frozen dataclass whose annotated fields are typer's options, each with a
            default.
    """
    hints = get_type_hints(group, include_extras=True)
    options = [
        inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=None if one.default is MISSING else one.default,
            annotation=hints[one.name],
        )
        for one in fields(group)
    ]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def called(*arguments: Any, **given: Any) -> None:
            own = {one.name: given.pop(one.name) for one in options}
            command(*arguments, **given, **{name: group(**own)})

        signature = inspect.signature(command)
        kept = [one for key, one in signature.parameters.items() if key != name]
        parameters = [*kept, *options]
        called.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {
            key: value for key, value in command.__annotations__.items() if key != name
        }
        return called

    return decorate
