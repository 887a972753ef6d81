"""Nobody brakes for an ego in the lane that it has left."""

import math
from dataclasses import replace

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.road import EgoTask, Start
from experiments.cosim.sumo import frames
from experiments.cosim.sumo import ghost_vehicle as ghost
from experiments.cosim.sumo.settings import SumoSettings
from experiments.cosim.sumo.world import SumoWorld
from experiments.world_setup.layout import make_layout
from planner.reference_path.frenet import state_on_path
from planner.vehicle import Vehicle
from tests.experiments.cosim.conftest import CALM, EGO, quintic

CAR = Vehicle()
GENTLE = -0.2  # [m/s²]


def slower_car(route: str, lane: int, position: float) -> str:
    return (
        f'<vehicle id="passed" type="car" route="{route}" depart="0" '
        f'departLane="{lane}" departPos="{position:g}" departSpeed="8"/>'
    )


def hardest_braking(world: SumoWorld, states) -> float:
    """Drive along states; give the passed car's least acceleration, and check that."""
    ahead = []
    hardest = 0.0
    world.enter()
    for state in states:
        world.advance(state)
        traffic = world.observe()
        assert traffic.vehicles.ids == ("passed",)
        hardest = min(hardest, float(traffic.vehicles.acceleration[0]))
        dx, dy = traffic.vehicles.x[0] - state.x, traffic.vehicles.y[0] - state.y
        ahead.append(dx * math.cos(state.heading) + dy * math.sin(state.heading))
    world.close()
    assert ahead[0] > 20.0  # it was ahead and has been passed
    assert ahead[-1] < -10.0
    return hardest


@pytest.mark.sumo
@pytest.mark.parametrize("duration", [2.0, 4.0, 7.0])
def test_a_car_in_the_left_lane_is_passed_in_peace(
    straight, lane_change, monkeypatch, duration
):
    def drive() -> float:
        world = straight(
            slower_car("own", 1, 110.0),
            car='maxSpeed="8"',
            start_speed=13.0,
            start_s=50.0,
        )
        start = state_on_path(world.road.path, 50.0, 0.0, 13.0)
        return hardest_braking(
            world, (lane_change(start, 0.1 * k, duration=duration) for k in range(180))
        )

    assert drive() > GENTLE
    # what is to be prevented does happen without it
    monkeypatch.setattr(ghost, "clear_note", lambda *_: True)
    assert drive() < -5.0


@pytest.mark.sumo
def test_the_car_behind_and_the_ego_itself_notice_nothing(
    straight, lane_change, monkeypatch
):
    libsumo = pytest.importorskip("libsumo")
    behind = (
        '<vehicle id="behind" type="car" route="own" depart="0" departLane="2" '
        'departPos="35" departSpeed="13"/>'
    )

    def speeds() -> list[float]:
        world = straight(behind, start_speed=11.0)
        start = world.enter()
        seen = []
        for k in range(1, 120):
            state = lane_change(start, 0.1 * k, duration=4.0)
            world.advance(state)
            front = frames.front_from_rear_axle(state, CAR)[:2]
            assert libsumo.vehicle.getPosition("ego") == pytest.approx(front, abs=1e-9)
            assert libsumo.vehicle.getSpeed("ego") == 11.0
            seen.append(float(world.observe().vehicles.speed[0]))
        world.close()
        return seen

    cleared = speeds()
    assert max(cleared) > 13.5  # it came up and slowed down
    assert cleared[-1] < 12.0
    monkeypatch.setattr(ghost, "clear_note", lambda *_: True)
    assert speeds() == cleared


@pytest.fixture
def bend(tmp_path):
    """Make the curved road of lane changes, with a slow car on its second edge."""
    net = make_layout(load_scenario("lane_change_curved", overrides=["obstacles=none"]))
    assert net.network is not None
    edges = " ".join(net.network.route[1:])
    file = tmp_path / "demand.rou.xml"
    file.write_text(
        f'<routes>{EGO}<vType id="car" length="4.6" width="1.8" maxSpeed="8" '
        f'emergencyDecel="9" {CALM}/><route id="beside" edges="{edges}"/>'
        f"{slower_car('beside', 0, 30.0)}</routes>"
    )
    return SumoWorld(
        SumoSettings(
            net.network.net_file,
            file,
            net.network.route,
            net.road,
            EgoTask(CAR, net.road.path.length, 13.0, Start(380.0, 0.0, 13.0)),
            warm_up=0.0,
        )
    )


@pytest.mark.sumo
@pytest.mark.parametrize("share", [0.3, 0.42, 0.58, 0.7])  # over the line in the middle
def test_an_edge_may_end_while_the_ego_is_over_the_line(bend, share):
    end_of_edge, speed, duration = 460.0, 13.0, 4.0
    crossing = (end_of_edge - 380.0 - CAR.front_reach) / speed

    def state(t: float):
        begin = crossing - share * duration
        l, later = (3.5 * quintic(t + h, begin, duration) for h in (0.0, 1e-4))
        place = state_on_path(bend.road.path, 380.0 + speed * t, l, speed)
        turn = math.atan2(later - l, speed * 1e-4)
        return replace(place, heading=place.heading + turn)

    assert hardest_braking(bend, (state(0.1 * k) for k in range(170))) > GENTLE
