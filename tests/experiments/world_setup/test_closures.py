import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.road import Closure
from experiments.errors import ConfigError
from experiments.world_setup.closures import closed_lanes
from experiments.world_setup.layout import make_layout
from experiments.world_setup.tuned_driver import SUBLANE_FILE, tuned_driver
from experiments.world_setup.world import SUMO_DRIVERS, sumo_driver

CLOSED = ("lane_change", "lane_change_three", "lane_change_curved")


def layout_of(name, *overrides, planner="sumo"):
    scenario = load_scenario(name, planner=planner, overrides=overrides)
    return scenario, make_layout(scenario)


def closed(name, *overrides, told=True, planner="sumo"):
    scenario, layout = layout_of(name, *overrides, planner=planner)
    return closed_lanes(scenario, layout, layout.network, told=told)


def test_a_closure_is_known_from_its_distance_on():
    closure = Closure(794.0, known_from=150.0)
    assert not closure.is_known(643.9)
    assert closure.is_known(644.0)
    assert Closure(794.0).is_known(0.0)


def test_planners_get_the_obstacles_once_they_are_told():
    _, layout = layout_of("lane_change", "obstacles.known_from_m=150")
    assert layout.road.closure == Closure(794.0, 150.0)
    assert layout.road.known_obstacles(600.0).ids == ()
    assert layout.road.known_obstacles(650.0).ids == ("obstacle.0",)


@pytest.mark.parametrize("name", CLOSED)
def test_the_lanes_of_the_obstacle_are_found(name):
    edge = "own5" if "curved" in name else "own2"
    index = 1 if "three" in name else 0
    lanes = (f"{edge}_{index}",)
    found = closed(name)
    assert (found.lanes, found.disallowed, found.twins) == (lanes, False, True)
    assert closed(name, told=False).lanes == ()
    found = closed(name, "obstacles.closure=disallowed", told=False)
    assert (found.lanes, found.disallowed, found.twins) == (lanes, True, False)


def test_the_end_of_a_lane_needs_no_vehicle_in_it():
    found = closed("lane_change_end")
    assert (found.lanes, found.disallowed, found.twins) == ((), False, False)


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        (
            "lane_change",
            ["obstacles.listed[0].width_m=6", "obstacles.listed[0].l_m=1.75"],
            r"obstacles.listed\[0\]: no way round at s = 794.0 m; allowed: a lane left",
        ),
        (
            "lane_change",
            ["obstacles.listed[0].l_m=-20"],
            r"obstacles.listed\[0\]: closes no lane at s = 794.0 m; allowed: l_m in a",
        ),
        (
            "lane_change",
            ["obstacles.closure=lane_end", "obstacles.known_from_m=null"],
            "obstacles.closure: is lane_end, but no lane ends at s = 794.0 m, l = 0 m",
        ),
        (
            "lane_change_end",
            ["obstacles.known_from_m=100"],
            "obstacles.known_from_m: is of signs, the end of a lane is on the map",
        ),
        (
            "lane_change",
            ["obstacles.closure=wall"],
            "obstacles.closure: is the text 'wall'; allowed: stopped_vehicle, disallow",
        ),
        (
            "lane_change",
            ["obstacles.listed=null"],
            "obstacles.listed: is missing; allowed: the bodies of the closure",
        ),
        (
            "lane_change",
            ["obstacles.random={first_m: 20}"],
            "obstacles.random: is beside closure; allowed: listed",
        ),
        (
            "lane_change",
            ["obstacles={known_from_m: 20}"],
            "known_from_m: is of a closure; allowed: closure beside it",
        ),
        (
            "lane_change",
            ["obstacles.listed[0].s_m=5000"],
            r"obstacles.listed\[0\].s_m: is 5000; allowed: 0 to 1800.0",
        ),
        (
            "lane_change",
            ["obstacles.listed[0].s_m=302"],
            r"obstacles.listed\[0\]: an obstacle stands on the ego",
        ),
    ],
)
def test_a_closure_that_cannot_be_is_one_line(name, overrides, message):
    with pytest.raises(ConfigError, match=message) as error:
        layout_of(name, *overrides)
    assert "\n" not in str(error.value)


def test_a_part_of_a_lane_can_be_closed_by_stopped_vehicles_only():
    elsewhere = "obstacles.listed[0].s_m=700"
    with pytest.raises(ConfigError, match="closes only a part of lane own1_0"):
        closed("lane_change", elsewhere, "obstacles.closure=disallowed")
    with pytest.raises(ConfigError, match="can be told of whole lanes only"):
        closed("lane_change", elsewhere)
    assert closed("lane_change", elsewhere, told=False).twins


def test_the_closure_stands_in_the_resolved_scenario(tmp_path):
    scenario, _ = layout_of("lane_change", "obstacles.closure=disallowed")
    section = scenario.resolved()["obstacles"]
    assert section["closure"] == "disallowed"
    assert section["known_from_m"] == 500.0
    assert len(section["listed"]) == 1
    plain = load_scenario(
        "lane_change", overrides=["obstacles=[{s_m: 9, radius_m: 1}]"]
    )
    assert isinstance(plain.resolved()["obstacles"], list)


def test_settings_of_sumos_driver_lie_over_those_of_its_name():
    scenario, _ = layout_of("lane_change", planner="lane_change")
    assert sumo_driver(scenario) is None
    scenario = load_scenario(
        "lane_change",
        planner="sumo_sublane",
        overrides=["planner.settings.assertive=2"],
    )
    driver = sumo_driver(scenario)
    assert driver.assertive == 2.0
    assert driver.lateral_resolution == tuned_driver(SUBLANE_FILE).lateral_resolution
    assert driver.lateral_resolution > 0.0
    assert not SUMO_DRIVERS["sumo_as_shipped"].told
    assert SUMO_DRIVERS["sumo_tuned"] == tuned_driver()


@pytest.mark.parametrize("setting", ["strategic=-1", "assertive=0", "cooperative=2"])
def test_settings_of_sumos_driver_out_of_range_are_one_line(setting, capsys):
    from experiments.planners.registry import make_planner

    key, value = setting.split("=")
    with pytest.raises(ConfigError, match=f"planner.settings.*{key}"):
        make_planner("sumo", {key: float(value)})
