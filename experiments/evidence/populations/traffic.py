"""The traffic of a population by itself: headways, braking, times to collision."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.driver_errors import DriverErrors
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.world_setup.layout import make_layout
from experiments.world_setup.traffic import driver_errors, write_traffic
from planner.states import FloatArray

SCENARIO = "lane_change_three"
STEP = 0.1  # [s]
WARM_UP, LASTS = 60.0, 180.0  # [s]
SAMPLED = 1.0  # a row of every vehicle each so often [s]
REACH = 150.0  # leaders farther ahead are none [m]
SLOWEST = 5.0  # slower vehicles queue rather than follow [m/s]
HARD = 3.0  # braking counted [m/s²]
FOLLOWING = 4.0  # longer time gaps follow nobody [s]
SHORT_TTC = 3.0  # [s]
M_PER_KM = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class TrafficSample:
    """What the traffic of one population and seed did."""

    time_gap: FloatArray  # of following vehicles, each second (n,) [s]
    closing_in: FloatArray  # their times to collision, infinite if none (n,) [s]
    speed: FloatArray  # of all vehicles, each second (m,) [m/s]
    hard_brakings: int
    distance: float  # of all vehicles [km]


def sample_traffic(population: str, seed: int, density: str) -> TrafficSample:
    """Run SUMO with the traffic of a population alone.

    Args:
        population: Its name.
        seed: Of the traffic.
        density: Of the scenario's presets.
    """
    overrides = (f"traffic.drivers={population}", f"traffic.density={density}")
    scenario = load_scenario(SCENARIO, seed=seed, overrides=overrides)
    layout = make_layout(scenario)
    if layout.network is None:
        raise TypeError(f"{SCENARIO} has no network")
    sumo = load_libsumo()
    with TemporaryDirectory() as place:
        file = write_traffic(scenario, layout, layout.network, Path(place))
        command = ["sumo", "-n", str(layout.network.net_file), "-r", str(file)]
        command += ["--step-length", repr(STEP), "--seed", str(seed)]
        command += ["--no-step-log", "--no-warnings", "--lanechange.duration", "2.5"]
        sumo.start(command)
        settings = driver_errors(scenario.traffic, seed)
        errors = None if settings is None else DriverErrors(sumo, settings, ())
        found = _counted(sumo, errors)
        sumo.close()
    return _gathered(found)


class _Counted:
    """Rows of every second, and brakings that have begun."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float, float]] = []  # speed, gap, leader's speed
        self.brakings = 0
        self._hard: set[str] = set()

    def take(self, sumo: Libsumo, *, sampled: bool) -> None:
        """Look at all vehicles after a step."""
        vehicle, hard = sumo.vehicle, set()
        for name in vehicle.getIDList():
            if vehicle.getAcceleration(name) <= -HARD:
                hard.add(name)
            if sampled:
                self.rows.append(_following(sumo, name))
        self.brakings += len(hard - self._hard)
        self._hard = hard


def _following(sumo: Libsumo, name: str) -> tuple[float, float, float]:
    """Return speed, gap and speed of the leader, infinite without one."""
    vehicle = sumo.vehicle
    speed = vehicle.getSpeed(name)
    ahead = vehicle.getLeader(name, REACH)
    if ahead is None or not ahead[0]:
        return speed, np.inf, np.inf
    return speed, ahead[1] + vehicle.getMinGap(name), vehicle.getSpeed(ahead[0])


def _counted(sumo: Libsumo, errors: DriverErrors | None) -> _Counted:
    """Run the traffic and count."""
    every, found = round(SAMPLED / STEP), _Counted()
    for k in range(round((WARM_UP + LASTS) / STEP)):
        if errors is not None:
            errors.update(k * STEP)
        sumo.simulationStep()
        if k * STEP >= WARM_UP:
            found.take(sumo, sampled=k % every == 0)
    return found


def _gathered(found: _Counted) -> TrafficSample:
    """Summarise what was counted."""
    speed, gap, lead = np.array(found.rows, dtype=np.float64).T
    follows = (speed >= SLOWEST) & (gap <= FOLLOWING * speed)
    closing = speed[follows] - lead[follows]
    left = gap[follows] / np.where(closing > 0.0, closing, 1.0)
    return TrafficSample(
        time_gap=gap[follows] / speed[follows],
        closing_in=np.where(closing > 0.0, left, np.inf),
        speed=speed,
        hard_brakings=found.brakings,
        distance=float(speed.sum()) * SAMPLED / M_PER_KM,
    )


def summary(samples: list[TrafficSample]) -> Mapping[str, float]:
    """Return the figures of a population over its seeds."""
    gaps = np.concatenate([one.time_gap for one in samples])
    times = np.concatenate([one.closing_in for one in samples])
    distance = sum(one.distance for one in samples)
    low, middle, high = np.quantile(gaps, (0.1, 0.5, 0.9)).tolist()
    return {
        "low": low,
        "median": middle,
        "high": high,
        "below_1_s": float((gaps < 1.0).mean()),
        "variation": float(gaps.std() / gaps.mean()),
        "short_ttc": float((times < SHORT_TTC).mean()),
        "hard_per_100_km": 100.0 * sum(s.hard_brakings for s in samples) / distance,
        "speed": float(np.concatenate([one.speed for one in samples]).mean()),
        "distance": distance,
        "rows": float(gaps.size),
    }
