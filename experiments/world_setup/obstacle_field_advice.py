"""What to ask for instead of a field of obstacles that is not possible.

Chance decides whether a field has room: what is advised was tried with the same seed.
"""

from collections.abc import Callable, Iterator

from experiments.config import ObstacleField
from experiments.world_setup.obstacle_field_course import FieldError

LEAST_RADIUS = 0.1  # that is advised [m]
FEWER = 0.9  # of the obstacles, from try to try


def with_advice(
    error: FieldError, section: ObstacleField, draw: Callable[[ObstacleField], object]
) -> FieldError:
    """Add to an error what is allowed instead.

    Args:
        error: Why the field is not possible; its words already say what is allowed
            where no other value of the key has to be tried.
        section: Asks for the impossible.
        draw: Draws another field from the same seed; raises FieldError.

    Returns:
        The error with a value that was tried.
    """
    for key, value in _candidates(error, section):
        try:
            draw(section.model_copy(update={key: value}))
        except FieldError:
            continue
        shown = list(value) if isinstance(value, tuple) else value
        where = "" if key == error.key else f"{key} = "
        words = f"{error.problem}; allowed: for example {where}{shown}"
        return FieldError(error.key, words)
    if error.tried is None:
        return error
    return FieldError(error.key, f"{error.problem}; nor would less do")


def _candidates(
    error: FieldError, section: ObstacleField
) -> Iterator[tuple[str, int | float | tuple[float, ...]]]:
    """Yield keys and values to try in place of what is not possible."""
    if error.tried is None:
        return
    if error.key == "count":
        number = error.tried
        while number >= 1.0:
            yield "count", int(number)
            number = min(number - 1.0, FEWER * number)
    if error.key == "radii_m":
        radius = min(section.radii_m)
        if len(section.radii_m) > 1:
            yield "radii_m", (radius,)
        while radius > LEAST_RADIUS:
            radius = max(round(radius / 2.0, 2), LEAST_RADIUS)
            yield "radii_m", (radius,)
    most = error.tried if error.key == "course_margin_m" else section.course_margin_m
    for margin in (most, most / 2.0, most / 4.0, 0.0):
        if 0.0 <= margin < section.course_margin_m:
            yield "course_margin_m", round(margin, 2)
