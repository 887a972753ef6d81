"""The reference drivers by name, as the picture and the tables list them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from experiments.errors import ConfigError
from planner.reference_drivers import (
    CarefulHuman,
    FuzzySafety,
    ReferenceDriver,
    Regulation157,
    ResponsibilitySensitiveSafety,
)

CAREFUL_HUMAN: Final = "careful_human"

DRIVERS: Final[Mapping[str, ReferenceDriver]] = MappingProxyType(
    {
        "fuzzy_safety": FuzzySafety(),
        CAREFUL_HUMAN: CarefulHuman(),
        "rss": ResponsibilitySensitiveSafety(),
        "regulation_157": Regulation157(),
    }
)
TITLES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "fuzzy_safety": "fuzzy safety model",
        CAREFUL_HUMAN: "careful human",
        "rss": "RSS",
        "regulation_157": "regulation 5.2.5.2",
    }
)


def driver(name: str) -> ReferenceDriver:
    """Return the reference driver of a name.

    Raises:
        ConfigError: If there is none of that name.
    """
    if name not in DRIVERS:
        raise ConfigError(
            f"{name!r} is not a reference driver; allowed: {', '.join(DRIVERS)}"
        )
    return DRIVERS[name]
