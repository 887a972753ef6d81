import math
from itertools import pairwise
from zlib import crc32

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.driver_errors import (
    DriverError,
    DriverErrors,
    DriverErrorSettings,
    ErrorTimes,
    Occurrence,
)
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.episode.run import WITHOUT_EGO_FILE, run_episode
from experiments.episode.run_folder import OutputOptions
from experiments.world_setup.layout import make_layout
from experiments.world_setup.traffic import write_traffic

ERRING = (
    "traffic.density=medium",
    "traffic.drivers={population: distracted, hard_brakes_per_h: 200}",
    "simulation.duration_s=25",
    "simulation.without_ego=true",
)


@settings(max_examples=40)
@given(st.floats(5.0, 600.0), st.floats(0.1, 5.0), st.integers(0, 2**31))
def test_errors_happen_at_their_rate_and_last_as_long_as_they_may(per_hour, most, seed):
    times = ErrorTimes(Occurrence(per_hour, 0.1, 0.1 + most), [seed, 1])
    step, hours = 0.05, 0.25
    active = [times.active(k * step) for k in range(round(hours * 3600.0 / step))]
    begun = sum(
        now and not before
        for before, now in zip([False, *active], active, strict=False)
    )
    lengths, run = [], 0
    for now in active:
        run = run + 1 if now else 0
        lengths.append(run)
    assert max(lengths) * step <= 0.1 + most + step
    # pauses are exponential; each error and the gap behind it takes time as well
    rate = 1.0 / (3600.0 / per_hour + 0.1 + most / 2.0 + 0.1)
    expected = rate * hours * 3600.0
    assert abs(begun - expected) <= 5.0 * math.sqrt(expected) + 2.0


def test_errors_depend_on_seed_and_driver_alone():
    occurrence = Occurrence(300.0, 1.0, 2.0)
    one = ErrorTimes(occurrence, [7, 3])
    other = ErrorTimes(occurrence, [7, 3])
    moments = [0.3 * k for k in range(400)]
    # asked less often, the answers are the same
    answers = [one.active(t) for t in moments]
    assert [other.active(t) for t in moments[::5]] == answers[::5]
    assert [ErrorTimes(occurrence, [8, 3]).active(t) for t in moments] != answers


class Vehicles:
    """Stands for SUMO's vehicles: who is there, and what was asked of them."""

    def __init__(self, ids):
        self.ids, self.asked = ids, []

    def getIDList(self):
        return tuple(self.ids)

    def getParameter(self, name, key):
        return "false"

    def getSpeed(self, name):
        return 20.0

    def slowDown(self, name, speed, duration):
        self.asked.append(("slowDown", name, speed, duration))

    def setSpeed(self, name, speed):
        self.asked.append(("setSpeed", name, speed))


class Sumo:
    def __init__(self, ids):
        self.vehicle = Vehicles(ids)


def errors_of(sumo, braking=0.0, stalling=0.0, lasts=(4.0, 4.0)):
    settings = DriverErrorSettings(
        5,
        braking=Occurrence(braking, *lasts),
        stalling=Occurrence(stalling, *lasts),
    )
    return DriverErrors(sumo, settings, {"ego"})


def test_a_driver_met_in_the_middle_of_an_error_brakes_for_the_rest_of_it():
    times = ErrorTimes(Occurrence(60.0, 4.0, 4.0), [5, *keys("a", "brakes")])
    begin = next(k * 0.1 for k in range(100_000) if times.active(k * 0.1))
    sumo = Sumo(["ego", "a"])
    errors_of(sumo, braking=60.0).update(begin + 3.5)
    ((_, _, speed, duration),) = sumo.vehicle.asked
    assert 0.3 < duration < 0.7
    assert speed == pytest.approx(20.0 - 4.0 * duration)


def test_who_has_left_errs_no_more():
    sumo = Sumo(["ego", "a"])
    errors = errors_of(sumo, stalling=600.0, lasts=(1e5, 1e5))
    errors.update(1000.0)
    assert errors.present() == (("a", DriverError.STALLS),)
    sumo.vehicle.ids = ["ego"]
    errors.update(1000.1)
    assert errors.present() == ()


def test_who_stands_does_not_brake():
    sumo = Sumo(["a"])
    errors = errors_of(sumo, braking=600.0, stalling=120.0)
    for k in range(20_000):
        errors.update(0.1 * k)
        assert len(errors.present()) <= 1
    # a stall is ended before anything else is asked
    asked = sumo.vehicle.asked
    stands = False
    for call in asked:
        assert not (stands and call[0] == "slowDown")
        stands = (call[0] == "setSpeed" and call[2] == 0.0) or (
            stands and call[0] == "slowDown"
        )
    assert {call[0] for call in asked} == {"slowDown", "setSpeed"}


def keys(name, kind):
    return crc32(name.encode()), crc32(kind.encode())


@pytest.mark.sumo
def test_the_same_drivers_err_at_the_same_moments_whoever_drives_the_ego(tmp_path):
    errors = {}
    for planner in ("lane_change", "sumo"):
        scenario = load_scenario(
            "lane_change", planner=planner, seed=2, overrides=list(ERRING)
        )
        outcome = run_episode(scenario, out=tmp_path, output=OutputOptions())
        table = outcome.trace.driver_errors
        rows = zip(table["index"], table["id"], table["error"], strict=True)
        errors[planner] = {row for row in rows if row[0] < 200}
        assert (outcome.folder / WITHOUT_EGO_FILE).is_file()
    kinds = {error for _, _, error in errors["sumo"]}
    assert kinds == {"looks_away", "brakes"}
    assert errors["sumo"] == errors["lane_change"]


@pytest.mark.sumo
def test_a_driver_who_brakes_for_no_reason_slows_down(tmp_path):
    scenario = load_scenario("lane_change", seed=2, overrides=list(ERRING))
    trace = run_episode(scenario, out=tmp_path).trace
    braking = {
        (index, name)
        for index, name, error in zip(*trace.driver_errors.values(), strict=True)
        if error == "brakes"
    }
    table = trace.vehicles
    hardest = {}
    for index, name, a in zip(
        table["index"], table["id"], table["acceleration_mps2"], strict=True
    ):
        if (index - 1, name) in braking and (index, name) in braking:
            hardest[name] = min(hardest.get(name, 0.0), float(a))
    assert hardest  # the ego sees some of them
    assert sum(a < -2.0 for a in hardest.values()) >= 0.8 * len(hardest)


class Near(Vehicles):
    """Vehicles of which the first half is beside the ego, at (0, 0)."""

    def getPosition(self, name):
        return (10.0, 0.0) if self.ids.index(name) < len(self.ids) / 2 else (900.0, 0.0)


def drive_with(seed, factor, steps=300, step=0.4):
    """Return who braked, and the run's weight."""
    sumo = Sumo(["near.0", "near.1", "far.0", "far.1"])
    sumo.vehicle = Near(sumo.vehicle.ids)
    braking = Occurrence(15.0, 1.0, 2.0)
    settings = DriverErrorSettings(seed, braking=braking, factor=factor)
    errors = DriverErrors(sumo, settings, ())
    braked = set()
    for k in range(steps):
        errors.update(step * k, (0.0, 0.0))
        braked |= {name for name, _ in errors.present()}
    weight = errors.log_weight
    return braked, 1.0 if weight is None else math.exp(weight)


def test_weights_make_up_for_errors_that_are_drawn_more_often_near_the_ego():
    runs = [drive_with(seed, 2.5) for seed in range(300)]
    weights = [weight for _, weight in runs]
    near = [any(name.startswith("near") for name in braked) for braked, _ in runs]
    far = [any(name.startswith("far") for name in braked) for braked, _ in runs]
    hours = 300 * 0.4 / 3600.0
    expected = 1.0 - math.exp(-2.0 * 15.0 * hours)  # of two drivers
    count = len(runs)
    assert sum(weights) / count == pytest.approx(1.0, abs=0.2)
    weighted = sum(w for w, hit in zip(weights, near, strict=True) if hit) / count
    assert weighted == pytest.approx(expected, rel=0.25)
    assert sum(near) / count > 1.3 * expected  # drawn more often
    assert sum(far) / count == pytest.approx(expected, abs=0.1)  # but not there


LONG = Occurrence(10.0, 10.0, 30.0)  # errors that last, drawn 20 times as often
OFTEN = 20.0


def begun(times, seconds, near, step=0.5):
    """Count the errors that begin; `near` tells for a time whether the ego is."""
    times_asked = [k * step for k in range(1, round(seconds / step))]
    active = [False, *(times.active(t, near=near(t)) for t in times_asked)]
    return sum(now and not before for before, now in pairwise(active))


@pytest.mark.parametrize("is_near", [False, True])
def test_long_errors_are_as_frequent_as_asked_for_elsewhere_and_more_so_near(is_near):
    seconds = 100 * 3600.0
    count = begun(ErrorTimes(LONG, [3, 8], OFTEN), seconds, lambda t: is_near)
    rate = LONG.per_hour * (OFTEN if is_near else 1.0)
    expected = seconds / (3600.0 / rate + 20.0 + 0.1)  # a pause, an error, a gap
    assert abs(count - expected) <= 4.0 * math.sqrt(expected)


def test_weights_are_right_for_long_errors_near_an_ego_that_comes_and_goes():
    found = []
    for seed in range(1200):
        times = ErrorTimes(LONG, [seed], OFTEN)
        hit = begun(times, 150.0, lambda t: 40.0 < t % 75.0 <= 55.0)
        found.append((math.exp(times.log_weight), hit))
    spread = 4.0 / math.sqrt(len(found))  # of weights whose variance is below 4
    assert sum(w for w, _ in found) / len(found) == pytest.approx(1.0, abs=2 * spread)
    # weighted, they begin as often as without a factor
    plain = [begun(ErrorTimes(LONG, [s, 5]), 150.0, bool) for s in range(1200)]
    weighted = sum(w * hit for w, hit in found) / len(found)
    assert weighted == pytest.approx(sum(plain) / len(plain), abs=spread)


def test_without_a_factor_there_is_no_weight():
    sumo = Sumo(["a"])
    errors = errors_of(sumo, braking=60.0)
    errors.update(0.0)
    assert errors.log_weight is None


class Recorded(Vehicles):
    """Vehicles that keep the parameters and modes that are set."""

    def __init__(self, ids):
        super().__init__(ids)
        self.parameters = {
            "laneChangeModel.lcAssertive": "1.5",
            "laneChangeModel.lcSpeedGain": "2.0",
        }
        self.mode = 31

    def getParameter(self, name, key):
        return self.parameters.get(key, "false")

    def setParameter(self, name, key, value):
        self.parameters[key] = value

    def getSpeedMode(self, name):
        return self.mode

    def setSpeedMode(self, name, mode):
        self.mode = mode


@pytest.mark.parametrize(
    ("field", "bit"), [("running_red", 16), ("taking_way", 8), ("cutting_in", None)]
)
def test_a_driver_is_as_before_when_an_error_is_over(field, bit):
    sumo = Sumo(["a"])
    sumo.vehicle = vehicle = Recorded(["a"])
    usual = dict(vehicle.parameters)
    settings = DriverErrorSettings(2, **{field: Occurrence(600.0, 2.0, 4.0)})
    errors = DriverErrors(sumo, settings, ())
    seen = 0
    for k in range(2000):
        errors.update(0.1 * k)
        errs = bool(errors.present())
        seen += errs
        if bit is not None:
            assert vehicle.mode == (31 & ~bit if errs else 31)
        else:
            assert (vehicle.parameters != usual) == errs
    assert seen > 100


def test_as_many_drivers_merge_late_as_asked_for():
    names = [f"car.{k}" for k in range(1000)]
    sumo = Sumo(names)
    late = set()
    sumo.vehicle.setParameter = lambda name, key, value: late.add(name)
    DriverErrors(sumo, DriverErrorSettings(1, late_mergers=0.2), ()).update(0.0)
    assert len(late) == pytest.approx(200, abs=60)


def passed_at_red(rate: float, folder) -> int:
    """Count who drives over a stop line at red, of SUMO's own traffic."""
    libsumo = load_libsumo()
    overrides = ["traffic.drivers=urban", "traffic.cross_veh_per_h=500"]
    scenario = load_scenario("intersection", seed=4, overrides=overrides)
    layout = make_layout(scenario)
    routes = write_traffic(scenario, layout, layout.network, folder)
    command = ["sumo", "-n", str(layout.network.net_file), "-r", str(routes)]
    libsumo.start([*command, "--step-length", "0.2", "--no-step-log", "--no-warnings"])
    settings = DriverErrorSettings(3, running_red=Occurrence(rate, 20.0, 20.0))
    errors = DriverErrors(libsumo, settings, ())
    before, count = {}, 0
    for k in range(700):
        errors.update(0.2 * k)
        libsumo.simulationStep()
        now = {}
        for name in libsumo.vehicle.getIDList():
            ahead = libsumo.vehicle.getNextTLS(name)
            now[name] = (ahead[0][2], ahead[0][3]) if ahead else (None, "")
        for name, (distance, state) in before.items():
            over = distance is not None and name in now and now[name][0] is None
            count += over and state == "r"
        before = now
    libsumo.close()
    return count


@pytest.mark.sumo
def test_drivers_run_red_lights(tmp_path):
    assert passed_at_red(0.0, tmp_path) == 0
    assert passed_at_red(600.0, tmp_path) >= 3
