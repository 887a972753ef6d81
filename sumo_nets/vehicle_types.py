"""Vehicle types of the background traffic: kind x temper x car-following model.

Dimensions are those of common vehicles of each kind; tempers scale gaps, speeds and the
eagerness to change lanes around SUMO's defaults. Deviations of the wished speed are
drawn here, once per vehicle: SUMO's own draw (speedDev) is switched off.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sumo_nets.errors import NetworkError


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """Body and engine of a kind of vehicle."""

    length: float  # [m]
    width: float  # [m]
    accel: float  # [m/s²]
    decel: float  # comfortable braking [m/s²]
    emergency_decel: float  # the hardest braking [m/s²]
    max_speed: float  # [m/s]
    highest_factor: float  # limit of wished speed over speed limit [-]
    shape: str  # as drawn by sumo-gui


@dataclass(frozen=True, slots=True)
class Temper:
    """How a driver drives."""

    tau: float  # wished time gap [s]
    min_gap: float  # at standstill [m]
    factor_mean: float  # wished speed over speed limit [-]
    factor_deviation: float
    sigma: float  # Krauss: imperfection in [0, 1]
    eagerness: float  # scales acceleration and braking [-]
    assertive: float  # accepted gaps shrink by it when changing lanes [-]
    speed_gain: float  # eagerness to change lanes to go faster [-]
    cooperative: float  # willingness to change lanes for others, in [0, 1]


KINDS = MappingProxyType(
    {
        "car": VehicleKind(4.6, 1.8, 2.6, 4.5, 8.5, 50.0, 1.4, "passenger"),
        "van": VehicleKind(5.9, 2.0, 2.2, 4.0, 8.0, 40.0, 1.2, "delivery"),
        "truck": VehicleKind(10.0, 2.5, 1.2, 3.5, 7.0, 25.0, 1.0, "truck"),
    }
)

TEMPERS = MappingProxyType(
    {
        "cautious": Temper(1.8, 3.0, 0.92, 0.04, 0.3, 0.8, 0.8, 0.5, 1.0),
        "normal": Temper(1.2, 2.5, 1.0, 0.06, 0.5, 1.0, 1.0, 1.0, 0.8),
        "aggressive": Temper(0.8, 1.5, 1.12, 0.06, 0.3, 1.2, 1.6, 2.5, 0.3),
    }
)

# SUMO's car-following models in use; sigma belongs to Krauss alone.
MODELS = ("Krauss", "IDM", "EIDM", "ACC")

LOWEST_FACTOR = 0.7

LEADER = "leader"  # vType and vehicle of the slow leader


@dataclass(frozen=True, slots=True, order=True)
class VehicleType:
    """One combination; `id` is the name of its vType."""

    kind: str
    temper: str
    model: str

    @property
    def id(self) -> str:
        """Id of the vType, for example car_normal_IDM."""
        return f"{self.kind}_{self.temper}_{self.model}"

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the vType element."""
        return type_attributes(self)

    def parameters(self) -> dict[str, str]:
        """Return the generic parameters of the vType element: none."""
        return {}


def type_attributes(vehicle_type: VehicleType) -> dict[str, str]:
    """Return the attributes of a vType element."""
    kind = KINDS[vehicle_type.kind]
    temper = TEMPERS[vehicle_type.temper]
    # Nobody brakes comfortably harder than in an emergency.
    decel = min(kind.decel * temper.eagerness, kind.emergency_decel)
    attributes = {
        "id": vehicle_type.id,
        # One class for all: whatever is open to the ego is open to the traffic.
        "vClass": "passenger",
        "guiShape": kind.shape,
        "carFollowModel": vehicle_type.model,
        "length": f"{kind.length:g}",
        "width": f"{kind.width:g}",
        "accel": f"{kind.accel * temper.eagerness:g}",
        "decel": f"{decel:g}",
        "emergencyDecel": f"{kind.emergency_decel:g}",
        "maxSpeed": f"{kind.max_speed:g}",
        "tau": f"{temper.tau:g}",
        "minGap": f"{temper.min_gap:g}",
        "speedFactor": f"{temper.factor_mean:g}",
        "speedDev": "0",
        "lcAssertive": f"{temper.assertive:g}",
        "lcSpeedGain": f"{temper.speed_gain:g}",
        "lcCooperative": f"{temper.cooperative:g}",
    }
    if vehicle_type.model == "Krauss":
        attributes["sigma"] = f"{temper.sigma:g}"
    return attributes


def speed_factor(vehicle_type: VehicleType, rng: np.random.Generator) -> float:
    """Draw a driver's wished speed over the speed limit [-]."""
    temper = TEMPERS[vehicle_type.temper]
    drawn = rng.normal(temper.factor_mean, temper.factor_deviation)
    highest = KINDS[vehicle_type.kind].highest_factor
    return float(np.clip(drawn, LOWEST_FACTOR, highest))


@dataclass(frozen=True, slots=True)
class LeaderType:
    """A steady leader with a maximum speed; its vType has the id "leader"."""

    kind: str
    max_speed: float  # [m/s]

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            NetworkError: If there is no such kind or the speed is not positive.
        """
        if self.kind not in KINDS:
            known = ", ".join(KINDS)
            raise NetworkError(
                f'leader kind "{self.kind}" is unknown; allowed: {known}'
            )
        if not 0.0 < self.max_speed < np.inf:
            raise NetworkError(
                f"leader max_speed = {self.max_speed:g} must be > 0 and finite"
            )

    @property
    def length(self) -> float:
        """Length of the vehicle [m]."""
        return KINDS[self.kind].length

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the vType element."""
        highest = min(self.max_speed, KINDS[self.kind].max_speed)
        return {
            **type_attributes(VehicleType(self.kind, "normal", "Krauss")),
            "id": LEADER,
            "maxSpeed": f"{highest:g}",
            "sigma": "0",
        }


@dataclass(frozen=True, slots=True)
class EgoType:
    """The ego as the traffic sees it; its vType has the id "ego"."""

    length: float  # [m]
    width: float  # [m]
    decel: float  # comfortable braking, which followers count on [m/s²]
    emergency_decel: float  # the hardest braking [m/s²]
    max_speed: float  # [m/s]

    def __post_init__(self) -> None:
        """Check that all are positive and finite.

        Raises:
            NetworkError: If one is not, or decel exceeds emergency_decel.
        """
        for name in ("length", "width", "decel", "emergency_decel", "max_speed"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise NetworkError(f"ego {name} = {value:g} must be > 0 and finite")
        if self.decel > self.emergency_decel:
            raise NetworkError(
                f"ego decel = {self.decel:g} must be <= "
                f"emergency_decel = {self.emergency_decel:g}"
            )

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the vType element."""
        return {
            "id": "ego",
            "vClass": "passenger",
            "carFollowModel": "Krauss",
            "length": f"{self.length:g}",
            "width": f"{self.width:g}",
            # A gap that SUMO leaves when it puts the ego on the road.
            "minGap": "2.5",
            "decel": f"{self.decel:g}",
            "apparentDecel": f"{self.decel:g}",
            "emergencyDecel": f"{self.emergency_decel:g}",
            "maxSpeed": f"{self.max_speed:g}",
            "speedFactor": "1",
            "speedDev": "0",
            "sigma": "0",
            "color": "red",
        }
