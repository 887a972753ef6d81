"""The shipped street with crossings: people on foot go first."""

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.vehicle_reader import PERSON
from experiments.episode.preview import preview
from experiments.episode.run import run_episode
from sumo_nets.catalogue import network
from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.right_of_way import passages


def test_people_go_first_at_both_crossings():
    road = network("crossing")
    net = read_net(road.net_file)
    lanes = choose_lanes(net, road.route, road.lane)
    found = [
        x for passage in passages(net, lanes) if passage for x in passage.crossings
    ]
    assert [crossing.lane.edge.id for crossing in found] == [":zebra_c0", ":centre_c0"]
    assert all(crossing.goes_first for crossing in found)


def test_the_preview_names_the_files_of_the_traffic():
    said = dict(preview(load_scenario("crossing")).facts)
    assert said["traffic"] == "that of crossing.rou.xml, from 0 s on"


@pytest.mark.sumo
@pytest.mark.parametrize("seed", range(3))
def test_ego_waits_for_people_and_arrives(tmp_path, seed):
    people = set()

    def note(record):
        ids = record.traffic.vehicles.ids
        people.update(name for name in ids if name.startswith(PERSON))

    scenario = load_scenario("crossing", seed=seed)
    row = run_episode(scenario, out=tmp_path, on_step=note).row
    assert people
    assert row["arrived"]
    assert row["collisions"] == row["off_road_steps"] == row["line_violations"] == 0
