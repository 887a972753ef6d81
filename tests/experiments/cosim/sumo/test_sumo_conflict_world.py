"""A scripted cut-in among SUMO's traffic; the ego keeps its speed."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.conflict_world import PREFIX, SumoConflictWorld
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from experiments.world_setup.world import make_world
from planner.reference_path.frenet import state_on_path

STEPS = 80
GAP = 60.0  # so far ahead that the ego does not reach it
SPEED = 16.667


def made(tmp_path, *overrides):
    scenario = load_scenario("cut_in_traffic", overrides=overrides)
    layout = make_layout(scenario)
    return layout, make_world(scenario, layout, tmp_path)


def driven(folder, steps, *overrides):
    """Return the layout and the traffic of each step."""
    layout, world = made(folder, f"conflict.gap_m={GAP}", *overrides)
    assert isinstance(world, SumoConflictWorld)
    try:
        world.enter()
        seen = [world.observe()]
        path, start = layout.road.path, layout.task.start
        for k in range(1, steps):
            s = start.s + SPEED * 0.1 * k
            world.advance(replace(state_on_path(path, s, start.l, 0.0), speed=SPEED))
            seen.append(world.observe())
        named = [name for name in seen[-1].vehicles.ids if name.startswith(PREFIX)]
        assert not named
    finally:
        world.close()
    return layout, seen


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    return driven(tmp_path_factory.mktemp("conflict"), STEPS)


def other(layout, traffic):
    """Return s, l and speed of the scripted vehicle."""
    users = traffic.vehicles
    k = users.ids.index("other")
    s, l = layout.road.path.project(users.x[k : k + 1], users.y[k : k + 1])
    return s[0], l[0], users.speed[k]


def test_it_cuts_in_as_scripted(drive):
    layout, seen = drive
    start, vehicle = layout.task.start, layout.task.vehicle
    ramp = 9  # steps up to 1.2 m/s at 1.5 m/s², as numpy counts 1.2 over 0.15
    s, l, speed = other(layout, seen[ramp - 1])
    front = start.s + vehicle.front_reach + SPEED * 0.1 * (ramp - 1)
    assert s - 0.5 * 4.3 - front == pytest.approx(GAP, abs=1e-3)
    assert l - start.l == pytest.approx(-3.5, abs=0.05)
    assert speed == pytest.approx(8.333)
    _, l, _ = other(layout, seen[-1])
    assert l == pytest.approx(start.l, abs=1e-6)


def test_traffic_keeps_clear_of_it(tmp_path):
    slow = ("conflict.lateral_speed_mps=0", "conflict.other_speed_mps=4")
    layout, seen = driven(tmp_path, 150, *slow, "traffic.density=dense")
    near = 0
    for traffic in seen:
        users = traffic.vehicles
        s, l, _ = other(layout, traffic)
        along, across = layout.road.path.project(users.x, users.y)
        mine = np.array(users.ids) == "other"
        gap_s = np.abs(along - s) - 0.5 * (users.length + 4.3)
        gap_l = np.abs(across - l) - 0.5 * (users.width + 1.9)
        assert not np.any((gap_s < 0.0) & (gap_l < 0.0) & ~mine)
        near += int(np.any((gap_s < 20.0) & (gap_l < 0.0) & ~mine & (along < s)))
    assert near > 10  # somebody follows it


def test_it_moves_for_the_planner_with_its_lateral_speed(drive):
    _, seen = drive
    users = seen[12].vehicles
    assert users.lateral_speed[users.ids.index("other")] == pytest.approx(1.2)
    assert list(users.ids) == sorted(users.ids)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["conflict.follower=true"], "traffic follows in world sumo"),
        (["ego.depart_speed_mps=max"], "allowed with a conflict in world sumo"),
        (["network=lane_change"], "the ego's lane has none beside it there"),
        (["planner=sumo"], "allowed with a conflict: any other planner"),
        (["simulation.without_ego=true"], "allowed with a conflict: false"),
        (
            ["network={file: a.net.xml, vehicle: v}", "traffic={sumocfg: a.sumocfg}"],
            "network.vehicle: is beside conflict",
        ),
    ],
)
def test_impossible_conflicts_in_traffic_are_refused(overrides, words, tmp_path):
    with pytest.raises(ConfigError) as error:
        made(tmp_path, *overrides)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
