import numpy as np

from experiments.cosim.blockage import NOTHING_AHEAD, BlockageDetector
from experiments.cosim.records import TrafficState
from planner.interface import PlanStats
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState, FrenetState
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

STEP = 0.5
PATH = ReferencePath.from_segments([line(200.0)])
BOUNDS = RoadBounds([0.0, 200.0], [5.0, 5.0], [-3.0, -3.0])
NAMED = PlanStats("every way ahead is taken", blocker="wall")


def traffic(time: float, **speeds: float) -> TrafficState:
    cars = [(name, 0.0, 0.0, 0.0, speed) for name, speed in speeds.items()]
    return TrafficState(time, road_users(*cars))


def first_blocked(at, patience: float = 5.0, until: float = 30.0) -> float | None:
    """Stand at s = 10 m; `at(t)` gives (speed, traffic, stop lines, stats)."""
    detector = BlockageDetector(patience, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    for k in range(int(until / STEP)):
        time = k * STEP
        speed, others, lines, stats = at(time)
        ego = CartesianState(10.0, 0.0, 0.0, 0.0, speed, 0.0)
        if detector.update(place, ego, others, lines, stats):
            return time
    return None


def test_a_static_body_in_the_way_blocks():
    assert first_blocked(lambda t: (0.0, traffic(t), (), NAMED)) == 5.0


def test_a_reason_alone_blocks():
    stats = PlanStats("no candidate survived")
    assert first_blocked(lambda t: (0.0, traffic(t), (), stats)) == 5.0


def test_standing_for_good_is_blocked_also_without_a_reason():
    assert first_blocked(lambda t: (0.0, traffic(t), (), PlanStats())) == 5.0
    parked = first_blocked(lambda t: (0.0, traffic(t, parked=0.0), (), PlanStats()))
    assert parked == 5.0


def test_without_a_reason_the_ego_may_give_way_for_longer():
    def at(t):
        return 0.0, traffic(t, crossing=9.0), (), PlanStats()

    assert first_blocked(at) == 15.0


def test_what_the_planner_explains_is_said():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    ego = CartesianState(10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    detector.update(place, ego, traffic(2.0), (), PlanStats())
    told = [
        detector.standing(place, traffic(3.0), PlanStats(blocker=name, explanation="x"))
        for name in (None, "a")
    ]
    assert told[0].endswith("its plans do not move off; its plan: x")
    assert told[1].endswith("a is in the way; its plan: x")


def test_the_reason_says_since_when():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    ego = CartesianState(10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    said = [
        detector.update(place, ego, traffic(2.0 + STEP * k), (), stats)
        for stats in (PlanStats(), NAMED)
        for k in range(11)
    ]
    assert said[9] is None
    words = "stood 5 s at s = 10.0 m, since t = 2.0 s: "
    assert said[10] == f"{words}the planner gives no reason{NOTHING_AHEAD}"
    assert said[-1] == f"{words}every way ahead is taken"


def queue(time: float, *places: float, speed: float = 0.0) -> TrafficState:
    """Stand in the ego's lane, centres at these places [m]."""
    cars = [(f"car{k}", s, 0.0, 0.0, speed) for k, s in enumerate(places)]
    return TrafficState(time, road_users(*cars))


def test_a_queue_at_a_red_light_is_not_blocked_when_it_turns_green():
    """The planner says nothing while it stands, and names a reason at green."""

    def at(t):
        red = t < 20.0
        stats = PlanStats() if red else PlanStats("no room", blocker=None)
        return 0.0, queue(t, 20.0, 28.0, 36.0), ((42.0,) if red else ()), stats

    assert first_blocked(at) == 25.0


def test_a_parked_vehicle_far_before_a_red_light_is_no_queue():
    assert first_blocked(lambda t: (0.0, queue(t, 20.0), (90.0,), PlanStats())) == 5.0


def test_a_wall_behind_a_light_blocks_though_no_green_lasts_long_enough():
    """Green for 4 s, red for 6 s: the greens add up."""

    def at(t):
        return 0.0, traffic(t), ((15.0,) if t % 10.0 >= 4.0 else ()), NAMED

    assert first_blocked(at) == 11.5


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


def test_without_a_reason_the_body_that_stands_ahead_is_named():
    def obstacles(*bodies):
        x, y, length, width, radius = np.array(bodies, dtype=float).reshape(-1, 5).T
        ids = tuple(f"obstacle.{k}" for k in range(x.size))
        return Obstacles(ids, x, y, 0.0 * x, length, width, radius)

    def reason(*bodies, cars=()):
        detector = BlockageDetector(5.0, Vehicle(), PATH, obstacles(*bodies), BOUNDS)
        place = FrenetState(10.0, *(0.0,) * 7)
        ego = CartesianState(10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        said = None
        for k in range(40):
            now = TrafficState(STEP * k, road_users(*cars, length=4.0, width=2.0))
            said = said or detector.update(place, ego, now, (), PlanStats())
        return said.partition("no reason")[2]

    def ahead(name, gap, left, right):
        sides = f"{left} m free on its left and {right} m on its right"
        return f"; {name} stands {gap} m ahead, with {sides} for a body 1.9 m wide"

    wall = (20.0, 0.0, 4.0, 2.0, 0.0)  # its near end is 18 m, the front bumper 13.8 m
    assert reason(wall) == ahead("obstacle.0", 4.2, 4.0, 2.0)
    far = (60.0, 0.0, 0.0, 0.0, 1.0)
    assert reason(far, wall) == ahead("obstacle.1", 4.2, 4.0, 2.0)
    assert reason((20.0, 1.9, 0.0, 0.0, 1.0)) == ahead("obstacle.0", 5.2, 2.1, 3.9)
    assert reason((20.0, 2.0, 0.0, 0.0, 1.0)) == NOTHING_AHEAD  # beside the way
    assert reason((8.0, 0.0, 4.0, 2.0, 0.0)) == NOTHING_AHEAD  # behind
    beside = (20.0, 3.5, 0.0, 0.0, 0.5)
    assert reason(wall, beside) == ahead("obstacle.0", 4.2, "2.0", "2.0")
    parked = [("a", 17.8, 0.5, 0.0, 0.0)]
    assert reason(wall, cars=parked) == ahead("a", "2.0", 3.5, "2.0")
    driving = [("a", 17.8, 0.5, 0.0, 3.0)]
    assert reason(wall, cars=driving) == ahead("obstacle.0", 4.2, 4.0, 2.0)


def test_what_a_named_body_leaves_free_and_what_refused_the_motions_is_said():
    wall = Obstacles(("wall",), [20.0], [0.5], [0.0], [4.0], [2.0], [0.0])
    detector = BlockageDetector(5.0, Vehicle(), PATH, wall, BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    for blocker in ("wall", None):
        removed = {"road": 4, "lateral_jerk": 7}
        stats = PlanStats(blocker=blocker, removed=removed, explanation="no gap yet")
        said = None
        for k in range(11):
            ego = CartesianState(10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            said = detector.update(place, ego, traffic(STEP * k), (), stats) or said
        which = "is in the way" if blocker else "stands 4.2 m ahead"
        assert said is not None
        assert said.endswith(
            f": wall {which}, with 3.5 m free on its left and 2.5 m on its right "
            "for a body 1.9 m wide; motions refused: lateral jerk 7, road 4"
            "; its plan: no gap yet"
        )


def test_what_refused_the_motions_is_said_also_with_nothing_ahead():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    ego, place = CartesianState(*(0.0,) * 6), FrenetState(*(0.0,) * 8)
    stats = PlanStats(removed={"curvature": 3})
    detector.update(place, ego, traffic(0.0), (), stats)
    said = detector.standing(place, traffic(1.0), stats)
    assert said is not None
    assert said.endswith("plans do not move off; motions refused: curvature 3")


def test_an_ego_that_stands_when_the_time_is_up_says_since_when():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    for time, speed in ((0.0, 3.0), (1.0, 0.0), (2.0, 0.0)):
        ego = CartesianState(10.0, 0.0, 0.0, 0.0, speed, 0.0)
        detector.update(place, ego, traffic(time), (), PlanStats())
        said = detector.standing(place, traffic(time), NAMED)
        expected = "stands since t = 1.0 s: every way ahead is taken"
        assert said == (None if speed else expected)


def test_an_ego_that_gives_way_when_the_time_is_up_says_for_whom():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    ego, place = CartesianState(*(0.0,) * 6), FrenetState(*(0.0,) * 8)
    detector.update(place, ego, traffic(0.0), (), PlanStats())
    stats = PlanStats(removed={"road": 3})
    said = detector.standing(place, traffic(1.0), stats, "foe.3")
    assert said == "stands since t = 0.0 s: gives way to foe.3"


def test_an_ego_at_a_closed_line_says_so_until_it_has_set_off():
    detector = BlockageDetector(5.0, Vehicle(), PATH, Obstacles.none(), BOUNDS)
    place = FrenetState(10.0, *(0.0,) * 7)
    ego = CartesianState(10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    stats = PlanStats(removed={"road": 304}, explanation="keep lane 1")
    line_s = 10.0 + Vehicle().front_reach + 0.5
    detector.update(place, ego, traffic(4.0), (line_s,), stats)
    words = f"waits at the line at s = {line_s:.1f} m, a red light or a sign"
    assert detector.standing(place, traffic(4.1), stats).endswith(words)
    said = detector.standing(place, traffic(4.1), NAMED)
    assert said.endswith("every way ahead is taken")
    opened = detector.standing(place, traffic(6.0), stats)
    assert opened.endswith(f"{words}, closed until t = 4.0 s")
    assert "do not move off" in detector.standing(place, traffic(9.0), stats)
    moving = CartesianState(10.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    detector.update(place, moving, traffic(9.5), (), stats)
    detector.update(place, ego, traffic(10.0), (line_s + 50.0,), stats)
    assert "waits" not in detector.standing(place, traffic(10.0), stats)
