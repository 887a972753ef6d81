"""How an episode of one ego ends, and the reason that is told, in real traffic."""

import re

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.blockage import STANDING, WAITING_ROOM
from experiments.cosim.records import EpisodeStatus
from experiments.episode.run import run_episode

STANDS = re.compile(
    r"s = [\d.]+ m of 300.0 m at t = [\d.]+ s, stands since t = (.*?) s: (.*)"
)


def drive(out, name, *overrides):
    """Drive a shipped junction until the time is over; returns ending and records."""
    records = []
    scenario = load_scenario(name, overrides=overrides)
    ending = run_episode(scenario, out=out, on_step=records.append).ending
    assert ending.status == EpisodeStatus.TIMEOUT
    return ending, records


@pytest.mark.sumo
def test_an_ego_that_gives_way_until_the_time_is_over_says_to_whom(tmp_path):
    busy = "traffic.cross_veh_per_h=1500"
    _, whole = drive(tmp_path, "t_junction", busy, "simulation.duration_s=25")
    waits = [x.time for x in whole if x.gives_way_to and x.ego.speed < STANDING]
    until = f"simulation.duration_s={max(waits):.1f}"  # the same run, while it waits
    ending, records = drive(tmp_path, "t_junction", busy, until)
    since, why = STANDS.fullmatch(ending.reason).groups()
    last = records[-1]
    other = why.removeprefix("gives way to ")
    assert why == f"gives way to {last.gives_way_to}"
    # that one is there, goes first, and the ego stands at the line that it closes
    assert other in last.traffic.vehicles.ids
    assert any(foe.vehicle == other for foe in last.traffic.foes)
    body = load_scenario("t_junction").ego.vehicle.to_planner()
    front = last.ego_frenet.s + body.front_reach
    assert any(0.0 <= line - front <= WAITING_ROOM for line in last.stop_lines)
    # it has stood since then, and not before
    for record in records:
        stands = record.ego.speed < STANDING
        if record.time >= float(since):
            assert stands
        elif record.time >= float(since) - 0.15:
            assert not stands


@pytest.mark.sumo
def test_an_ego_that_drives_when_the_time_is_over_does_not_stand(tmp_path):
    ending, records = drive(tmp_path, "t_junction", "simulation.duration_s=3")
    assert records[-1].ego.speed > STANDING
    assert re.fullmatch(r"s = [\d.]+ m of 300.0 m at t = 3.0 s", ending.reason)


@pytest.mark.sumo
def test_an_ego_at_a_red_light_does_not_name_whom_it_gives_way_to(tmp_path):
    ending, records = drive(tmp_path, "unprotected_left", "simulation.duration_s=25")
    assert records[-1].traffic.signals[0].state == "r"
    assert "stands since" in ending.reason
    assert "gives way to" not in ending.reason
