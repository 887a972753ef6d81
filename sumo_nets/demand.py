"""Background traffic: seed and flows to explicit vehicles, then to a route file.

Every vehicle is written out with its departure, type and route. SUMO's own random flows
could not be continued from a saved state, and would mix our randomness with its.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from xml.etree import ElementTree
from zlib import crc32

import numpy as np

from sumo_nets.driver_population import POPULATIONS, DrawnType, draw_type
from sumo_nets.errors import NetworkError
from sumo_nets.network import Network, Stream
from sumo_nets.vehicle_types import (
    MODELS,
    EgoType,
    LeaderType,
    VehicleType,
    speed_factor,
)

# More than three saturated lanes can take.
MAX_FLOW = 9000.0
MAX_REACTION = 3.0  # [s]

# The first vehicle comes after no more mean headways: a road that is empty for a whole
# warm-up is rare, but seed 0 had drawn 11.8.
LONGEST_WAIT = 4.0

OWN = "own"  # the stream of the ego's carriageway
EGO_LANE = "ego_lane"  # a second one there, which departs in the ego's lane

# Relative shares of the car-following models unless the demand says otherwise. ACC is
# rare: SUMO's brakes with 6 m/s² and more before red lights, the others seldom do.
COMMON_MODELS = (("Krauss", 0.4), ("IDM", 0.25), ("EIDM", 0.25), ("ACC", 0.1))
# EIDM that decides more rarely keeps its acceleration behind a braking leader until
# only an emergency is left [s]; it has a reaction time of its own.
SLOWEST_EIDM = 0.5


@dataclass(frozen=True, slots=True)
class Demand:
    """Flows and mix of the background traffic.

    Shares of kinds and tempers are fractions; cars and normal drivers are the rest.
    Shares of models are relative to each other.
    """

    own_veh_per_h: float = 0.0  # on the ego's carriageway
    oncoming_veh_per_h: float = 0.0
    cross_veh_per_h: float = 0.0  # on each crossing arm
    van_share: float = 0.1
    truck_share: float = 0.08
    cautious_share: float = 0.25
    aggressive_share: float = 0.2
    models: tuple[tuple[str, float], ...] = COMMON_MODELS
    own_lane: int | None = None  # in which the ego's carriageway is fed; None: any
    keep_right: bool = True  # whether drivers go back to the right when they can
    ego_lane_veh_per_h: float = 0.0  # more of the ego's carriageway, in the ego's lane
    reaction: float = 0.0  # drivers decide this often, 0: in every step [s]
    leader: LeaderType | None = None  # its type is written; it enters with the ego
    population: str | None = None  # of drivers; replaces tempers and models

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            NetworkError: If a field is outside its range; the message names both.
        """
        for name in (
            "own_veh_per_h",
            "ego_lane_veh_per_h",
            "oncoming_veh_per_h",
            "cross_veh_per_h",
        ):
            self._check(name, MAX_FLOW)
        self._check("reaction", MAX_REACTION)
        for name in ("van_share", "truck_share", "cautious_share", "aggressive_share"):
            self._check(name, 1.0)
        for first, second in (
            ("van_share", "truck_share"),
            ("cautious_share", "aggressive_share"),
        ):
            total = getattr(self, first) + getattr(self, second)
            if total > 1.0 + 1e-12:
                raise NetworkError(f"{first} + {second} = {total:g} must be <= 1")
        _check_models(self.models)
        if self.population is not None and self.population not in POPULATIONS:
            known = ", ".join(POPULATIONS)
            raise NetworkError(
                f'population "{self.population}" is unknown; allowed: {known}'
            )

    def _check(self, name: str, highest: float) -> None:
        """Check that the field `name` is in [0, highest]."""
        value = getattr(self, name)
        if not 0.0 <= value <= highest:
            raise NetworkError(f"{name} = {value:g} must be in [0, {highest:g}]")

    def flow(self, stream: str) -> float:
        """Return the flow of the stream of this name [veh/h]."""
        flows = {
            "own": self.own_veh_per_h,
            EGO_LANE: self.ego_lane_veh_per_h,
            "oncoming": self.oncoming_veh_per_h,
            "cross": self.cross_veh_per_h,
        }
        family = stream if stream in flows else stream.split("_", maxsplit=1)[0]
        if family not in flows:
            raise NetworkError(
                f'no flow for stream "{stream}"; its name must begin with own, '
                "oncoming or cross"
            )
        return flows[family]


@dataclass(frozen=True, slots=True)
class DemandVehicle:
    """One background vehicle."""

    id: str  # stream and number: own.12
    depart: float  # [s]
    type: VehicleType | DrawnType
    speed_factor: float  # wished speed over the speed limit [-]
    route: tuple[str, ...]
    lane: int | None = None  # of departure; None: the best one
    keep_right: bool = True


def vehicles_for(
    network: Network, demand: Demand, seed: int, begin: float, end: float
) -> tuple[DemandVehicle, ...]:
    """Draw the background traffic that departs in [begin, end).

    Arrivals are a Poisson process in each stream, its first headway bounded. A stream's
    vehicles depend on the seed and its own flow only, so that another flow changes
    nothing in this one.

    Args:
        network: Streams and their routes.
        demand: Flows and mix.
        seed: Not negative.
        begin: First possible departure [s], not negative.
        end: No departure from here on [s].

    Returns:
        Vehicles in the order of their departures.

    Raises:
        NetworkError: If seed or times are out of range.
    """
    if seed < 0:
        raise NetworkError(f"seed = {seed} must be >= 0")
    if not 0.0 <= begin <= end < np.inf:
        raise NetworkError(f"begin = {begin:g}, end = {end:g}: 0 <= begin <= end < inf")
    drawn = [
        vehicle
        for stream, lane in _fed(network, demand)
        for vehicle in _draw_stream(stream, lane, demand, seed, (begin, end))
    ]
    return tuple(sorted(drawn, key=lambda vehicle: (vehicle.depart, vehicle.id)))


def write_demand(
    network: Network,
    demand: Demand,
    seed: int,
    begin: float,
    end: float,
    path: str | Path,
    ego: EgoType | None = None,
) -> tuple[DemandVehicle, ...]:
    """Write the background traffic as a SUMO route file; same seed, same bytes.

    The file also holds the route "ego", and the type "ego" if `ego` is given.

    Args:
        network: As in `vehicles_for`.
        demand: As in `vehicles_for`.
        seed: As in `vehicles_for`.
        begin: As in `vehicles_for` [s].
        end: As in `vehicles_for` [s].
        path: The .rou.xml to write, whole or not at all.
        ego: The ego's vehicle type.

    Returns:
        The vehicles written.

    Raises:
        NetworkError: As `vehicles_for`, or if the file cannot be written.
    """
    vehicles = vehicles_for(network, demand, seed, begin, end)
    text = routes_text(network, vehicles, ego, demand.leader, demand.reaction)
    target = Path(path)
    aside = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(target)
    except OSError as error:
        raise NetworkError(f"{target}: cannot be written ({error})") from error
    return vehicles


def routes_text(
    network: Network,
    vehicles: tuple[DemandVehicle, ...],
    ego: EgoType | None = None,
    leader: LeaderType | None = None,
    reaction: float = 0.0,
) -> str:
    """Return the text of a route file with the types in use.

    Args:
        network: With the ego's route.
        vehicles: To write.
        ego: The ego's vehicle type.
        leader: The slow leader's.
        reaction: Drivers decide this often; 0: in every step [s].
    """
    root = ElementTree.Element("routes")
    for entering in (ego, leader):
        if entering is not None:
            ElementTree.SubElement(root, "vType", entering.attributes())
    for kind in sorted({vehicle.type for vehicle in vehicles}, key=attrgetter("id")):
        attributes = kind.attributes()
        if vehicles and not vehicles[0].keep_right:
            attributes["lcKeepRight"] = "0"
        attributes |= _reaction(kind.model, reaction)
        element = ElementTree.SubElement(root, "vType", attributes)
        for key, value in kind.parameters().items():
            ElementTree.SubElement(element, "param", key=key, value=value)
    ElementTree.SubElement(root, "route", id="ego", edges=" ".join(network.route))
    for vehicle in vehicles:
        element = ElementTree.SubElement(
            root,
            "vehicle",
            id=vehicle.id,
            type=vehicle.type.id,
            depart=f"{vehicle.depart:.2f}",
            departLane="best" if vehicle.lane is None else str(vehicle.lane),
            departSpeed="max",
            speedFactor=f"{vehicle.speed_factor:.3f}",
        )
        ElementTree.SubElement(element, "route", edges=" ".join(vehicle.route))
    ElementTree.indent(root, "    ")
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


def _reaction(model: str, reaction: float) -> dict[str, str]:
    """Return the attributes of a vehicle type that make its drivers react late."""
    if reaction <= 0.0:
        return {}
    own = model == "EIDM" and reaction > SLOWEST_EIDM
    return {"treaction" if own else "actionStepLength": f"{reaction:g}"}


def _fed(network: Network, demand: Demand) -> Iterator[tuple[Stream, int | None]]:
    """Return the streams, and the departure lane of each."""
    for stream in network.streams:
        yield stream, demand.own_lane if stream.name == OWN else None
        if stream.name == OWN:
            yield Stream(EGO_LANE, stream.turns), network.lane


def _draw_stream(
    stream: Stream,
    lane: int | None,
    demand: Demand,
    seed: int,
    interval: tuple[float, float],
) -> list[DemandVehicle]:
    """Draw the vehicles of one stream, arrivals apart from everything else."""
    begin, end = interval
    rate = demand.flow(stream.name) / 3600.0
    if rate == 0.0:
        return []
    key = crc32(stream.name.encode())  # Python's own hash differs between processes
    arrivals = np.random.default_rng([seed, key, 0])
    traits = np.random.default_rng([seed, key, 1])
    shares = np.array([turn.share for turn in stream.turns])
    vehicles: list[DemandVehicle] = []
    depart = begin + min(float(arrivals.exponential()), LONGEST_WAIT) / rate
    while depart < end:
        name = f"{stream.name}.{len(vehicles)}"
        kind = _draw_type(demand, name, traits)
        turn = int(traits.choice(len(shares), p=shares / shares.sum()))
        vehicles.append(
            DemandVehicle(
                id=name,
                depart=depart,
                type=kind,
                speed_factor=kind.factor
                if isinstance(kind, DrawnType)
                else speed_factor(kind, traits),
                route=stream.turns[turn].route,
                lane=lane,
                keep_right=demand.keep_right,
            )
        )
        depart += arrivals.exponential() / rate
    return vehicles


def _draw_type(
    demand: Demand, name: str, rng: np.random.Generator
) -> VehicleType | DrawnType:
    """Draw kind, driver and car-following model of a vehicle.

    Args:
        demand: Shares of kinds, tempers and models, or a population.
        name: Of the vehicle.
        rng: Used.
    """
    vans, trucks = demand.van_share, demand.truck_share
    kind = _draw({"car": 1.0 - vans - trucks, "van": vans, "truck": trucks}, rng)
    if demand.population is not None:
        model = _draw(dict(POPULATIONS[demand.population].models), rng)
        return draw_type(demand.population, kind, model, name, rng)
    cautious, aggressive = demand.cautious_share, demand.aggressive_share
    tempers = {
        "cautious": cautious,
        "normal": 1.0 - cautious - aggressive,
        "aggressive": aggressive,
    }
    temper = _draw(tempers, rng)
    return VehicleType(kind, temper, _draw(dict(demand.models), rng))


def _draw(weights: dict[str, float], rng: np.random.Generator) -> str:
    """Draw a key by its weight, with one random number."""
    bounds = np.cumsum(np.maximum(list(weights.values()), 0.0))
    place = np.searchsorted(bounds, rng.random() * bounds[-1], side="right")
    return list(weights)[min(int(place), len(weights) - 1)]


def _check_models(models: tuple[tuple[str, float], ...]) -> None:
    """Check names and shares of car-following models."""
    names = [name for name, _ in models]
    for name, share in models:
        if name not in MODELS:
            raise NetworkError(
                f'models: "{name}" is unknown; allowed: {", ".join(MODELS)}'
            )
        if not 0.0 <= share < np.inf:
            raise NetworkError(f"models: share {share:g} of {name} must be >= 0")
    if len(set(names)) < len(names) or sum(share for _, share in models) <= 0.0:
        raise NetworkError(f"models: {models} must name some, each once, share > 0")
