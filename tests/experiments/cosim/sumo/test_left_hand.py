"""Left-hand networks: lanes, lateral speeds and ghost are those of the mirror image."""

import pytest

from experiments.cosim.sumo.cooperation import Cooperation, CooperationSettings
from experiments.cosim.sumo.frames import front_from_rear_axle
from experiments.cosim.sumo.ghost_pose import ghost_pose
from experiments.cosim.sumo.lanes import Strip, edge_lanes
from experiments.cosim.sumo.vehicle_reader import VehicleReader
from planner.interface import Indicator
from planner.states import CartesianState
from planner.vehicle import Vehicle
from tests.sumo_nets.generated import generate

pytestmark = pytest.mark.sumo

EDGE = "A0A1"  # north-bound, along +y


@pytest.fixture
def started(tmp_path):
    """Start one vehicle on the kerb lane of a grid, left-hand or not."""
    import libsumo

    def start(*options):
        net = generate(
            tmp_path, "--grid", "--grid.number=2", "--grid.length=300", "-L2", *options
        )
        routes = tmp_path / "r.rou.xml"
        routes.write_text(
            f'<routes><route id="r" edges="{EDGE}"/><vehicle id="v" route="r" '
            'depart="0" departLane="0" departSpeed="10"/></routes>'
        )
        command = ["sumo", "-n", str(net), "-r", str(routes), "--step-length", "0.1"]
        libsumo.start([*command, "--lanechange.duration", "2.5", "--no-step-log"])
        return libsumo

    yield start
    if libsumo.isLoaded():
        libsumo.close()


@pytest.mark.parametrize(("options", "side"), [((), 1.0), (("--lefthand",), -1.0)])
def test_lanes_go_from_right_to_left_and_lateral_speed_is_to_the_left(
    started, options, side
):
    sumo = started(*options)
    right, left = edge_lanes(sumo, EDGE)
    assert right.project(*left.at(50.0)[:2])[1] == pytest.approx(3.2)
    assert (right.index, left.index) == ((0, 1) if side > 0.0 else (1, 0))
    reader = VehicleReader(sumo, set(), left_hand=side < 0.0)
    for _ in range(10):
        sumo.simulationStep()
    sumo.vehicle.changeLane("v", 1, 100.0)  # away from the kerb
    for _ in range(5):
        sumo.simulationStep()
    before = reader.of(["v"])
    for _ in range(5):
        sumo.simulationStep()
    after = reader.of(["v"])
    moved = -(after.x[0] - before.x[0]) / 0.5  # left of north is west
    assert moved * side > 0.5
    # the body turns into the lane while its front moves
    assert after.lateral_speed[0] == pytest.approx(side * 1.28, abs=0.02)


@pytest.mark.parametrize("asked", [Indicator.LEFT, Indicator.RIGHT])
@pytest.mark.parametrize(
    ("options", "inner"), [((), Indicator.LEFT), (("--lefthand",), Indicator.RIGHT)]
)
def test_who_is_behind_in_the_indicated_lane_opens_a_gap(
    started, options, inner, asked
):
    sumo = started(*options)
    sumo.vehicle.add("behind", "r", departLane="1", departPos="20", departSpeed="10")
    sumo.simulationStep()
    sumo.vehicle.moveTo("v", f"{EDGE}_0", 32.0)  # on the kerb lane
    for name in ("v", "behind"):
        sumo.vehicle.setMaxSpeed(name, 10.0)
        sumo.vehicle.setLaneChangeMode(name, 0)
    settings = CooperationSettings(1, 1.0)
    left_hand = "--lefthand" in options
    helps = Cooperation(sumo, settings, "v", frozenset(), left_hand=left_hand)
    slowest = 10.0
    for k in range(30):
        helps.update(0.1 * k, asked)
        sumo.simulationStep()
        slowest = min(slowest, float(sumo.vehicle.getSpeed("behind")))
    assert (slowest < 9.0) is (asked is inner)


def needed(lanes, ego):
    front = front_from_rear_axle(ego, Vehicle())[:2]
    return ghost_pose(Strip(lanes), front, ego, Vehicle())


@pytest.mark.parametrize("options", [(), ("--lefthand",)])
def test_ghost_is_in_the_lane_that_the_body_reaches_into(started, options):
    lanes = edge_lanes(started(*options), EDGE)
    x, y, heading = lanes[0].at(60.0)
    over_left_line = CartesianState(x - 0.9, y, heading, 0.0, 8.0, 0.0)
    pose = needed(lanes, over_left_line)
    assert pose is not None
    assert pose.lane == lanes[1].index
    assert pose.x == pytest.approx(x - 3.2)
    off_the_edge = CartesianState(x + 0.9, y, heading, 0.0, 8.0, 0.0)
    assert needed(lanes, off_the_edge) is None
