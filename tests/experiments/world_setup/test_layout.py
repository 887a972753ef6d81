"""Layouts are remembered by what they are made from."""

import os
import shutil

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.errors import ConfigError
from experiments.world_setup.layout import _bare_layout, make_layout
from sumo_nets.build import net_path


def layout_of(name, seed=0, **overrides):
    changed = tuple(f"{key}={value}" for key, value in overrides.items())
    return make_layout(load_scenario(name, seed=seed, overrides=changed))


def test_the_same_road_is_built_once():
    first, second = layout_of("lane_change"), layout_of("lane_change", seed=1)
    assert second.road.path is first.road.path
    assert second.road.obstacles is first.road.obstacles


def test_drawn_obstacles_are_those_of_their_seed():
    first, again, other = (layout_of("dense", seed=k) for k in (0, 0, 1))
    assert again.road.obstacles is first.road.obstacles
    assert other.road.path is first.road.path
    assert not np.array_equal(other.road.obstacles.x, first.road.obstacles.x)


def test_another_body_or_obstacle_is_another_layout():
    base = layout_of("lane_change")
    longer = layout_of("lane_change", **{"ego.vehicle.length_m": 5.5})
    assert longer.task.vehicle.length == 5.5
    bare = layout_of("lane_change", obstacles="[]")
    assert bare.road.obstacles.ids == ()
    assert base.road.obstacles.ids != ()


def test_what_depends_on_more_than_the_road_is_checked_every_time():
    layout_of("lane_change")
    with pytest.raises(ConfigError, match="goal_m"):
        layout_of("lane_change", **{"ego.goal_m": 1e5})


def test_a_changed_network_is_read_again(tmp_path):
    file = tmp_path / "own.net.xml"
    shutil.copy(net_path("straight"), file)
    straight = layout_of("straight").network
    route = ", ".join(straight.route)
    section = f"{{file: {file}, route: [{route}], lane: {straight.lane}}}"
    first = layout_of("straight", network=section)
    assert layout_of("straight", network=section).road.path is first.road.path
    os.utime(file, ns=(1, 1))
    assert layout_of("straight", network=section).road.path is not first.road.path


def test_a_drawn_route_is_that_of_its_seed_whatever_was_laid_out_before(tmp_path):
    file = tmp_path / "own.yaml"
    file.write_text(
        f"name: own\nnetwork: {{file: {net_path('stop_sign')}}}\n"
        "ego: {start_m: 10, goal_m: 120}\n"
    )

    def routes(seeds):
        layouts = [make_layout(load_scenario(str(file), seed=k)) for k in seeds]
        return {k: x.network.route for k, x in zip(seeds, layouts, strict=True)}

    first = routes(range(6))
    assert len(set(first.values())) > 1
    _bare_layout.cache_clear()
    assert routes(range(5, -1, -1)) == first
