import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.conflict_world import ConflictWorld
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from experiments.world_setup.world import make_world


def world_of(name, *overrides, tmp_path):
    scenario = load_scenario(name, overrides=overrides)
    return make_world(scenario, make_layout(scenario), tmp_path)


@pytest.mark.parametrize(
    ("name", "ids"),
    [
        ("cut_in", ("other",)),
        ("cut_out", ("leader",)),
        ("braking_leader", ("other",)),
    ],
)
def test_shipped_conflicts_begin_with_the_vehicles_that_can_be_seen(
    name, ids, tmp_path
):
    world = world_of(name, tmp_path=tmp_path)
    assert isinstance(world, ConflictWorld)
    ego = world.enter()
    assert world.observe().vehicles.ids == ids
    assert ego.speed == pytest.approx(60.0 / 3.6, abs=1e-3)


def test_follower_is_there_on_demand(tmp_path):
    world = world_of("cut_in", "conflict.follower=true", tmp_path=tmp_path)
    world.enter()
    assert world.observe().vehicles.ids == ("other", "follower")


@pytest.mark.parametrize(
    ("name", "override", "words"),
    [
        ("cut_in", "conflict.width_m=3.6", "must lie between 0 m and the lane's width"),
        ("cut_in", "conflict.other_speed_mps=20", "less than the ego's 16.667 m/s"),
        ("cut_in", "conflict.gap_m=0", "conflict.gap_m"),
        ("cut_in", "conflict.gap_m=null", "is missing; cut_in needs it"),
        ("cut_in", "conflict.deceleration_mps2=3", "is not for cut_in"),
        ("cut_in", "road.lanes.count=2", "allowed with a conflict: {count: 3}"),
        ("cut_in", "simulation.step_s=0.05", "allowed with a conflict: 0.1"),
        ("cut_out", "conflict.lateral_speed_mps=0", "allowed: more than 0"),
        ("braking_leader", "conflict.profile=quintic", "is not for braking"),
    ],
)
def test_impossible_conflicts_are_refused_in_one_line(name, override, words, tmp_path):
    with pytest.raises(ConfigError) as error:
        world_of(name, override, tmp_path=tmp_path)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
