"""What becomes of traffic: flow, delay, stops, braking, exposure, string stability.

Everything is computed from the trace of a run with many egos and the lanes of its
network, for egos, for the vehicles of SUMO's drivers, and for all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.trace.fleet import FleetTrace, is_ego
from planner.states import BoolArray, FloatArray, IntArray

HARD_BRAKING = 3.0  # a brake harder than this is counted [m/s²]
STANDING = 0.3  # slower is standing ...
MOVING = 2.0  # ... once a vehicle was as fast as this [m/s]
CRITICAL_TTC = 1.5  # [s]
CRITICAL_DRAC = 3.35  # [m/s²], Archer 2005 as used in the literature
LOOKED_AHEAD = 150.0  # for a leader on the lanes that follow [m]
LEAST_FOLLOWING = 20.0  # of a pair whose accelerations are compared [s]
LEAST_MOTION = 0.05  # rms acceleration of a leader that says something [m/s²]
KM = 1000.0  # [m]
HOUR = 3600.0  # [s]
MG = 1e-3  # grams
STOOD, DROVE = 1, 2  # what a vehicle was last seen to do


@dataclass(frozen=True, slots=True)
class LaneFacts:
    """Of a lane: its length as SUMO counts it, and where it leads."""

    length: float  # [m]
    onward: str | None  # the only lane that follows; None if there are none or several
    edge: str


@dataclass(frozen=True, slots=True)
class CountingPlace:
    """A detector."""

    edge: str
    at: float  # from the begin of the edge [m]


@dataclass(frozen=True, eq=False)
class FleetMeasurement:
    """A recorded run with many egos, ready to be measured.

    Args:
        trace: Of the run.
        lanes: Facts by the names of lanes.
        places: Detectors; the first one is that of the results row.
        begin: Time from where on it counts [s].
    """

    trace: FleetTrace
    lanes: Mapping[str, LaneFacts]
    places: Sequence[CountingPlace]
    begin: float = 0.0

    @cached_property
    def counts(self) -> BoolArray:
        """Rows of vehicles on lanes in the time that counts, (n,)."""
        n_steps = int(self.trace.step_index.max(initial=-1)) + 1
        of_step = np.zeros(n_steps, dtype=bool)
        of_step[self.trace.step_index] = self.trace.time >= self.begin - 1e-9
        found: BoolArray = of_step[self.trace.index] & (self.trace.lane >= 0)
        return found

    @cached_property
    def egos(self) -> BoolArray:
        """Rows of egos that count, (n,)."""
        return self.counts & is_ego(self.trace)

    @cached_property
    def humans(self) -> BoolArray:
        """Rows of all others that count, (n,)."""
        return self.counts & ~is_ego(self.trace)

    @cached_property
    def seconds(self) -> float:
        """Time that counts [s]."""
        n = int((self.trace.time >= self.begin - 1e-9).sum())
        return n * self.trace.step_s

    @cached_property
    def by_vehicle(self) -> IntArray:
        """Rows sorted by vehicle, then by step, (n,)."""
        return np.lexsort((self.trace.index, self.trace.vehicle))

    @cached_property
    def before(self) -> IntArray:
        """Row before of the same vehicle, usually a step ago, -1 without one, (n,)."""
        return self._before(self.by_vehicle)

    @cached_property
    def before_on_lane(self) -> IntArray:
        """Last row of the same vehicle on a lane before, -1 without one, (n,)."""
        on_lane = self.trace.lane[self.by_vehicle] >= 0
        return self._before(self.by_vehicle[on_lane])

    def _before(self, order: IntArray) -> IntArray:
        """Link each of some rows, sorted by vehicle and step, to the one before."""
        vehicle = self.trace.vehicle
        before = np.full(vehicle.size, -1)
        same = vehicle[order][1:] == vehicle[order][:-1]
        before[order[1:][same]] = order[:-1][same]
        return before

    @cached_property
    def leaders(self) -> tuple[IntArray, FloatArray]:
        """Row of each row's leader, -1 without one, and the gap to it [m], (n,)."""
        return _leaders(self.trace, self.lanes)


def distance_km(found: FleetMeasurement, rows: BoolArray) -> float:
    """Return the distance driven [veh km]."""
    return float(found.trace.speed[rows].sum()) * found.trace.step_s / KM


def mean_speed(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return distance over time of all vehicles [m/s]."""
    return float(found.trace.speed[rows].mean()) if rows.any() else None


def speed_deviation(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the standard deviation of speeds over vehicles and time [m/s]."""
    return float(found.trace.speed[rows].std()) if rows.any() else None


def delay(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the time lost against the wished speed per distance [s/veh km].

    Σ max(1 - v / v_wished, 0) Δt over the distance driven.
    """
    driven = distance_km(found, rows)
    wished = np.maximum(found.trace.numbers[1][rows], 0.1)
    lost = np.maximum(1.0 - found.trace.speed[rows] / wished, 0.0)
    return float(lost.sum()) * found.trace.step_s / driven if driven > 0.0 else None


def hard_brakings(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return how often braking became harder than `HARD_BRAKING` [1/veh km]."""
    hard = found.trace.table[4] < -HARD_BRAKING
    before = found.before
    begins = hard & (before >= 0) & ~hard[before]
    return _per_km(found, rows, begins)


def stops(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return how often vehicles that moved came to stand [1/veh km]."""
    order, trace = found.by_vehicle, found.trace
    speed, vehicle = trace.speed[order], trace.vehicle[order]
    state = np.where(speed < STANDING, STOOD, np.where(speed > MOVING, DROVE, 0))
    first = np.flatnonzero(np.diff(vehicle, prepend=-1))
    state[first] = np.where(speed[first] > MOVING, DROVE, STOOD)  # not what was before
    known = np.maximum.accumulate(np.where(state > 0, np.arange(state.size), 0))
    held = state[known]
    came = np.zeros(state.size, dtype=bool)
    came[1:] = (held[1:] == STOOD) & (held[:-1] == DROVE)
    came[first] = False  # before it is another vehicle
    begins = np.zeros(state.size, dtype=bool)
    begins[order] = came
    return _per_km(found, rows, begins)


def ttc_exposure(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the share of time with less than `CRITICAL_TTC` to the leader."""
    closing, gap = _closing(found)
    critical = (closing > 0.0) & (gap < CRITICAL_TTC * closing)
    return float(critical[rows].mean()) if rows.any() else None


def drac_exposure(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the share of time in which more than `CRITICAL_DRAC` is needed.

    DRAC = Δv² / (2 gap): the braking that avoids a leader who keeps its speed.
    """
    closing, gap = _closing(found)
    needed = np.maximum(closing, 0.0) ** 2 / (2.0 * np.maximum(gap, 0.01))
    return float((needed > CRITICAL_DRAC)[rows].mean()) if rows.any() else None


def string_ratio(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return how much stronger vehicles accelerate than their leaders, the median.

    ‖a_i‖₂ / ‖a_{i-1}‖₂ over the time in which i follows i - 1: below 1 disturbances
    fade along the string, above 1 they grow.
    """
    trace = found.trace
    leader, _ = found.leaders
    following = np.flatnonzero(rows & (leader >= 0))
    if not following.size:
        return None
    ahead = leader[following]
    pair = trace.vehicle[following] * len(trace.ids) + trace.vehicle[ahead]
    _, number = np.unique(pair, return_inverse=True)
    n = np.bincount(number)
    own = np.bincount(number, trace.table[4][following] ** 2)
    others = np.bincount(number, trace.table[4][ahead] ** 2)
    kept = (n * trace.step_s >= LEAST_FOLLOWING) & (others > LEAST_MOTION**2 * n)
    return float(np.median(np.sqrt(own[kept] / others[kept]))) if kept.any() else None


def fuel(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the fuel used per distance, by SUMO's emission model [g/veh km]."""
    return _burnt(found, rows, 2)


def carbon_dioxide(found: FleetMeasurement, rows: BoolArray) -> float | None:
    """Return the CO2 emitted per distance, by SUMO's emission model [g/veh km]."""
    return _burnt(found, rows, 3)


def flow(found: FleetMeasurement) -> float | None:
    """Return the vehicles that pass the first detector [veh/h]."""
    if not found.places or found.seconds <= 0.0:
        return None
    passing = crossings(found, found.places[0])
    return passing.size / found.seconds * HOUR


def detector_speed(found: FleetMeasurement) -> float | None:
    """Return the harmonic mean speed at the first detector [m/s]."""
    if not found.places:
        return None
    passing = crossings(found, found.places[0])
    speed = np.maximum(found.trace.speed[passing], 0.1)
    return float(1.0 / (1.0 / speed).mean()) if passing.size else None


def insertion_delay(found: FleetMeasurement) -> float | None:
    """Return the waiting time outside the network per vehicle that entered [s].

    Both of the time that is measured; None where nobody entered in it.
    """
    trace = found.trace
    waiting = trace.pending[trace.time >= found.begin - 1e-9]
    entered = (found.before < 0) & (trace.lane >= 0) & found.counts
    n = int(entered.sum())
    return float(waiting.sum()) * trace.step_s / n if n else None


def crossings(found: FleetMeasurement, place: CountingPlace) -> IntArray:
    """Return the rows in which a vehicle has just passed a detector."""
    trace, before = found.trace, found.before_on_lane
    names = [*trace.lanes, ""]
    on_edge = np.array(
        [name in found.lanes and found.lanes[name].edge == place.edge for name in names]
    )
    here, position = on_edge[trace.lane], trace.position
    was_here = (before >= 0) & here[before]
    was_short = was_here & (position[before] < place.at)
    on_road = trace.lane >= 0  # elsewhere it is not known where it is
    past = on_road & (~here | (position >= place.at))
    jumped = here & (before >= 0) & ~was_here & (position >= place.at)
    return np.flatnonzero(found.counts & ((was_short & past) | jumped))


def _per_km(
    found: FleetMeasurement, rows: BoolArray, events: BoolArray
) -> float | None:
    """Return events among some rows per distance [1/veh km]."""
    driven = distance_km(found, rows)
    return float((events & rows).sum()) / driven if driven > 0.0 else None


def _burnt(found: FleetMeasurement, rows: BoolArray, row: int) -> float | None:
    """Return one of SUMO's emissions per distance [g/veh km]."""
    driven = distance_km(found, rows)
    mass = float(found.trace.numbers[row][rows].sum()) * found.trace.step_s * MG
    return mass / driven if driven > 0.0 else None


def _closing(found: FleetMeasurement) -> tuple[FloatArray, FloatArray]:
    """Return by how much each row is faster than its leader, and the gap, (n,)."""
    leader, gap = found.leaders
    speed = found.trace.speed
    closing = np.where(leader >= 0, speed - speed[leader], 0.0)
    return closing, gap


def _leaders(
    trace: FleetTrace, lanes: Mapping[str, LaneFacts]
) -> tuple[IntArray, FloatArray]:
    """Find the leader of each row: on its lane, or on the lanes that follow."""
    n = trace.index.size
    leader, gap = np.full(n, -1), np.full(n, np.inf)
    if n == 0:
        return leader, gap
    order = np.lexsort((trace.position, trace.lane, trace.index))
    order = order[trace.lane[order] >= 0]
    step, lane = trace.index[order], trace.lane[order]
    same = (step[1:] == step[:-1]) & (lane[1:] == lane[:-1])
    follower, ahead = order[:-1][same], order[1:][same]
    leader[follower] = ahead
    length = trace.table[6]
    gap[follower] = trace.position[ahead] - length[ahead] - trace.position[follower]
    first = np.flatnonzero(np.append(True, ~same))
    last = np.append(first[1:] - 1, order.size - 1)
    rear = {(int(step[k]), int(lane[k])): int(order[k]) for k in first}
    number = {name: k for k, name in enumerate(trace.lanes)}
    for k in last.tolist():
        row = int(order[k])
        found = _first_ahead(trace, lanes, number, rear, row)
        if found is not None:
            leader[row], gap[row] = found
    return leader, gap


def _first_ahead(
    trace: FleetTrace,
    lanes: Mapping[str, LaneFacts],
    number: Mapping[str, int],
    rear: Mapping[tuple[int, int], int],
    row: int,
) -> tuple[int, float] | None:
    """Find the leader of the first vehicle on a lane; (its row, gap [m])."""
    facts = lanes.get(trace.lanes[trace.lane[row]])
    if facts is None:
        return None
    away = facts.length - float(trace.position[row])
    while facts.onward is not None and away < LOOKED_AHEAD:
        there = rear.get((int(trace.index[row]), number.get(facts.onward, -1)))
        if there is not None:
            if trace.vehicle[there] == trace.vehicle[row]:
                return None  # alone on a ring
            own = float(trace.position[there]) - float(trace.table[6][there])
            return there, away + own
        facts = lanes[facts.onward]
        away += facts.length
    return None
