"""CommonRoad scenarios are driven: goals, replays, solutions, exports, messages."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from experiments.commonroad.checker import check_solution, find_python
from experiments.commonroad.read import read_commonroad
from experiments.commonroad.records import (
    GoalState,
    InitialState,
    PlanningProblem,
    Range,
)
from experiments.commonroad.solution import CostFunction
from experiments.commonroad.vehicles import DEFAULT
from experiments.commonroad.write import write_commonroad
from experiments.config.scenario_file import load_scenario
from experiments.cosim.goal import GoalRegion, GoalWindow
from experiments.cosim.replay_world import RecordedFuture
from experiments.episode.commonroad_export import exported_scenario
from experiments.episode.commonroad_lanelets import lanelets_of_net
from experiments.episode.commonroad_solution import read_solved_run, solution_of
from experiments.episode.replan import replan
from experiments.episode.run import run_episode
from experiments.errors import ConfigError
from experiments.trace.files import read_trace
from experiments.world_setup.layout import make_layout
from planner.states import CartesianState
from planner.vehicle import Vehicle
from sumo_nets.net_reader import read_net
from tests.experiments.commonroad.examples import (
    EXAMPLES,
    cut_in,
    dense_parking,
    lanelet,
    merge,
    scenario,
    straight,
    user,
)

SHIPPED = Path("experiments/scenarios/commonroad")


def drive(made, folder, *overrides, planner=None):
    file = folder / f"{made.benchmark_id}.xml"
    write_commonroad(made, file)
    loaded = load_scenario(str(file), planner=planner, overrides=overrides)
    return run_episode(loaded, out=folder / "runs")


def one_road(goal, start=None, moving=(), lanelets=None, name="ZAM_OneRoad-1_1_T-1"):
    own = lanelets or [
        lanelet(1, straight((0.0, 0.0), (300.0, 0.0)), beside_left=(2, True)),
        lanelet(2, straight((0.0, 3.5), (300.0, 3.5)), beside_right=(1, True)),
    ]
    begin = start or InitialState(0, 20.0, 0.0, 0.0, 10.0)
    return scenario(name, own, PlanningProblem(7, begin, (goal,)), moving)


@pytest.mark.parametrize("make", EXAMPLES, ids=lambda make: make.__name__)
def test_shipped_files_are_those_of_the_examples(make, tmp_path):
    made = make()
    file = tmp_path / "made.xml"
    write_commonroad(made, file)
    shipped = SHIPPED / f"{made.benchmark_id}.xml"
    kept, new = (
        [
            line
            for line in x.read_text("utf-8").splitlines()
            if "<commonRoad" not in line
        ]
        for x in (shipped, file)
    )
    assert kept == new


GOALS = {
    "lanelet and lane change": GoalState(Range(20, 200), lanelets=(2,)),
    "disc": GoalState(Range(1, 200), shapely.Point(120.0, 0.5).buffer(2.0)),
    "time alone": GoalState(Range(40, 45)),
    "slow": GoalState(
        Range(1, 300), shapely.box(150, -2, 170, 2), speed=Range(2.0, 4.0)
    ),
    "fast": GoalState(Range(1, 200), shapely.box(180, -2, 200, 2), speed=Range(15, 20)),
    "not before": GoalState(Range(150, 160), shapely.box(60.0, -2.0, 75.0, 2.0)),
    "late": GoalState(Range(60, 66), shapely.box(110.0, -2.0, 116.0, 2.0)),
}


@pytest.mark.parametrize("goal", GOALS.values(), ids=list(GOALS))
def test_every_kind_of_goal_is_reached(goal, tmp_path):
    outcome = drive(one_road(goal), tmp_path)
    assert outcome.row["status"] == "arrived", outcome.ending
    last = {name: column[-1] for name, column in outcome.trace.steps.items()}
    step = round(float(last["time_s"]) / 0.1)
    assert goal.steps.begin <= step <= goal.steps.end
    centre = shapely.Point(
        last["x_m"] + DEFAULT.rear * np.cos(last["heading_rad"]),
        last["y_m"] + DEFAULT.rear * np.sin(last["heading_rad"]),
    )
    area = goal.area
    if goal.lanelets:
        area = shapely.box(0.0, 1.75, 300.0, 5.25)
    assert area is None or area.covers(centre)
    if goal.speed is not None:
        assert goal.speed.begin <= last["speed_mps"] <= goal.speed.end


def test_a_goal_that_is_out_of_reach_in_time_is_missed_and_said(tmp_path):
    goal = GoalState(Range(1, 20), shapely.box(200.0, -2.0, 210.0, 2.0))
    outcome = drive(one_road(goal), tmp_path)
    assert outcome.row["status"] == "timeout"
    reason = outcome.trace.fact("reason")
    assert reason.startswith("the goal is not met by t = 2.0 s: the ego is 1")
    assert reason.endswith(" m before its area")


@pytest.mark.parametrize(
    ("s", "speed", "heading", "time", "words"),
    [
        (0.0, 5.0, 0.0, 20.0, None),
        (0.0, 5.0, 0.0, 20.2, "by t = 20.0 s: the ego is 98.6 m before its area"),
        (112.0, 5.0, 0.0, 20.2, "not met by t = 20.0 s: the ego is 3.4 m behind its"),
        (105.0, 9.0, 0.0, 20.2, "the ego drives 9.0 m/s, not 4.0 to 6.0"),
        (105.0, 5.0, 2.0, 20.2, "2.00 rad; asked for is t = 10.0 to 20.0 s, 4.0 to 6"),
        (105.0, 5.0, 0.0, 20.2, "the ego is beside its area, or in it at another"),
        (130.0, 5.0, 0.0, 12.0, "drove past the goal's area by t = 12.0 s at 5.0 m/s"),
    ],
)
def test_a_missed_goal_says_what_was_lacking(s, speed, heading, time, words):
    area = shapely.box(100, -2, 110, 2)
    window = GoalWindow((10.0, 20.0), area, 100.0, 110.0, (4.0, 6.0), (-0.1, 0.1))
    region = GoalRegion.of([window], Vehicle())
    found = region.why_missed(s, CartesianState(s, 0, heading, 0, speed, 0), time)
    assert (found is None) is (words is None)
    assert words is None or words in found


def test_the_ego_begins_exactly_where_the_file_says(tmp_path):
    start = InitialState(12, 20.0, 0.6, 0.08, 9.0, yaw_rate=0.05)
    goal = GoalState(Range(40, 200), shapely.box(100.0, -2.0, 110.0, 2.0))
    outcome = drive(one_road(goal, start), tmp_path)
    first = {name: float(outcome.trace.steps[name][0]) for name in ("x_m", "y_m")}
    assert first["x_m"] + DEFAULT.rear * np.cos(0.08) == pytest.approx(20.0, abs=1e-6)
    assert first["y_m"] + DEFAULT.rear * np.sin(0.08) == pytest.approx(0.6, abs=1e-6)
    assert outcome.row["status"] == "arrived"
    assert outcome.row["recorded_traffic"] is True
    assert outcome.row["rear_max_deceleration_mps2"] is None


def test_traffic_is_where_it_was_recorded_and_its_future_is_known(tmp_path):
    made = cut_in()
    file = tmp_path / "made.xml"
    write_commonroad(made, file)
    loaded = load_scenario(str(file))
    layout = make_layout(loaded)
    log = layout.replay.log
    users = log.at(5)
    assert users.ids == ("200", "201", "202")
    times = 0.1 * np.arange(30)
    ahead = RecordedFuture(log, 5)(layout.road.path, users, times)
    table = made.moving[0].table
    np.testing.assert_allclose(ahead.x[0], table[0, 5:35], atol=1e-5)
    np.testing.assert_allclose(ahead.y[0], table[1, 5:35], atol=1e-5)
    beyond = RecordedFuture(log, made.moving[0].last)(layout.road.path, users, times)
    driven = np.hypot(np.diff(beyond.x[0]), np.diff(beyond.y[0]))
    np.testing.assert_allclose(driven, 0.1 * table[3, -1], rtol=1e-6)
    later = RecordedFuture(log, 3).later(0.2)
    assert later.now == 5


def test_a_recorded_cycle_is_planned_again_with_the_same_future(tmp_path):
    outcome = drive(cut_in(), tmp_path, "simulation.duration_s=3.0")
    assert replan(outcome.folder, 20) == ()


@pytest.mark.parametrize("planner", ["dense", "lane_change"])
def test_other_planners_drive_there_too(planner, tmp_path):
    outcome = drive(merge(), tmp_path, planner=planner)
    # lane_change leaves a lane that ends late: it may cut the corner of its end
    assert outcome.ending.status in ("arrived", "timeout", "off_road")
    assert outcome.row["collisions"] == 0
    assert outcome.row["distance_m"] > 200.0


def test_left_driving_and_a_road_without_successor(tmp_path):
    goal = GoalState(Range(20, 200), lanelets=(3,))
    lanelets = [
        lanelet(1, straight((0.0, 0.0), (100.0, 0.0)), beside_right=(2, True)),
        lanelet(2, straight((0.0, -3.5), (100.0, -3.5)), beside_left=(1, True)),
        lanelet(3, straight((100.0, -3.5), (140.0, -3.5))),  # nobody says so
    ]
    made = one_road(goal, lanelets=lanelets, name="GBR_LeftHand-1_1_T-1")
    outcome = drive(made, tmp_path)
    assert outcome.row["status"] == "arrived"
    assert set(outcome.trace.lanes["left_hand"]) == {1}


def test_problems_of_a_file_are_chosen_by_key(tmp_path):
    goal = GoalState(Range(1, 200), lanelets=(1,))
    made = one_road(GoalState(Range(20, 200), shapely.box(80.0, -2.0, 90.0, 2.0)))
    other = PlanningProblem(8, InitialState(0, 50.0, 3.5, 0.0, 10.0), (goal,))
    made = replace(made, problems=(*made.problems, other))
    first = drive(made, tmp_path)
    second = drive(made, tmp_path, "network.planning_problem=8")
    assert [float(x.trace.steps["y_m"][0]) for x in (first, second)] == [0.0, 3.5]
    text, missing = solution_of([read_solved_run(first.folder)], CostFunction.WX1)
    assert missing == (8,)
    assert 'benchmark_id="KS2:WX1:ZAM_OneRoad-1_1_T-1:2020a"' in text
    both = [read_solved_run(run.folder) for run in (second, first)]
    text, missing = solution_of(both, CostFunction.TR1)
    assert missing == ()
    assert 'benchmark_id="[KS2,KS2]:[TR1,TR1]:ZAM_OneRoad-1_1_T-1:2020a"' in text
    with pytest.raises(ConfigError, match="solves planning problem 7 like another"):
        solution_of([both[1], both[1]], CostFunction.TR1)
    with pytest.raises(ConfigError, match="is 5; allowed: 7, 8"):
        drive(made, tmp_path, "network.planning_problem=5")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["simulation.step_s=0.05"], "step_s: is 0.05; allowed: 0.1, that of the file"),
        (["ego.goal_m=50"], "goal_m: is the planning problem's"),
        (["traffic.own_veh_per_h=300"], "traffic: is not for world commonroad"),
        (["network.route=[a]"], "network: allowed in world commonroad: file"),
        (["world=sumo"], "name: is missing"),
        (["planner=sumo", "ego.plant=perfect"], "is SUMO's own driver"),
        (["ego.perception=good", "simulation.predictor=recorded"], "beside ego.percep"),
    ],
)
def test_bad_keys_get_one_line(overrides, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        drive(dense_parking(), tmp_path, *overrides)


def test_a_goal_that_no_route_reaches_names_where_routes_end(tmp_path):
    lanelets = [
        lanelet(1, straight((0.0, 0.0), (100.0, 0.0))),
        lanelet(2, straight((0.0, 50.0), (100.0, 50.0))),
    ]
    made = one_road(GoalState(Range(1, 90), lanelets=(2,)), lanelets=lanelets)
    with pytest.raises(ConfigError, match="no route reaches its goal on lanelets 2"):
        drive(made, tmp_path)
    far = InitialState(0, 20.0, 30.0, 0.0, 9.0)
    made = one_road(GoalState(Range(1, 90), lanelets=(2,)), far, lanelets=lanelets)
    with pytest.raises(ConfigError, match="allowed: within 5 m of a lanelet"):
        drive(made, tmp_path)


def test_no_solution_is_made_of_what_solves_nothing(tmp_path):
    goal = GoalState(Range(20, 200), shapely.box(80.0, -2.0, 90.0, 2.0))
    perfect = drive(one_road(goal), tmp_path, "ego.plant=perfect")
    with pytest.raises(ConfigError, match=r"ego\.plant: is perfect"):
        solution_of([read_solved_run(perfect.folder)], CostFunction.SM1)
    late = replace(goal, steps=Range(1, 9))
    missed = drive(one_road(late), tmp_path)
    with pytest.raises(ConfigError, match="status is timeout, which solves nothing"):
        read_solved_run(missed.folder)
    other = drive(one_road(goal), tmp_path, "ego.vehicle.width_m=2.0")
    with pytest.raises(ConfigError, match="no vehicle of CommonRoad"):
        solution_of([read_solved_run(other.folder)], CostFunction.SM1)


def test_solutions_are_feasible_for_the_single_track_models(tmp_path):
    """Re-simulate each step with constant inputs; the checker allows 2 cm, 0.03 rad."""
    outcome = drive(merge(), tmp_path)
    run = read_solved_run(outcome.folder)
    from experiments.episode.commonroad_solution import _driven

    driven = _driven(run)
    x, y, steering, speed, heading = driven.states.T
    x, y = x - DEFAULT.rear * np.cos(heading), y - DEFAULT.rear * np.sin(heading)
    n = 200
    step = 0.1 / n
    at = np.array([x[:-1], y[:-1], steering[:-1], speed[:-1], heading[:-1]])
    turned = np.diff(steering) / 0.1
    pushed = np.diff(speed) / 0.1
    assert np.abs(turned).max() <= 0.4 + 1e-6
    for _ in range(n):
        rate = at[3] * np.tan(at[2] + 0.5 * step * turned) / DEFAULT.wheelbase
        middle = at[4] + 0.5 * step * rate
        at[0] += step * at[3] * np.cos(middle)
        at[1] += step * at[3] * np.sin(middle)
        at[4] += step * rate
        at[2] += step * turned
        at[3] += step * pushed
    assert np.abs(at[0] - x[1:]).max() < 0.01
    assert np.abs(at[1] - y[1:]).max() < 0.01
    assert np.abs(np.angle(np.exp(1j * (at[4] - heading[1:])))).max() < 0.01


@pytest.mark.slow
@pytest.mark.sumo
def test_an_exported_run_replays_its_traffic(tmp_path):
    loaded = load_scenario(
        "intersection", seed=3, overrides=["simulation.duration_s=15"]
    )
    outcome = run_episode(loaded, out=tmp_path)
    file = tmp_path / "left.xml"
    write_commonroad(exported_scenario(outcome.folder), file)
    replayed = make_layout(load_scenario(str(file)))
    vehicles = read_trace(outcome.folder).vehicles
    index = np.asarray(vehicles["index"])
    worst = 0.0
    for step in range(0, 150, 7):
        users = replayed.replay.log.at(step)
        rows = index == step
        assert len(users.ids) == rows.sum()
        own = np.sort_complex(vehicles["x_m"][rows] + 1j * vehicles["y_m"][rows])
        found = np.sort_complex(users.x + 1j * users.y)
        worst = max(worst, np.abs(own - found).max(initial=0.0))
    assert worst < 0.01
    assert read_commonroad(file).network.turns


def test_an_exported_kinematic_run_has_its_lanes(tmp_path):
    loaded = load_scenario(
        "thesis_straight", overrides=["simulation.duration_s=4", "ego.goal_m=30"]
    )
    outcome = run_episode(loaded, out=tmp_path)
    made = exported_scenario(outcome.folder)
    assert len(made.network.lanelets) >= 1
    assert len(made.static) == len(outcome.trace.obstacles["id"])
    with pytest.raises(ConfigError, match="world is commonroad"):
        exported_scenario(drive(dense_parking(), tmp_path).folder)


@pytest.mark.parametrize("name", ["intersection", "curved", "on_ramp"])
def test_exported_lanelets_beside_each_other_share_their_bound_exactly(name, tmp_path):
    """Slivers between them count as the road's edge to the official checker."""
    layout = make_layout(load_scenario(name))
    net = read_net(layout.network.net_file)
    network = lanelets_of_net(net, layout.road.path)
    made = replace(cut_in(), network=network, problems=cut_in().problems)
    file = tmp_path / "made.xml"
    problem = replace(made.problems[0], goals=(GoalState(Range(1, 90)),))
    write_commonroad(replace(made, problems=(problem,)), file)
    found = read_commonroad(file).network.lanelets
    pairs = [(x, found[x.same_left]) for x in found.values() if x.same_left]
    assert pairs
    for right, left in pairs:
        np.testing.assert_array_equal(right.left, left.right)


def test_a_recorded_follower_that_will_not_brake_is_kept_behind(tmp_path):
    goal = GoalState(Range(50, 120), shapely.box(150.0, -2.0, 170.0, 5.5))
    follower = user(30, straight((5.0, 0.0), (300.0, 0.0)), 14.0)
    made = one_road(goal, InitialState(0, 20.0, 0.0, 0.0, 10.0), [follower])
    assert drive(made, tmp_path).row["status"] == "arrived"
    blind = drive(made, tmp_path, "simulation.predictor=constant_speed")
    assert blind.row["status"] == "collision"  # as other worlds rely on followers


def test_the_goal_paces_the_ego():
    vehicle = Vehicle()
    window = GoalWindow((10.0, 20.0), shapely.box(100, -2, 110, 2), 100.0, 110.0)
    region = GoalRegion.of([window], vehicle)
    near = 100.0 - vehicle.centre_offset
    mean = (100.0 - vehicle.centre_offset) / (0.9 * 5.0)
    assert region.wanted_speed(5.0, 0.0, 15.0, 30.0) == pytest.approx(mean)
    assert region.wanted_speed(5.0, 0.0, 15.0, 10.0) == pytest.approx(2 * mean - 10)
    # waits for its time
    assert region.wanted_speed(20.0, near, 0.0, 5.0) == 0.0
    assert region.wanted_speed(20.0, near, 0.0, 0.0) == pytest.approx(0.9)
    ego = CartesianState(near + 1.0, 0.0, 0.0, 0.0, 5.0, 0.0)
    assert region.is_reached(ego, vehicle, 15.0)
    assert not region.is_reached(ego, vehicle, 9.8)


@pytest.mark.slow
def test_the_official_checker_accepts_what_is_solved(tmp_path):
    """Runs where `make commonroad-checker` was run, or the variable names a Python."""
    try:
        python = find_python()
    except ConfigError:
        pytest.skip("needs make commonroad-checker")
    moving = [user(30, straight((60.0, 0.0), (300.0, 0.0)), 8.0)]
    goal = GoalState(Range(20, 200), shapely.box(120.0, -2.0, 130.0, 2.0))
    for plant in ("kinematic", "dynamic"):
        outcome = drive(one_road(goal, moving=moving), tmp_path, f"ego.plant={plant}")
        run = read_solved_run(outcome.folder)
        file = tmp_path / "solution.xml"
        file.write_text(solution_of([run], CostFunction.SM1)[0], encoding="utf-8")
        report = check_solution(run.file.file, file, python)
        assert report.is_accepted, report
        assert report.cost is not None


def test_without_the_checker_one_line_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("REARVIEW_COMMONROAD_PYTHON", raising=False)
    with pytest.raises(ConfigError, match="first make commonroad-checker"):
        find_python()
    with pytest.raises(ConfigError, match="the checker failed"):
        check_solution(tmp_path, tmp_path, Path(os.sys.executable))
