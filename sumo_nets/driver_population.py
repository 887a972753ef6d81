"""Populations of drivers: each driver is drawn from distributions of its own.

A mix of tempers has three kinds of drivers; here no two are alike. The car-following
parameters of `motorway` lie in the ranges fitted to trajectories on motorways (Treiber
and Kesting, Traffic Flow Dynamics, 2013, and Kesting and Treiber, TRR 2088, 2008, who
find 11 to 29 % error between drivers of one model); those of `krauss_default` are
SUMO's own. `urban`, `calm` and `aggressive` are assumptions around them: shorter or
longer gaps, lower or higher wished speeds. `distracted` is `urban` with drivers who
look away now and then.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from types import MappingProxyType

import numpy as np

from sumo_nets.vehicle_types import KINDS, LOWEST_FACTOR

REFERENCE_ACCEL = KINDS["car"].accel  # that the populations are given for [m/s²]
REFERENCE_DECEL = KINDS["car"].decel  # [m/s²]
SLOWEST_REACTION = 1.5  # of a driver who looks away altogether [s]


@dataclass(frozen=True, slots=True)
class Spread:
    """A normal distribution between two bounds."""

    mean: float
    deviation: float
    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a value with one random number."""
        u = rng.random()
        if self.deviation == 0.0:
            return self.mean
        normal = NormalDist(self.mean, self.deviation)
        below, above = normal.cdf(self.low), normal.cdf(self.high)
        drawn = normal.inv_cdf(below + u * (above - below))
        return min(max(drawn, self.low), self.high)


def _always(value: float) -> Spread:
    """Return the distribution of a constant."""
    return Spread(value, 0.0, value, value)


@dataclass(frozen=True, slots=True)
class Glances:
    """How drivers look away; between glances they are as aware as anybody."""

    share: float  # of drivers who do so
    per_minute: float  # mean number; the gaps between glances are exponential
    shortest: float  # [s]
    longest: float  # [s]
    awareness: float  # while away, SUMO's driver state in (0, 1]


@dataclass(frozen=True, slots=True)
class Population:
    """Distributions that drivers are drawn from; cars, other kinds are scaled."""

    models: tuple[tuple[str, float], ...]  # SUMO's car-following models and shares
    tau: Spread  # wished time gap [s]
    min_gap: Spread  # at standstill [m]
    factor: Spread  # wished speed over speed limit [-]
    accel: Spread  # [m/s²]
    decel: Spread  # comfortable braking [m/s²]
    sigma: Spread  # Krauss: imperfection in [0, 1]
    assertive: Spread  # accepted gaps shrink by it when changing lanes [-]
    speed_gain: Spread  # eagerness to change lanes to go faster [-]
    cooperative: Spread  # willingness to change lanes for others, in [0, 1]
    impatience: Spread  # at junctions, in [0, 1]
    glances: Glances | None = None


_URBAN = Population(
    models=(("Krauss", 0.3), ("IDM", 0.4), ("EIDM", 0.3)),
    tau=Spread(1.3, 0.35, 0.7, 2.2),
    min_gap=Spread(2.0, 0.5, 1.2, 3.5),
    factor=Spread(1.0, 0.1, 0.8, 1.25),
    accel=Spread(2.0, 0.4, 1.2, 2.8),
    decel=Spread(2.8, 0.6, 1.6, 4.5),
    sigma=Spread(0.4, 0.15, 0.0, 0.8),
    assertive=Spread(1.0, 0.2, 0.6, 1.6),
    speed_gain=Spread(1.0, 0.4, 0.3, 2.0),
    cooperative=Spread(0.7, 0.25, 0.0, 1.0),
    impatience=Spread(0.2, 0.1, 0.0, 0.5),
)

POPULATIONS: Mapping[str, Population] = MappingProxyType(
    {
        "calm": Population(
            models=(("IDM", 0.6), ("EIDM", 0.4)),
            tau=Spread(1.8, 0.3, 1.2, 2.6),
            min_gap=Spread(2.8, 0.5, 2.0, 4.0),
            factor=Spread(0.95, 0.05, 0.8, 1.05),
            accel=Spread(1.5, 0.3, 0.9, 2.1),
            decel=Spread(2.0, 0.4, 1.2, 3.0),
            sigma=_always(0.3),
            assertive=Spread(0.8, 0.1, 0.6, 1.0),
            speed_gain=Spread(0.5, 0.2, 0.1, 1.0),
            cooperative=Spread(0.95, 0.1, 0.6, 1.0),
            impatience=_always(0.0),
        ),
        "urban": _URBAN,
        "motorway": Population(
            models=(("IDM", 0.7), ("EIDM", 0.2), ("ACC", 0.1)),
            tau=Spread(1.1, 0.25, 0.8, 1.6),
            min_gap=Spread(2.0, 0.4, 1.5, 3.0),
            factor=Spread(1.0, 0.12, 0.75, 1.3),
            accel=Spread(1.2, 0.3, 0.7, 1.8),
            decel=Spread(1.7, 0.4, 1.0, 2.5),
            sigma=_always(0.5),
            assertive=Spread(1.0, 0.2, 0.6, 1.6),
            speed_gain=Spread(1.2, 0.5, 0.3, 2.5),
            cooperative=Spread(0.7, 0.25, 0.0, 1.0),
            impatience=Spread(0.1, 0.1, 0.0, 0.4),
        ),
        "distracted": Population(
            models=(("Krauss", 0.4), ("IDM", 0.6)),  # those with a driver state
            tau=_URBAN.tau,
            min_gap=_URBAN.min_gap,
            factor=_URBAN.factor,
            accel=_URBAN.accel,
            decel=_URBAN.decel,
            sigma=_URBAN.sigma,
            assertive=_URBAN.assertive,
            speed_gain=_URBAN.speed_gain,
            cooperative=_URBAN.cooperative,
            impatience=_URBAN.impatience,
            glances=Glances(0.5, 4.0, 1.0, 4.0, 0.2),
        ),
        "aggressive": Population(
            models=(("Krauss", 0.4), ("IDM", 0.4), ("EIDM", 0.2)),
            tau=Spread(0.8, 0.2, 0.4, 1.3),
            min_gap=Spread(1.5, 0.3, 1.0, 2.2),
            factor=Spread(1.15, 0.1, 0.95, 1.4),
            accel=Spread(2.8, 0.4, 2.0, 3.6),
            decel=Spread(4.5, 0.8, 3.0, 6.5),
            sigma=Spread(0.3, 0.1, 0.0, 0.6),
            assertive=Spread(1.8, 0.4, 1.2, 3.0),
            speed_gain=Spread(2.5, 0.8, 1.0, 4.0),
            cooperative=Spread(0.3, 0.2, 0.0, 0.8),
            impatience=Spread(0.6, 0.2, 0.2, 1.0),
        ),
        "krauss_default": Population(
            models=(("Krauss", 1.0),),
            tau=_always(1.0),
            min_gap=_always(2.5),
            factor=Spread(1.0, 0.1, 0.7, 1.4),
            accel=_always(REFERENCE_ACCEL),
            decel=_always(REFERENCE_DECEL),
            sigma=_always(0.5),
            assertive=_always(1.0),
            speed_gain=_always(1.0),
            cooperative=_always(1.0),
            impatience=_always(0.0),
        ),
    }
)


@dataclass(frozen=True, slots=True)
class DrawnType:
    """The vType of one vehicle of a population."""

    id: str
    kind: str
    model: str
    population: str
    tau: float  # [s]
    min_gap: float  # [m]
    factor: float  # [-]
    accel: float  # [m/s²]
    decel: float  # [m/s²]
    sigma: float
    assertive: float
    speed_gain: float
    cooperative: float
    impatience: float
    glances: bool  # whether this driver looks away now and then

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the vType element."""
        kind = KINDS[self.kind]
        attributes = {
            "id": self.id,
            "vClass": "passenger",  # whatever is open to the ego is open to the traffic
            "guiShape": kind.shape,
            "carFollowModel": self.model,
            "length": f"{kind.length:g}",
            "width": f"{kind.width:g}",
            "accel": f"{self.accel:.3f}",
            "decel": f"{self.decel:.3f}",
            "emergencyDecel": f"{kind.emergency_decel:g}",
            "maxSpeed": f"{kind.max_speed:g}",
            "tau": f"{self.tau:.3f}",
            "minGap": f"{self.min_gap:.3f}",
            "speedFactor": f"{self.factor:.3f}",
            "speedDev": "0",
            "lcAssertive": f"{self.assertive:.3f}",
            "lcSpeedGain": f"{self.speed_gain:.3f}",
            "lcCooperative": f"{self.cooperative:.3f}",
            "impatience": f"{self.impatience:.3f}",
        }
        if self.model == "Krauss":
            attributes["sigma"] = f"{self.sigma:.3f}"
        return attributes

    def parameters(self) -> dict[str, str]:
        """Return the generic parameters of the vType element."""
        if not self.glances:
            return {}
        return {
            "has.driverstate.device": "true",
            "device.driverstate.maximalReactionTime": f"{SLOWEST_REACTION:g}",
        }


def draw_type(
    population: str, kind: str, model: str, name: str, rng: np.random.Generator
) -> DrawnType:
    """Draw the vType of a vehicle.

    Args:
        population: Key of `POPULATIONS`.
        kind: Key of `KINDS`.
        model: SUMO's car-following model.
        name: Of the vehicle; its vType has the same with the population before it.
        rng: Used for as many numbers whatever they are.
    """
    drivers, body = POPULATIONS[population], KINDS[kind]
    decel = drivers.decel.draw(rng) * body.decel / REFERENCE_DECEL
    factor = drivers.factor.draw(rng)
    looks_away = rng.random()
    return DrawnType(
        id=f"{population}:{name}",
        kind=kind,
        model=model,
        population=population,
        tau=drivers.tau.draw(rng),
        min_gap=drivers.min_gap.draw(rng),
        factor=min(max(factor, LOWEST_FACTOR), body.highest_factor),
        accel=drivers.accel.draw(rng) * body.accel / REFERENCE_ACCEL,
        # nobody brakes comfortably harder than in an emergency
        decel=min(decel, body.emergency_decel),
        sigma=drivers.sigma.draw(rng),
        assertive=drivers.assertive.draw(rng),
        speed_gain=drivers.speed_gain.draw(rng),
        cooperative=drivers.cooperative.draw(rng),
        impatience=drivers.impatience.draw(rng),
        glances=drivers.glances is not None and looks_away < drivers.glances.share,
    )
