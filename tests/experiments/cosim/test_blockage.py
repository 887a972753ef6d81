from experiments.cosim.blockage import BlockageDetector
from experiments.cosim.records import TrafficState
from planner.interface import PlanStats
from tests.experiments.road_users import road_users

STEP = 0.5
NAMED = PlanStats("every way ahead is taken", blocker="wall")


def traffic(time: float, **speeds: float) -> TrafficState:
    cars = [(name, 0.0, 0.0, 0.0, speed) for name, speed in speeds.items()]
    return TrafficState(time, road_users(*cars))


def first_blocked(at, patience: float = 5.0, until: float = 30.0) -> float | None:
    """Stand at s = 10 m; `at(t)` gives (speed, traffic, stop lines, stats)."""
    detector = BlockageDetector(patience, front_reach=3.8)
    for k in range(int(until / STEP)):
        time = k * STEP
        speed, others, lines, stats = at(time)
        if detector.update(10.0, speed, others, lines, stats):
            return time
    return None


def test_a_static_body_in_the_way_blocks():
    assert first_blocked(lambda t: (0.0, traffic(t), (), NAMED)) == 5.0


def test_a_reason_alone_blocks():
    stats = PlanStats("no candidate survived")
    assert first_blocked(lambda t: (0.0, traffic(t), (), stats)) == 5.0


def test_standing_for_no_reason_is_not_blocked():
    assert first_blocked(lambda t: (0.0, traffic(t), (), PlanStats())) is None


def test_moving_starts_the_clock_again():
    def at(t):
        return (0.3 if t == 4.0 else 0.05), traffic(t), (), NAMED

    assert first_blocked(at) == 9.5


def test_who_stands_at_a_closed_line_waits():
    def at(t):
        return 0.0, traffic(t), ((15.0,) if t < 12.0 else ()), NAMED

    assert first_blocked(at) == 17.0


def test_a_far_stop_line_does_not_excuse_a_wall():
    assert first_blocked(lambda t: (0.0, traffic(t), (90.0,), NAMED)) == 5.0


def test_a_queue_before_a_far_stop_line_waits():
    queue = PlanStats("follows", blocker="lead")
    assert first_blocked(lambda t: (0.0, traffic(t, lead=0.0), (90.0,), queue)) is None


def test_a_vehicle_that_stands_as_long_blocks():
    queue = PlanStats("follows", blocker="lead")
    assert first_blocked(lambda t: (0.0, traffic(t, lead=0.0), (), queue)) == 5.0


def test_a_queue_that_moves_does_not_block():
    queue = PlanStats("follows", blocker="lead")

    def at(t):
        return 0.0, traffic(t, lead=1.0 if t % 4.0 == 0.0 else 0.0), (), queue

    assert first_blocked(at) is None


def test_other_vehicles_that_stand_are_no_excuse():
    crossing = PlanStats("gives way", blocker="crossing")

    def at(t):
        return 0.0, traffic(t, parked=0.0, crossing=9.0), (), crossing

    assert first_blocked(at) is None
