"""The reference drivers by name, as the picture and the tables list them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from experiments.errors import ConfigError
from experiments.evidence.r157.grids import ConflictKind
from planner.reference_drivers import (
    CarefulHuman,
    FuzzySafety,
    ReferenceDriver,
    Regulation157,
    ResponsibilitySensitiveSafety,
)
from planner.reference_drivers.careful_human import Trigger

ANY_TIME: Final = 1e9  # [s]
CAREFUL_HUMAN: Final = "careful_human"

DRIVERS: Final[Mapping[str, ReferenceDriver]] = MappingProxyType(
    {
        "fuzzy_safety": FuzzySafety(),
        CAREFUL_HUMAN: CarefulHuman(),
        "rss": ResponsibilitySensitiveSafety(),
        "regulation_157": Regulation157(),
    }
)
# A leader that brakes, or a standing vehicle that comes into view, is a danger once the
# gap to it shrinks, however long the time to the collision. The formula of 5.2.5.2 is
# one for cut-ins only.
LEADER_DRIVERS: Final[Mapping[str, ReferenceDriver]] = MappingProxyType(
    {
        "fuzzy_safety": FuzzySafety(),
        CAREFUL_HUMAN: CarefulHuman(Trigger.CLOSING, critical_time=ANY_TIME),
        "rss": ResponsibilitySensitiveSafety(),
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


def drivers_of(kind: ConflictKind) -> Mapping[str, ReferenceDriver]:
    """Return the reference drivers of a kind of conflict."""
    return DRIVERS if kind is ConflictKind.CUT_IN else LEADER_DRIVERS
