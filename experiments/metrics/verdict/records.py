"""What a verdict is about: the motions before a contact, and who has to yield."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from planner.states import FloatArray


class Fault(StrEnum):
    """Who could have avoided a contact, and had to."""

    EGO = "ego at fault"
    OTHER = "other at fault"
    SHARED = "shared"
    UNAVOIDABLE = "unavoidable"
    ARTEFACT = "artefact of the simulator"


@dataclass(frozen=True, slots=True)
class AvoidanceLimits:
    """What each may be expected to do.

    The ego brakes and swerves as its tyres and its steering allow; another driver
    brakes. Who has had to see the conflict for its reaction time and `leisure` more and
    did nothing is at fault alone; less than the reaction time is no time to act.
    """

    ego_braking: float = 8.0  # [m/s²]
    ego_lateral: float = 4.0  # [m/s²]
    ego_slope: float = 0.4  # lateral over longitudinal speed, at most [-]
    ego_reaction: float = 0.5  # [s]
    other_braking: float = 6.0  # [m/s²]
    other_reaction: float = 1.0  # [s]
    leisure: float = 1.0  # [s]


USUAL_LIMITS: Final = AvoidanceLimits()


@dataclass(frozen=True, slots=True, eq=False)
class BodyTrack:
    """A rectangle in every step; arrays are (n_steps,), NaN where it is not there."""

    x: FloatArray  # centre [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    speed: FloatArray  # along the heading [m/s]
    acceleration: FloatArray  # [m/s²]
    length: float  # [m]
    width: float  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class ContactCase:
    """The steps up to the contact, which is in the last one.

    `ego`, `other` and `bystanders` lie in one plane, that of the ego's path where all
    have a place there. `left` and `right` are how far the ego's body may shift without
    leaving its road, (n_steps,). `yields` says who has to let the other go first.
    """

    step: float  # [s]
    ego: BodyTrack
    other: BodyTrack
    left: FloatArray  # [m]
    right: FloatArray
    bystanders: tuple[BodyTrack, ...] = ()
    standing: bool = False  # the other is an obstacle, not a vehicle
    yields: str = ""  # ego, other, or empty where nobody has to
    plane: tuple[BodyTrack, ...] = field(default=())  # the other as it is on the map


@dataclass(frozen=True, slots=True)
class ContactVerdict:
    """The verdict of a contact.

    `step` is the last step in which anyone could still avoid it; `last_ego` and
    `last_other` are those of each, None where it never could.
    """

    fault: Fault
    step: int
    why: str  # a few words
    last_ego: int | None = None
    last_other: int | None = None

    @property
    def is_avoidable(self) -> bool:
        """Whether either could ever avoid it."""
        return self.last_ego is not None or self.last_other is not None
