"""What the ego costs others: by hand on made-up ways, and in SUMO against itself."""

import json

import duckdb
import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.without_ego import WithoutEgoWorld
from experiments.episode.run import PLACEBO_FILES, WITHOUT_EGO_FILE, run_episode
from experiments.episode.run_folder import OutputOptions
from experiments.episode.without_ego import SharedTraffic
from experiments.errors import ConfigError
from experiments.metrics.without_ego import Cost, costs
from experiments.trace.files import read_trace
from experiments.trace.recording import vehicle_table
from experiments.trace.schema import Table, Trace, trace_hash
from experiments.world_setup.layout import make_layout
from experiments.world_setup.world import make_world, make_world_without_ego
from planner.states import CartesianState
from tests.experiments.traces import STEP, STRAIGHT, record, trace_of, traffic

N = 101  # 10 s
FREE = 100.0 + 20.0 * STEP * np.arange(N)  # places of a free car [m]
EGO = 150.0


def car(s, speed, acceleration=0.0, name="a", l=0.0):
    return (name, s, l, 0.0, speed, acceleration)


def trace(ways) -> Trace:
    """Ego stands at `EGO`; ways are lists of cars, one each step."""
    ego = CartesianState(EGO, -3.5, 0, 0, 0, 0)
    return trace_of(
        [record(k, ego, cars=cars) for k, cars in enumerate(zip(*ways, strict=True))]
    )


def table(ways) -> Table:
    moments = []
    for k, cars in enumerate(zip(*ways, strict=True)):
        moments.append((k, traffic(k * STEP, cars)))
    return vehicle_table(STRAIGHT, moments)


def free_way(name="a", l=0.0):
    return [car(s, 20.0, name=name, l=l) for s in FREE]


def slowed_way(name="a"):
    """10 m/s for 4 s from t = 2 s on: 40 m and 2 s are lost."""
    t = STEP * np.arange(N)
    lost = 10.0 * np.clip(t - 2.0, 0.0, 4.0)
    speed = np.where((t >= 2.0) & (t < 6.0), 10.0, 20.0)
    braking = np.where(np.isclose(t, 2.0), -3.0, 0.0)
    ways = zip(FREE - lost, speed, braking, strict=True)
    return [car(s, v, a, name) for s, v, a in ways]


def test_nothing_lost_where_both_ways_are_one():
    (found,) = costs(trace([free_way()]), table([free_way()]))
    assert found == Cost("a", pytest.approx(0.0), pytest.approx(0.0), 0.0)


def test_delay_is_the_lost_way_over_the_free_speed():
    (found,) = costs(trace([slowed_way()]), table([free_way()]))
    assert found.delay == pytest.approx(2.0)
    assert found.speed_loss == pytest.approx(10.0)
    assert found.added_deceleration == pytest.approx(3.0)
    (gain,) = costs(trace([free_way()]), table([slowed_way()]))
    assert gain.delay == pytest.approx(-2.0)
    assert gain.speed_loss == pytest.approx(0.0)
    assert gain.added_deceleration == 0.0


def test_who_is_made_to_stand_counts_until_the_end():
    # stands at 140 m from t = 2 s on, where the free one passes at 2 s
    s = np.minimum(FREE, 140.0)
    way = [car(x, 20.0 if x < 140.0 else 0.0) for x in s]
    (found,) = costs(trace([way]), table([free_way()]))
    assert found.delay == pytest.approx(8.0)
    assert found.speed_loss == pytest.approx(20.0)


@pytest.mark.parametrize(
    "way",
    [
        [car(EGO + 20.0 + 20.0 * STEP * k, 20.0) for k in range(N)],  # ahead
        [("a", s, 4.0, np.pi, 20.0, 0.0) for s in FREE],  # oncoming
        free_way(l=9.0),  # beside the road
    ],
)
def test_who_is_not_behind_the_ego_is_not_compared(way):
    assert costs(trace([way]), table([way])) == []


def test_who_is_missing_in_one_of_the_runs_is_left_out():
    found = costs(trace([free_way("a"), slowed_way("b")]), table([free_way("b")]))
    assert [cost.id for cost in found] == ["b"]


def changed_lane(*overrides, **options):
    overrides = ("simulation.without_ego=true", *overrides)
    return load_scenario("lane_change", overrides=overrides, **options)


@pytest.mark.sumo
def test_the_run_without_the_ego_is_the_same_traffic(tmp_path):
    scenario = changed_lane("simulation.duration_s=12", seed=3)
    outcome = run_episode(scenario, out=tmp_path)
    relation = duckdb.sql(
        f"SELECT index, id, x_m, y_m, speed_mps "
        f"FROM '{outcome.folder / WITHOUT_EGO_FILE}'"
    )
    without = {(k, name): rest for k, name, *rest in relation.fetchall()}
    vehicles = outcome.trace.vehicles
    first = np.flatnonzero(vehicles["index"] == 0)
    assert first.size > 2
    for row in first:
        key = (0, str(vehicles["id"][row]))
        there = [float(vehicles[c][row]) for c in ("x_m", "y_m", "speed_mps")]
        assert without[key] == there
    # the ego is no part of it, and everyone whom the ego saw is
    assert {name for _, name in without} == set(vehicles["id"].tolist())
    row = json.loads((outcome.folder / "metrics.json").read_text())
    assert row["behind_compared"] >= 1


@pytest.mark.sumo
def test_the_run_without_the_ego_changes_no_trace(tmp_path):
    options = {"seed": 4, "overrides": ["simulation.duration_s=10"]}
    bare = run_episode(load_scenario("lane_change", **options), out=tmp_path)
    both = run_episode(
        changed_lane("simulation.duration_s=10", seed=4), out=tmp_path / "both"
    )
    assert trace_hash(read_trace(both.folder)) == bare.trace_hash
    assert bare.row["behind_compared"] is None
    assert both.row["behind_compared"] is not None
    assert not (bare.folder / WITHOUT_EGO_FILE).exists()
    again = run_episode(
        changed_lane("simulation.duration_s=10", seed=4), out=tmp_path / "again"
    )
    names = [n for n in both.row if n.startswith("behind_")]
    assert [again.row[n] for n in names] == [both.row[n] for n in names]


@pytest.mark.sumo
def test_an_ego_that_blocks_the_lane_costs_those_behind(tmp_path):
    # 5 m/s on a road of 16.67 m/s, and all the traffic in the ego's own lane
    scenario = load_scenario(
        "lane_change_leader",
        planner="cruise",
        seed=2,
        overrides=(
            "simulation.without_ego=true",
            "traffic.own_lane=0",
            "traffic.slow_leader=null",
            "ego.target_speed_mps=5",
            "ego.depart_speed_mps=5",
            "simulation.duration_s=40",
        ),
    )
    row = run_episode(scenario, out=tmp_path).row
    assert row["behind_delay_max_s"] > 1.0
    assert row["behind_speed_loss_mps"] > 3.0
    assert row["behind_delay_mean_s"] <= row["behind_delay_max_s"]


@pytest.mark.sumo
def test_placebos_are_the_same_traffic_with_other_random_numbers(tmp_path):
    overrides = ("simulation.placebo=true", "simulation.duration_s=15")
    outcome = run_episode(
        changed_lane(*overrides, "traffic.density=dense", seed=3), out=tmp_path
    )
    tables = [
        {
            (k, name): (x, v)
            for k, name, x, v in duckdb.sql(
                f"SELECT index, id, x_m, speed_mps FROM '{outcome.folder / file}'"
            ).fetchall()
        }
        for file in (WITHOUT_EGO_FILE, *PLACEBO_FILES)
    ]
    at_entry = [{key: row for key, row in t.items() if key[0] == 0} for t in tables]
    assert len(at_entry[0]) > 3
    for other in at_entry[1:]:
        assert other.keys() == at_entry[0].keys()
        for key, row in other.items():
            assert row == pytest.approx(at_entry[0][key], abs=1e-6)
    shared = tables[1].keys() & tables[2].keys()
    gaps = [abs(tables[1][key][0] - tables[2][key][0]) for key in shared]
    assert max(gaps) > 0.01
    assert outcome.row["placebo_delay_mean_s"] is not None
    assert not list(outcome.folder.glob("state*"))


@pytest.mark.sumo
def test_planners_share_the_run_without_the_ego(tmp_path, monkeypatch):
    """Nothing is driven again that is the same, and the figures are those of before."""
    driven = []
    drive = WithoutEgoWorld.drive

    def counted(self, *args):
        driven.append(args)
        return drive(self, *args)

    monkeypatch.setattr(WithoutEgoWorld, "drive", counted)
    shared = SharedTraffic()
    runs = []  # not shared, shared, and how many were driven for the latter
    for planner in ("sumo", "sumo_tuned", "lane_change", "idm_mobil", "sumo_sublane"):
        scenario = load_scenario(
            "lane_change",
            planner=planner,
            seed=3,
            overrides=[
                "simulation.without_ego=true",
                "simulation.placebo=true",
                "simulation.duration_s=8",
                "traffic.density=dense",
            ],
        )
        alone = run_episode(scenario, out=tmp_path / planner)
        before = len(driven)
        target = tmp_path / f"shared-{planner}"
        output = OutputOptions(target, shared=shared)
        runs.append((alone, run_episode(scenario, output=output), len(driven) - before))
    assert [n for _, _, n in runs] == [3, 0, 0, 0, 3]
    for alone, together, _ in runs:
        assert alone.row["behind_compared"] is not None
        assert alone.row["placebo_delay_mean_s"] is not None
        for name in (WITHOUT_EGO_FILE, *PLACEBO_FILES):
            one, other = (
                duckdb.sql(f"SELECT * FROM '{run.folder / name}'").fetchall()
                for run in (alone, together)
            )
            assert one == other


@pytest.mark.sumo
def test_a_longer_episode_drives_the_shared_run_again(tmp_path):
    shared = SharedTraffic()
    scenario = changed_lane(seed=3)
    layout = make_layout(scenario)
    world = make_world(scenario, layout, tmp_path)
    world.enter()
    world.close()
    runs = []
    for n_steps in (30, 90, 50):
        without = make_world_without_ego(scenario, layout, tmp_path)
        found = shared.drive(scenario, without, world.entry_steps, n_steps)
        without.close()
        assert len(found) == n_steps
        runs.append(found)
    for short, long, within in zip(*runs, strict=False):
        np.testing.assert_array_equal(short.vehicles.table, long.vehicles.table)
        assert within is long


@pytest.mark.sumo
def test_a_repetition_has_the_same_demand_and_another_course(tmp_path):
    runs = [
        run_episode(
            load_scenario(
                "lane_change",
                seed=3,
                overrides=[f"simulation.repetition={r}", "simulation.duration_s=10"],
            ),
            out=tmp_path,
        )
        for r in (0, 1, 1)
    ]
    routes = [(run.folder / "traffic.rou.xml").read_text() for run in runs]
    assert routes[0] == routes[1]
    assert runs[0].trace_hash != runs[1].trace_hash == runs[2].trace_hash


def test_a_placebo_needs_the_run_without_the_ego():
    with pytest.raises(ConfigError, match="placebo: needs without_ego"):
        load_scenario("lane_change", overrides=["simulation.placebo=true"])
