"""Parameters of the cruise planner, with the presets of [Thesis] ch. 4."""

import math
from dataclasses import dataclass, fields
from enum import StrEnum

from planner.errors import InvalidInputError
from planner.states import store_floats


class LateralMotion(StrEnum):
    """Variable of the lateral quintic."""

    TIME = "time"  # l(t), as in [Thesis] 4.3; undefined at a standstill
    DISTANCE = "distance"  # l(s), well defined at every speed


class SafetyTerm(StrEnum):
    """How nearness to bodies is priced."""

    EDGE_CLEARANCE = "edge_clearance"  # additive, on the distance to each body's edge
    SIZE_CONVOLUTION = "size_convolution"  # [Thesis] 4.16-4.19
    BINARY_CONVOLUTION = "binary_convolution"  # the conventional method [100]


class Normalisation(StrEnum):
    """How terms of different units are made comparable."""

    FIXED_SCALES = "fixed_scales"  # physical scales, the same in every cycle
    PER_CYCLE = "per_cycle"  # each term over its maximum among the feasible


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of the cost terms, [-]; zero switches a term off."""

    jerk: float = 0.4
    safety: float = 1.0
    offset: float = 0.3
    speed: float = 4.0
    headway: float = 6.0
    consistency: float = 0.3
    heading: float = 5.0
    dead_end: float = 12.0
    lane: float = 0.5

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


@dataclass(frozen=True, slots=True)
class Scales:
    """Physical scales: a term at its scale costs its weight."""

    jerk: float = 4.0  # mean squared jerk of a lively manoeuvre [m²/s⁶]
    offset: float = 4.0  # mean squared offset: 2 m aside [m²]
    clearance: float = 1.5  # edge distance from which a body costs nothing [m]
    consistency: float = 1.0  # mean squared change of the plan's offset [m²]
    lane: float = 1.0  # squared distance from the middle of a lane [m²]
    heading: float = 1.0  # squared sine of the heading error where the plan ends [-]

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


@dataclass(frozen=True, slots=True)
class ComfortLimits:
    """What a passenger finds comfortable; inf is no limit.

    Candidates within them are preferred to all others: only where none is left, or
    none gets on, the limits of the vehicle count.
    """

    lateral_acceleration: float = 2.2  # [m/s²]
    lateral_jerk: float = 5.0  # [m/s³]
    deceleration: float = 3.5  # [m/s²]
    jerk: float = 4.0  # along the path [m/s³]

    def __post_init__(self) -> None:
        """Store whole numbers as floats; refuse limits that nothing can keep."""
        store_floats(self)
        for field in fields(self):
            if not getattr(self, field.name) > 0.0:
                value = getattr(self, field.name)
                raise InvalidInputError(f"comfort.{field.name} = {value} must be > 0")

    @property
    def is_limiting(self) -> bool:
        """Whether any of them is finite."""
        return any(math.isfinite(getattr(self, field.name)) for field in fields(self))

    @classmethod
    def none(cls) -> "ComfortLimits":
        """Return no limits at all."""
        return cls(math.inf, math.inf, math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class CruiseSettings:
    """Everything that can be set; the defaults are for the closed loop."""

    lateral_motion: LateralMotion = LateralMotion.DISTANCE
    lateral_step: float = 0.5  # [m]
    lateral_limit: float = 5.0  # largest terminal offset [m]
    edge_offsets: bool = True  # sample the outermost places on the road too
    min_manoeuvre_length: float = 8.0  # of a lateral motion over distance [m]
    min_manoeuvre_speed: float = 2.5  # slower, it is as long as at this speed [m/s]
    starting_lengths: tuple[float, ...] = (16.0, 24.0)  # if none starts [m]
    starting_excess: float = 0.0  # over the road's edge, if only that starts [m]
    times: tuple[float, ...] = (1.5, 3.0, 5.0)  # manoeuvre durations [s]
    speed_fractions: tuple[float, ...] = (0.0, 0.5, 1.0)
    creep_speeds: tuple[float, ...] = (1.0, 2.0)  # to get out of a jam [m/s]
    stop_times: tuple[float, ...] = (2.0, 3.0, 4.5, 6.0, 8.0)  # [s]
    follow_times: tuple[float, ...] = (2.0, 3.5, 5.0)  # [s]
    drive_fractions: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0)  # see `sampling`
    drive_times: tuple[float, ...] = (4.0,)  # of their lateral motions [s]
    horizon: float = 5.0  # [s]; 0 ends each candidate with its manoeuvre
    step: float = 0.1  # between trajectory points [s]

    lead_long_bodies: bool = True  # by their front axle, with `cover_discs: 3`
    cover_discs: int = 3  # 3 cover the rectangle, 1 is the thesis' disc at the axle
    single_disc_radius: float = 1.0  # r_car of Table 4.1, used by one disc [m]
    margin: float = 0.3  # clearance that every candidate keeps [m]
    road_margin: float = 0.1  # between the body and the road's edge [m]
    max_curvature: float | None = None  # None: the vehicle's limit [1/m]
    max_lateral_acceleration: float | None = None  # None: the vehicle's limit [m/s²]
    max_deceleration: float | None = None  # None: the vehicle's limit [m/s²]
    comfort: ComfortLimits = ComfortLimits()
    comfort_lateral_acceleration: float = 2.0  # sets the speed in curves [m/s²]
    comfort_deceleration: float = 1.5  # with which curves are approached [m/s²]
    stop_gap: float = 1.0  # front bumper to stop line [m]
    standstill_gap: float = 8.0  # front bumper to a standing leader, to steer round [m]
    obstacle_gap: float = 8.0  # before what stands, to be able to steer round it [m]
    time_headway: float = 1.2  # [s]
    rear_time_headway: float = 0.8  # left to a vehicle behind in a lane entered [s]

    safety_term: SafetyTerm = SafetyTerm.EDGE_CLEARANCE
    convolution_sigma: float = 1.0  # [m]
    normalisation: Normalisation = Normalisation.FIXED_SCALES
    weights: Weights = Weights()
    scales: Scales = Scales()

    def __post_init__(self) -> None:
        """Refuse what cannot be sampled."""
        store_floats(self)
        positive = ("lateral_step", "min_manoeuvre_length", "step", "time_headway")
        for name in (*positive, "convolution_sigma", "comfort_lateral_acceleration"):
            if not getattr(self, name) > 0.0:
                raise InvalidInputError(f"{name} = {getattr(self, name)} must be > 0")
        gaps = ("margin", "road_margin", "stop_gap", "standstill_gap")
        for name in (*gaps, "starting_excess", "horizon"):
            if not getattr(self, name) >= 0.0:
                raise InvalidInputError(f"{name} = {getattr(self, name)} must be >= 0")
        times = (*self.times, *self.stop_times, *self.follow_times)
        if not self.times or min(times) < self.step:
            raise InvalidInputError(f"times = {times} must be at least {self.step} s")
        if not self.speed_fractions or not all(
            0.0 <= fraction <= 1.0 for fraction in self.speed_fractions
        ):
            raise InvalidInputError("speed_fractions must lie in 0 ... 1")
        if self.cover_discs not in (1, 3):
            raise InvalidInputError(f"cover_discs = {self.cover_discs}, allowed: 1, 3")
        if self.horizon and self.horizon < max(self.times):
            raise InvalidInputError(
                f"horizon = {self.horizon} must be 0 or at least {max(self.times)}"
            )

    @property
    def n_steps(self) -> int:
        """Points of the longest candidate."""
        times = (*self.times, *self.stop_times, *self.follow_times)
        return round((self.horizon or max(times)) / self.step) + 1


def thesis_settings(safety_term: SafetyTerm, weights: Weights) -> CruiseSettings:
    """Make the printed set-up: Table 4.1 with the readings of planner/README.md.

    231 candidates: T = 4.0, 4.1 ... 5.0 s times l = -5.0, -4.5 ... 5.0 m, one target
    speed, one disc of 1 m, terms over their maximum per cycle.
    """
    binary = safety_term is SafetyTerm.BINARY_CONVOLUTION
    return CruiseSettings(
        lateral_motion=LateralMotion.TIME,
        times=tuple(round(4.0 + 0.1 * k, 1) for k in range(11)),
        edge_offsets=False,
        starting_lengths=(),
        speed_fractions=(1.0,),
        creep_speeds=(),
        stop_times=(),
        follow_times=(),
        horizon=0.0,
        cover_discs=1,
        margin=0.0,
        road_margin=0.0,
        max_curvature=0.5,
        max_lateral_acceleration=math.inf,
        max_deceleration=3.0,
        comfort=ComfortLimits.none(),
        drive_fractions=(),
        comfort_lateral_acceleration=math.inf,
        safety_term=safety_term,
        convolution_sigma=2.0 if binary else 1.0,
        normalisation=Normalisation.PER_CYCLE,
        weights=weights,
    )
