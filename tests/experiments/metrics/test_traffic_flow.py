import math

import numpy as np
import pytest

from experiments.cosim.fleet.records import HUMAN, FleetSnapshot, FleetStep
from experiments.metrics import traffic_flow as flow
from experiments.metrics.fleet_catalogue import FLEET_METRICS, fleet_values
from experiments.metrics.traffic_flow import (
    CountingPlace,
    FleetMeasurement,
    LaneFacts,
)
from experiments.trace.fleet import (
    FleetTrace,
    fleet_hash,
    fleet_tables,
)
from experiments.trace.fleet_recording import FleetRecorder
from planner.scene import RoadUsers

STEP = 0.1
RING = 100.0  # in two edges, each with one lane, which lead into each other
LANES = {
    "a_0": LaneFacts(60.0, "b_0", "a"),
    "b_0": LaneFacts(40.0, "a_0", "b"),
}


def trace_of(places, speeds, groups=None, *, accelerations=None) -> FleetTrace:
    """Record vehicles at arc lengths on the ring, (n_steps, n) each."""
    places, speeds = np.asarray(places, float), np.asarray(speeds, float)
    if accelerations is None:
        accelerations = np.vstack([np.diff(speeds, axis=0) / STEP, 0 * speeds[:1]])
    n = places.shape[1]
    groups = np.full(n, HUMAN) if groups is None else np.asarray(groups)
    recorder = FleetRecorder()
    for k, (s, v, a) in enumerate(
        zip(places % RING, speeds, accelerations, strict=True)
    ):
        table = np.zeros((8, n))
        table[0], table[3], table[4], table[6], table[7] = s, v, a, 5.0, 2.0
        users = RoadUsers.from_table(tuple(f"car.{j}" for j in range(n)), table)
        lane = np.where(s < 60.0, 0, 1)
        position = np.where(s < 60.0, s, s - 60.0)
        numbers = (np.full(n, 20.0), np.full(n, 500.0), np.full(n, 1500.0))
        snapshot = FleetSnapshot(k * STEP, users, lane, position, *numbers, 2)
        recorder(FleetStep(k, snapshot, groups, (), (), 0.001))
    return recorder.trace(STEP, ("a_0", "b_0"))


def measured(trace: FleetTrace, at: float = 30.0, begin: float = 0.0):
    return FleetMeasurement(trace, LANES, (CountingPlace("a", at),), begin)


def steady(speed: float = 10.0, n: int = 4, seconds: float = 60.0):
    steps = round(seconds / STEP)
    begin = np.arange(n) * RING / n
    time = np.arange(steps)[:, None] * STEP
    return begin + speed * time, np.full((steps, n), speed)


def test_steady_traffic_has_the_flow_of_its_density_and_speed():
    found = measured(trace_of(*steady()))
    assert flow.flow(found) == pytest.approx(4 / RING * 10.0 * 3600.0, rel=0.01)
    assert flow.detector_speed(found) == pytest.approx(10.0)
    assert flow.mean_speed(found, found.counts) == pytest.approx(10.0)
    assert flow.speed_deviation(found, found.counts) == pytest.approx(0.0)
    assert flow.delay(found, found.counts) == pytest.approx(50.0)  # half of 100 s/km
    assert flow.distance_km(found, found.counts) == pytest.approx(2.4)
    assert flow.fuel(found, found.counts) == pytest.approx(50.0)  # 0.5 g/s at 10 m/s
    assert flow.carbon_dioxide(found, found.counts) == pytest.approx(150.0)
    assert flow.insertion_delay(found) == pytest.approx(30.0)  # 2 wait for 60 s
    assert flow.stops(found, found.counts) == 0.0
    assert flow.hard_brakings(found, found.counts) == 0.0
    assert flow.ttc_exposure(found, found.counts) == 0.0


@pytest.mark.parametrize("at", [0.5, 30.0, 59.9])
def test_everybody_is_counted_once_a_lap_wherever_the_detector_is(at):
    found = measured(trace_of(*steady(seconds=100.0)), at)
    passed = flow.crossings(found, found.places[0])
    assert abs(passed.size - 40) <= 1


@pytest.mark.parametrize("seed", range(3))
def test_leaders_are_those_that_brute_force_finds(seed):
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(0.0, RING, (6, 7)), axis=1)
    places = np.array([row[rng.permutation(7)] for row in places])
    found = measured(trace_of(places, rng.uniform(0.0, 10.0, (6, 7))))
    leader, gap = found.leaders
    trace = found.trace
    for row in range(trace.index.size):
        step, own = trace.index[row], trace.vehicle[row]
        ahead = (places[step] - places[step][own]) % RING
        ahead[own] = math.inf
        nearest = int(np.argmin(ahead))
        assert trace.vehicle[leader[row]] == nearest
        assert trace.index[leader[row]] == step
        assert gap[row] == pytest.approx(ahead[nearest] - 5.0)


def test_stops_and_hard_brakings_are_events_and_belong_to_their_group():
    time = np.arange(0.0, 40.0, STEP)
    stopping = np.clip(np.abs(time - 15.0) - 3.0, 0.0, 5.0)  # one stop, to 0 m/s
    speeds = np.column_stack([stopping, np.full(time.size, 5.0)])
    speeds[200:, 0] = np.clip(5.0 - 4.0 * (time[200:] - 20.0), 0.0, 5.0)  # hard, stop 2
    places = np.cumsum(speeds * STEP, axis=0) + np.array([0.0, 50.0])
    found = measured(trace_of(places, speeds, [0, HUMAN]))
    own_km = flow.distance_km(found, found.egos)
    assert flow.stops(found, found.egos) == pytest.approx(2.0 / own_km)
    assert flow.hard_brakings(found, found.egos) == pytest.approx(1.0 / own_km)
    assert flow.stops(found, found.humans) == 0.0
    assert flow.hard_brakings(found, found.humans) == 0.0


def test_exposure_is_the_share_of_time_in_which_a_leader_is_too_near():
    n = 100
    speeds = np.column_stack([np.full(n, 10.0), np.full(n, 2.0)])
    places = np.cumsum(speeds * STEP, axis=0) + np.array([0.0, 97.0 - 60.0])
    found = measured(trace_of(places, speeds))
    gap = places[:, 1] - places[:, 0] - 5.0
    ahead = gap > 0.0
    expected = (gap < 1.5 * 8.0)[ahead].mean()
    rows = found.counts & (found.trace.vehicle == 0)
    rows &= np.repeat(ahead, 2)
    assert flow.ttc_exposure(found, rows) == pytest.approx(expected)
    needed = 8.0**2 / (2.0 * np.maximum(gap[ahead], 0.01))
    assert flow.drac_exposure(found, rows) == pytest.approx((needed > 3.35).mean())


@pytest.mark.parametrize("gain", [0.5, 2.0])
def test_string_ratio_is_the_gain_of_accelerations(gain):
    time = np.arange(0.0, 60.0, STEP)[:, None]
    amplitude = np.array([1.0, gain])
    accelerations = amplitude * np.sin(time)
    speeds = 10.0 + amplitude * (1.0 - np.cos(time))
    places = 10.0 * time + amplitude * (time - np.sin(time)) + np.array([20.0, 0.0])
    found = measured(trace_of(places, speeds, accelerations=accelerations))
    follower = found.counts & (found.trace.vehicle == 1)
    assert flow.string_ratio(found, follower) == pytest.approx(gain)


def test_the_begin_leaves_time_out_and_sets_add_up():
    places, speeds = steady()
    found = measured(trace_of(places, speeds, [0, 1, HUMAN, HUMAN]), begin=30.0)
    values = fleet_values(found)
    assert flow.distance_km(found, found.counts) == pytest.approx(1.2)
    assert values["egos_share"] == pytest.approx(0.5)
    assert values["egos_driven"] == 2
    assert set(values) == {metric.column for metric in FLEET_METRICS}


def test_a_run_without_vehicles_has_no_values_and_a_hash():
    empty = trace_of(np.empty((3, 0)), np.empty((3, 0)))
    values = fleet_values(measured(empty))
    assert values["egos_driven"] == 0
    assert values["all_mean_speed_mps"] is None
    assert fleet_hash(fleet_tables(empty)) != fleet_hash(
        fleet_tables(trace_of(*steady()))
    )


def test_who_enters_standing_has_not_stopped():
    steps = 200
    speeds = np.zeros((steps, 2))
    speeds[:, 0] = 10.0
    speeds[50:, 1] = 8.0  # it waits, drives off and goes on
    places = np.array([50.0, 0.0]) + np.cumsum(speeds, axis=0) * STEP
    found = measured(trace_of(places, speeds))
    assert flow.stops(found, found.counts) == 0.0


def test_the_delay_of_insertion_is_of_those_who_enter_while_it_is_measured():
    found = measured(trace_of(*steady(n=4)))
    # two wait outside all the time, and four have entered at once
    assert flow.insertion_delay(found) == pytest.approx(2 * 60.0 / 4)
    assert flow.insertion_delay(measured(trace_of(*steady(n=4)), begin=30.0)) is None
