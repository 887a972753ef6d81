"""Many egos as agents of a PettingZoo environment."""

import sys

import numpy as np
import pytest

from experiments.errors import ConfigError

pytest.importorskip("gymnasium")

import rearview.gym as learning

ON = np.array([1, 4])  # the own lane, at the target speed
CHANGES = {"simulation.duration_s": 20.0, "traffic.own_veh_per_h": 2400}


def test_without_the_package_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pettingzoo", None)
    monkeypatch.delitem(sys.modules, "experiments.api.gym.many_agents", raising=False)
    with pytest.raises(ConfigError, match="pip install pettingzoo"):
        learning.parallel_env()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"action": "steer"}, "allowed: control, lane_and_speed, frenet"),
        ({"egos": 0}, "egos: is 0; allowed: 1 to 500"),
        ({"egos": 501}, "egos: is 501; allowed: 1 to 500"),
        ({"repeat": 0}, "repeat: is 0"),
        ({"scenario": "straight"}, "has one ego; allowed: one with `egos`"),
    ],
)
def test_mistakes_are_one_line(options, words):
    pytest.importorskip("pettingzoo")
    with pytest.raises(ConfigError) as caught:
        learning.parallel_env(**options)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.sumo
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["control", "lane_and_speed"])
def test_the_environment_is_what_pettingzoo_wants(kind):
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test

    env = learning.parallel_env(egos=3, action=kind, repeat=5, changes=CHANGES)
    env.reset(seed=1)
    parallel_api_test(env, num_cycles=30)  # warnings are errors here
    env.close()


def episode(order=list):
    env = learning.parallel_env(egos=6, changes=CHANGES)
    seen, info = env.reset(seed=3)
    rows = [(name, facts["vehicle"]) for name, facts in info.items()]
    came = set(env.agents)
    while env.agents:
        before = set(env.agents)
        actions = dict.fromkeys(order(env.agents), ON)
        seen, rewards, terminated, truncated, info = env.step(actions)
        assert before <= set(seen)
        came |= set(seen)
        for name, observation in seen.items():
            assert env.observation_space(name).contains(observation)
            assert (terminated[name] or truncated[name]) == (name not in env.agents)
            assert (info[name]["status"] == "running") == (name in env.agents)
            rows.append((name, rewards[name], info[name]["s_m"], info[name]["status"]))
    env.close()
    return rows, came


@pytest.mark.sumo
@pytest.mark.slow
def test_agents_come_and_go_and_the_order_of_their_actions_means_nothing():
    pytest.importorskip("pettingzoo")
    rows, came = episode()
    assert len(came) == 6
    assert rows == episode(lambda names: list(reversed(names)))[0]
    assert {row[-1] for row in rows if len(row) == 4} <= {
        *("running", "timeout", "collision", "arrived")
    }


@pytest.mark.sumo
@pytest.mark.slow
def test_every_agent_has_to_act():
    pytest.importorskip("pettingzoo")
    env = learning.parallel_env(egos=3, changes=CHANGES)
    env.reset(seed=3)
    with pytest.raises(ConfigError, match="ego_0: None; allowed: MultiDiscrete"):
        env.step({})
    with pytest.raises(ConfigError, match=r"ego_0: array\(\[9, 9\]\)"):
        env.step(dict.fromkeys(env.agents, np.array([9, 9])))
    env.close()
