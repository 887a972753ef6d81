"""Environments of Gymnasium and policies that drive as planners."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.api.gym.policy import BatchPolicyPlanner
from experiments.errors import ConfigError
from planner.interface import BatchPlanner
from planner.vehicle import Vehicle

pytest.importorskip("gymnasium")

import gymnasium
import rearview
import rearview.gym as learning
from gymnasium.utils.env_checker import check_env

from tests.experiments.api.onnx_file import write_linear_policy
from tests.planner.scenes import Car, Disc, ego_on, make_scene, straight, winding

NAMES = ("rearview/LaneChange-v0", "rearview/Cruise-v0", "rearview/Route-v0")
EMPTY = {"obstacles": "none"}
KINDS = [kind.value for kind in learning.ActionKind]


def kinematic(**options):
    return learning.DrivingEnv("thesis_straight", **options)


@pytest.mark.sumo
@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_environments_are_what_gymnasium_wants(name):
    pytest.importorskip("matplotlib")
    env = gymnasium.make(name, disable_env_checker=True)
    check_env(env.unwrapped)  # warnings are errors here
    env.close()


@pytest.mark.parametrize("kind", KINDS)
def test_random_actions_stay_in_the_spaces_and_repeat(kind):
    def episode():
        env = kinematic(action=kind)
        env.action_space.seed(3)
        seen, info = env.reset(seed=4)
        assert info["scenario_seed"] == 4
        rows = []
        for _ in range(150):
            assert env.observation_space.contains(seen)
            seen, reward, terminated, truncated, info = env.step(
                env.action_space.sample()
            )
            rows.append((reward, info["status"], *seen["ego"].tolist()))
            assert not (terminated and truncated)
            assert (terminated or truncated) == (info["status"] != "running")
            if terminated or truncated:
                break
        env.close()
        return rows

    first = episode()
    assert first == episode()
    assert first[-1][1] != "simulator_failed"


@pytest.mark.parametrize("kind", ["control", "frenet"])
def test_numbers_of_another_precision_are_cast(kind):
    size = 2 if kind == "control" else 3
    env = kinematic(action=kind, changes=EMPTY)
    seen = []
    for dtype in (np.float32, np.float64):
        env.reset(seed=0)
        seen.append(env.step(np.full(size, 0.1, dtype))[0]["ego"].tolist())
    assert seen[0] == seen[1]
    for wrong in (np.full(size, 1.1), np.full(size, np.nan), np.zeros(size, complex)):
        with pytest.raises(ConfigError, match="is not in"):
            env.step(wrong)
    env.close()


def test_endings_are_told_apart():
    env = kinematic(action="control", changes=EMPTY)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="is not in"):
        env.step(np.zeros(3, np.float32))
    straight = np.zeros(2, np.float32)
    total = 0.0
    for _ in range(1000):
        _, reward, terminated, truncated, info = env.step(straight)
        total += reward
        if terminated:
            break
    assert (info["status"], truncated, info["is_success"]) == ("arrived", False, True)
    assert total == pytest.approx(170.0 / 13.8889 + 5.0, abs=0.2)  # seconds, arrival
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(straight)

    env.reset(seed=0)
    for _ in range(1000):
        *_, terminated, truncated, info = env.step(np.array([0.0, 1.0], np.float32))
        if terminated:
            break
    assert info["status"] == "off_road"
    env.close()

    short = {**EMPTY, "simulation.duration_s": 2.0}
    env = kinematic(action="control", changes=short, repeat=30)
    env.reset(seed=0)
    _, reward, terminated, truncated, info = env.step(straight)
    assert (info["status"], terminated, truncated) == ("timeout", False, True)
    assert info["time_s"] == pytest.approx(2.0)  # not beyond the end
    assert reward == pytest.approx(2.0, abs=0.01)

    env = kinematic(action="control")  # an obstacle stands in the way
    env.reset(seed=0)
    for _ in range(1000):
        _, reward, terminated, _, info = env.step(straight)
        if terminated:
            break
    assert info["status"] == "collision"
    assert reward < -9.0


def test_seeds_are_drawn_from_the_generator():
    env = kinematic(seeds=range(5, 9))
    first = [env.reset(seed=1)[1]["scenario_seed"]]
    first += [env.reset()[1]["scenario_seed"] for _ in range(6)]
    again = [env.reset(seed=1)[1]["scenario_seed"]]
    again += [env.reset()[1]["scenario_seed"] for _ in range(6)]
    assert first == again
    assert first[0] == 1
    assert set(first[1:]) <= set(range(5, 9))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"action": "steer"}, "allowed: control, lane_and_speed, frenet"),
        ({"changes": {"ego.gaol_m": 1}}, "did you mean goal_m?"),
        ({"repeat": 0}, "allowed: 1 to"),
        ({"repeat": 2.5}, "repeat: is 2.5; allowed: 1 to"),
        ({"seeds": range(0)}, "seeds: are range(0, 0); allowed: at least one"),
        ({"seeds": 5}, "seeds: is 5; allowed: a range or list of whole numbers"),
        ({"seeds": [1, 2.5]}, "seeds: hold 2.5; allowed: a range or list of whole"),
        ({"seeds": range(-3, 3)}, "seeds: hold -3; allowed: a range or list of whole"),
        ({"reward": 3}, "reward: is 3; allowed: a function of a Transition"),
        ({"render_mode": "human"}, "allowed: rgb_array, None"),
        ({"changes": {"simulation.planning_period_s": 0.2}}, "acts in every step"),
    ],
)
def test_mistakes_are_one_line(options, words):
    with pytest.raises(ConfigError) as caught:
        kinematic(**options)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_many_egos_are_for_another_environment():
    with pytest.raises(ConfigError, match=r"allowed: one ego, or rearview\.gym\.par"):
        learning.DrivingEnv("motorway")


@pytest.mark.parametrize("name", ["bodies", "points", "spacing"])
def test_an_observation_holds_something(name):
    with pytest.raises(ConfigError, match=f"{name}: is 0; allowed: more than 0"):
        learning.ObservationShape(**{name: 0})


@pytest.mark.sumo
def test_actions_drive_the_ego_of_a_scenario_of_sumos_driver():
    """Whose world moves the ego itself, were it not for that."""
    action = np.array([1, 0])  # stop

    def ends(planner):
        env = learning.DrivingEnv("straight", changes={"planner": planner}, repeat=20)
        env.reset(seed=1)
        return env.step(action)[-1]["speed_mps"]

    assert ends("sumo") == ends("cruise")


def test_without_the_package_one_line_says_how_to_get_it():
    code = "import sys; sys.modules['gymnasium'] = None; import rearview.gym"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "rearview.gym needs gymnasium; install it: pip" in done.stderr


def test_a_picture_shows_the_ego():
    pytest.importorskip("matplotlib")
    env = kinematic(render_mode="rgb_array")
    assert env.render() is None
    env.reset(seed=0)
    shown = env.render()
    assert shown.shape == (240, 720, 3)
    assert (shown == (213, 94, 0)).all(axis=2).sum() > 100  # the ego's colour
    env.close()


@pytest.mark.sumo
@pytest.mark.slow
def test_another_episode_of_the_process_ends_the_first():
    one, other = (gymnasium.make(NAMES[0]).unwrapped for _ in range(2))
    one.reset(seed=0)
    other.reset(seed=0)
    with pytest.raises(gymnasium.error.ResetNeeded, match="AsyncVectorEnv"):
        one.step(np.array([1, 4]))
    other.step(np.array([1, 4]))
    other.close()


@pytest.mark.sumo
@pytest.mark.slow
def test_vectors_have_a_process_each_and_the_same_episodes():
    vector = gymnasium.make_vec(NAMES[0], num_envs=2, vectorization_mode="async")
    seen, info = vector.reset(seed=[0, 1])
    assert info["scenario_seed"].tolist() == [0, 1]
    for _ in range(5):
        seen, reward, *_ = vector.step(np.array([[1, 4], [1, 4]]))
    vector.close()
    env = gymnasium.make(NAMES[0])
    env.reset(seed=1)
    for _ in range(5):
        alone, alone_reward, *_ = env.step(np.array([1, 4]))
    env.close()
    assert reward[1] == alone_reward
    for name, values in alone.items():
        assert (seen[name][1] == values).all()


def policy_of(action):
    return lambda observation: np.asarray(action) + 0 * int(observation["mask"].sum())


def steady(repeat=1):
    """Be the factory of a user's planner."""
    return learning.PolicyPlanner(
        policy_of([0.2, 0.01]), learning.ActionKind.CONTROL, repeat=repeat
    )


@pytest.mark.parametrize("repeat", [1, 3])
def test_a_policy_of_many_is_asked_once_for_all_whose_action_is_over(repeat):
    path, asked = straight(), []
    scenes = [make_scene(path, ego_on(path, 50.0, 0.0, v)) for v in (5.0, 8.0, 11.0)]

    def of_many(observations):
        asked.append(len(observations))
        return [np.array([0.1 * one["ego"][0], 0.0]) for one in observations]

    def of_one(observation):
        return of_many([observation])[0]

    planner = BatchPolicyPlanner(
        of_one, learning.ActionKind.CONTROL, repeat=repeat, of_many=of_many
    )
    assert isinstance(planner, BatchPlanner)
    assert not isinstance(steady(), BatchPlanner)
    memories = [None] * 3
    for _ in range(4):
        alone = list(map(planner.plan, scenes, memories))
        asked.clear()
        plans = planner.plan_many(scenes, memories)
        over = memories[0] is None or memories[0][1] >= repeat
        assert asked == ([3] if over else [])
        for one, other in zip(plans, alone, strict=True):
            assert one.memory[1] == other.memory[1]
            np.testing.assert_array_equal(one.trajectory.x, other.trajectory.x)
        memories = [plan.memory for plan in plans]


@pytest.mark.parametrize("repeat", [1, 4])
def test_a_policy_drives_in_runs_as_in_its_environment(repeat, tmp_path, monkeypatch):
    (tmp_path / "my_policy.py").write_text(
        "from tests.experiments.api.test_gym import steady\n"
        "def make(repeat=1): return steady(repeat)\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    changes = {**EMPTY, "simulation.duration_s": 3.0}
    scenario = rearview.Scenario.load("thesis_straight").with_(
        changes, planner="my_policy:make", seed=2, settings={"repeat": repeat}
    )
    steps = scenario.run(tmp_path / "runs").frames()["steps"]
    env = kinematic(action="control", changes=changes, repeat=repeat)
    env.reset(seed=2)
    places = []
    while True:
        *_, terminated, truncated, info = env.step(np.array([0.2, 0.01], np.float32))
        places.append((info["time_s"], info["s_m"], info["l_m"], info["speed_mps"]))
        if terminated or truncated:
            break
    driven = {round(row.time_s, 6): row for row in steps.itertuples()}
    for time, s, l, speed in places:
        row = driven[round(time, 6)]
        assert (row.s_m, row.l_m, row.speed_mps) == pytest.approx((s, l, speed))


@pytest.mark.parametrize("first", [1, None], ids=["one at a time", "any number"])
def test_a_policy_of_an_onnx_file_drives_as_its_formula(first, tmp_path):
    pytest.importorskip("onnxruntime")
    width = learning.ObservationShape().shapes["ego"][0]
    weights = np.random.default_rng(3).uniform(-0.2, 0.2, (width, 2))
    write_linear_policy(tmp_path / "linear.onnx", weights, first)
    planner = learning.onnx_planner(str(tmp_path / "linear.onnx"), action="control")
    assert isinstance(planner, BatchPlanner) == (first is None)
    path = straight()
    scenes = [make_scene(path, ego_on(path, 50.0, 0.3, v)) for v in (5.0, 8.0, 11.0)]
    plans = [planner.plan(scene, None) for scene in scenes]
    if isinstance(planner, BatchPlanner):
        plans += planner.plan_many(scenes, [None] * len(scenes))
    for scene, plan in zip(2 * scenes, plans, strict=False):
        seen = learning.observe(scene, learning.ObservationShape())["ego"]
        action = seen @ weights.astype(np.float32)
        np.testing.assert_allclose(plan.memory[0], action, atol=1e-6)
        driven = learning.drive(learning.ActionKind.CONTROL, plan.memory[0], scene)
        np.testing.assert_array_equal(plan.trajectory.x, driven.x)


def test_onnx_planner_names_what_it_needs(tmp_path):
    pytest.importorskip("onnxruntime")
    with pytest.raises(ConfigError, match="no such file"):
        learning.onnx_planner("nowhere.onnx")
    (tmp_path / "odd.onnx").write_text("no model")
    with pytest.raises(ConfigError, match="cannot be read"):
        learning.onnx_planner(str(tmp_path / "odd.onnx"))
    with pytest.raises(ConfigError, match="allowed: control, lane_and_speed, frenet"):
        learning.onnx_planner(str(tmp_path / "odd.onnx"), action="any")


CAR = Vehicle()
numbers = st.floats(-1.0, 1.0)


@given(
    kind=st.sampled_from(KINDS),
    speed=st.floats(0.0, 16.0),
    l=st.floats(-1.5, 1.5),
    acceleration=st.floats(-3.0, 2.0),
    shares=st.tuples(numbers, numbers, numbers),
)
def test_trajectories_start_at_the_ego_and_keep_the_limits(
    kind, speed, l, acceleration, shares
):
    kind = learning.ActionKind(kind)
    path = straight()
    ego = ego_on(path, 50.0, l, speed, acceleration=acceleration)
    scene = make_scene(path, ego)
    action = np.array(shares[: 2 if kind == "control" else 3], np.float32)
    if kind == "lane_and_speed":
        action = np.array([1 + round(shares[0]), 2 + round(2 * shares[1])])
    plan = learning.drive(kind, action, scene)
    assert plan is not None
    assert (plan.x[0], plan.y[0]) == pytest.approx((scene.ego.x, scene.ego.y), abs=1e-9)
    assert plan.speed[0] == pytest.approx(speed, abs=1e-9)
    assert plan.speed.min() >= -1e-9
    moved = np.hypot(np.diff(plan.x), np.diff(plan.y))
    mean = 0.5 * (plan.speed[1:] + plan.speed[:-1])
    assert moved == pytest.approx(mean * scene.step, abs=0.02)
    limits = CAR.limits
    assert np.abs(plan.curvature).max() <= limits.max_curvature * 1.3 + 1e-9
    if kind == "control":
        assert plan.acceleration.max() <= limits.max_acceleration + 1e-6
        assert plan.acceleration.min() >= -limits.max_deceleration - 1e-6


def test_observations_are_those_of_the_ego_s_frame():
    path = winding()
    ego = ego_on(path, 40.0, 0.5, 10.0, error=0.1)
    rows = [Car(60.0, 0.0, 8.0), Car(20.0, -2.0, -5.0, length=9.0, width=2.5)]
    scene = make_scene(path, ego, [Disc(50.0, 1.0, 0.8)], rows, stop_lines=(70.0,))
    seen = learning.observe(scene, learning.ObservationShape(bodies=4, points=7))
    assert seen["mask"].tolist() == [1.0, 1.0, 1.0, 0.0]
    assert not seen["vehicles"][3].any()
    disc = scene.obstacles
    bodies = [
        (disc.x[0], disc.y[0], disc.heading[0], 0.0, 1.6, 1.6),
        *(
            (u.x[k], u.y[k], u.heading[k], u.speed[k], u.length[k], u.width[k])
            for u in [scene.vehicles]
            for k in range(2)
        ),
    ]
    bodies.sort(key=lambda body: math.dist(body[:2], (ego.x, ego.y)))
    for row, (x, y, heading, speed, length, width) in zip(
        seen["vehicles"], bodies, strict=False
    ):
        place = complex(x - ego.x, y - ego.y) / complex(
            math.cos(ego.heading), math.sin(ego.heading)
        )
        turned = heading - ego.heading
        expected = (
            place.real / 120.0,
            place.imag / 30.0,
            (speed * math.cos(turned) - ego.speed) / 40.0,
            speed * math.sin(turned) / 40.0,
            math.cos(turned),
            math.sin(turned),
            length / 20.0,
            width / 5.0,
        )
        assert row == pytest.approx(expected, abs=1e-6)
    assert seen["path"].shape == (7, 5)
    front = 40.0 + scene.vehicle.front_reach
    assert seen["signals"] == pytest.approx((1.0, (70.0 - front) / 100.0))
    assert seen["ego"][3:5] == pytest.approx((0.05, 0.1 / math.pi))
