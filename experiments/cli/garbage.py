"""How often garbage is looked for."""

import gc

NEW_OBJECTS = 50_000  # after which it is, instead of after 700


def look_for_garbage_less_often() -> None:
    """Raise the threshold: records and modules are many, and few of them cycles."""
    gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])
